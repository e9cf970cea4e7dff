"""Plots of logs, audits, contacts and friction with matplotlib, for notebooks and scripts (extra ``plot``)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from collaudit.core.data.audit_result import Audit, FrictionFile
from collaudit.core.data.detection_result import Contact
from collaudit.core.data.friction_result import FrictionFit
from collaudit.core.data.joint_log import JointLog
from collaudit.core.errors import CollauditError, ConfigError
from collaudit.core.friction.friction_model import FrictionModel
from collaudit.core.numeric.stats import NORMAL_QUANTILE_975
from collaudit.reports.plots.joint_trace import JointTrace, TracesInMemory
from collaudit.reports.plots.plot_contact import ContactWindow, contact_window
from collaudit.reports.plots.plot_friction import band, curve
from collaudit.reports.values.contact_alarms import alarms_of
from collaudit.reports.values.words import effort_unit, speed_unit, torque_unit

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_CURVE, _LIMIT, _MODEL = "#1f5fa8", "#b00020", "#b35900"


def plot(what: JointLog | Audit | FrictionFile, contact: int | None = None) -> list[Axes]:
    """Draw a log, an audit's residuals, one of its contacts, or friction.

    Args:
        what: a log: position, velocity and effort over time; an audit: the residual of each joint with its ±γ, contacts
            shaded, what was not judged grey; a friction file: each joint's points with 95 % bars, the fitted curve and
            its 95 % band.
        contact: number of a contact of the audit, from 1: the residual of all joints over γ, and the measured and the
            modelled torque of the joint furthest above its γ.

    Returns:
        The axes; ``axes[0].figure`` is the figure.

    Raises:
        CollauditError: matplotlib is missing. ConfigError: there is no such contact.
    """
    if isinstance(what, JointLog):
        return _log(what)
    if isinstance(what, FrictionFile):
        return [_friction(axes, joint, what.joints[joint]) for joint, axes in _axes(list(what.joints), 3).items()]
    return _residuals(what) if contact is None else _contact(what, contact)


def _axes(names: list[str], columns: int = 1, height: float = 2.2, **shared: Any) -> dict[str, Axes]:
    """A figure with so many axes, by name."""
    try:
        from matplotlib import pyplot
    except ModuleNotFoundError as error:
        raise CollauditError(
            "plots need matplotlib", found="it is not installed", hint="python -m pip install 'collaudit[plot]'"
        ) from error
    columns = max(1, min(columns, len(names)))
    rows = -(-len(names) // columns)
    size = (9.0, height * rows + 0.4)
    figure, grid = pyplot.subplots(rows, columns, squeeze=False, figsize=size, layout="constrained", **shared)
    for empty in grid.flat[len(names) :]:
        figure.delaxes(empty)
    return dict(zip(names, grid.flat, strict=False))


def _log(log: JointLog) -> list[Axes]:
    recorded = {
        "position, rad or m": log.position_rad,
        "velocity, rad/s or m/s": log.velocity_rad_s,
        "effort, raw" if log.effort_unit == "raw" else "effort, N·m or N": log.effort,
    }
    known = {name: values for name, values in recorded.items() if values is not None}
    axes = _axes(list(known), sharex=True)
    for name, values in known.items():
        axes[name].plot(log.time_s, values, linewidth=0.8, label=list(log.joint_names))
        axes[name].set_ylabel(name)
    made = list(axes.values())
    made[0].set_title(log.source.name)
    made[0].legend(ncols=4, fontsize="small")
    made[-1].set_xlabel("time from the log's first sample, s")
    return made


def _residuals(audit: Audit) -> list[Axes]:
    source, contacts = TracesInMemory(audit.signals), audit.result.contacts
    axes = _axes(list(source.joint_names), height=1.3, sharex=True)
    for k, (joint, one) in enumerate(axes.items()):
        _residual(one, source.trace(k))
        one.set_ylabel(f"{joint}\n{torque_unit(audit.result, joint)}")
        for contact in contacts:
            one.axvspan(contact.onset_s, contact.end_s, color=_LIMIT, alpha=0.12 if joint in contact.joints else 0.04)
    made = list(axes.values())
    made[0].set_title(f"{audit.result.log.name}: residual, ±γ, contacts; grey: not judged")
    made[-1].set_xlabel("time from the log's first sample, s")
    return made


def _residual(axes: Axes, trace: JointTrace) -> None:
    known = trace.judged | trace.standing
    for shown, color in ((~known, "0.7"), (known, _CURVE)):
        axes.plot(trace.time_s, np.where(shown, trace.residual_nm, np.nan), color=color, linewidth=0.8)
    if np.isfinite(trace.gamma_nm):
        for level in (-trace.gamma_nm, trace.gamma_nm):
            axes.axhline(level, color=_LIMIT, linestyle="--", linewidth=0.8)


def _contact(audit: Audit, number: int) -> list[Axes]:
    contacts = audit.result.contacts
    if not 1 <= number <= len(contacts):
        raise ConfigError("there is no such contact", found=str(number), expected=f"1 to {len(contacts)}")
    contact, source = contacts[number - 1], TracesInMemory(audit.signals)
    windows = [contact_window(source.trace(k), contact) for k in range(len(source.joint_names))]
    known = {window.joint: window for window in windows if window is not None}
    alarms = alarms_of(contact, audit.result)
    worst = max(alarms, key=lambda a: abs(a.peak_nm) / a.gamma_nm).joint if alarms else contact.joints[0]
    ratio, torque = _axes(["ratio", "torque"], sharex=True).values()
    _ratios(ratio, list(known.values()), contact)
    ratio.set_title(f"Contact {number} of {audit.result.log.name}")
    if worst in known:
        _torque(torque, known[worst], torque_unit(audit.result, worst))
    torque.set_xlabel("time from the log's first sample, s")
    return [ratio, torque]


def _ratios(axes: Axes, windows: list[ContactWindow], contact: Contact) -> None:
    for window in windows:
        style: dict[str, Any] = {} if window.reacted else {"color": "0.6", "linewidth": 0.7}
        axes.plot(window.time_s, window.ratio, label=window.joint if window.reacted else None, **style)
    for level in (-1, 1):
        axes.axhline(level, color=_LIMIT, linestyle="--", linewidth=0.8)
    axes.axvspan(contact.onset_s, contact.end_s, color=_LIMIT, alpha=0.1)
    axes.set_ylabel("residual ÷ γ")
    axes.legend(fontsize="small")


def _torque(axes: Axes, window: ContactWindow, unit: str) -> None:
    axes.plot(window.torque_time_s, window.measured_nm, color="black", linewidth=1, label="measured")
    axes.fill_between(window.torque_time_s, window.least_nm, window.most_nm, color=_MODEL, alpha=0.3)
    axes.plot(window.torque_time_s, window.least_nm, color=_MODEL, linewidth=1, linestyle="--", label="modelled")
    axes.set_ylabel(f"torque of {window.joint}, {unit}")
    axes.legend(fontsize="small")


def _friction(axes: Axes, joint: str, fit: FrictionFit) -> Axes:
    axes.set_title(f"{joint}: {fit.model or 'not fitted'}", fontsize="medium")
    axes.set_xlabel(f"speed, {speed_unit(fit)}")
    axes.set_ylabel(f"friction, {effort_unit(fit)}")
    speeds = np.array([point.speed_rad_s for point in fit.points])
    if len(speeds):
        bars = NORMAL_QUANTILE_975 * np.array([point.se_nm for point in fit.points])
        friction = [point.friction_nm for point in fit.points]
        axes.errorbar(speeds, friction, np.where(np.isfinite(bars), bars, 0.0), fmt=".", color="black", linewidth=0.8)
    law = FrictionModel.of(fit)
    reach = fit.speed_range_rad_s
    if law is not None and reach is not None:
        moving = np.linspace(*reach, 100)
        axes.plot(moving, curve(law, moving), color=_CURVE)
        spread = band(fit, moving)
        if spread is not None:
            axes.fill_between(moving, *spread, color=_CURVE, alpha=0.2)
    return axes
