"""One joint's friction: a small curve, and the tables behind it."""

from __future__ import annotations

from dataclasses import dataclass

from collaudit.core.data.audit_result import AuditResult
from collaudit.core.data.friction_result import FrictionFit, FrictionPoint
from collaudit.core.friction.friction_model import FrictionModel
from collaudit.reports.page.sections.figure import Figure
from collaudit.reports.plots.plot_friction import draw_friction
from collaudit.reports.values import rows
from collaudit.reports.values.numbers import interval, significant
from collaudit.reports.values.visible_text import visible
from collaudit.reports.values.words import effort_unit, law_text, speed_unit


@dataclass(frozen=True, slots=True)
class FrictionSheet:
    """One joint's friction.

    Attributes:
        points: speed, friction, its standard error, spread, and which way the joint moved.
        points_note: how to read the last of these.
        summary: what stands beside the curve.
    """

    joint: str
    fit: FrictionFit
    model: str
    plot: Figure | None
    parameters: tuple[rows.ParameterRow, ...]
    points: tuple[tuple[str, ...], ...]
    points_note: str
    known: tuple[tuple[str, str, str, str], ...]
    speeds: str
    rmse: str
    hold: str
    torque_unit: str
    speed_unit: str
    has_band: bool
    summary: str


def friction_sheets(result: AuditResult, key: str) -> tuple[FrictionSheet, ...]:
    """Every joint's friction, as applied."""
    return tuple(_sheet(joint, fit, f"{key}-friction-{k}") for k, (joint, fit) in enumerate(result.friction.items(), 1))


def _sheet(joint: str, fit: FrictionFit, anchor: str) -> FrictionSheet:
    torque, speed = effort_unit(fit), speed_unit(fit)
    law = FrictionModel.of(fit)
    plot = None
    if fit.points:
        label = visible(f"Friction of {joint} against speed: {fit.n_points} points, {fit.model or 'no curve'}")
        plot = Figure(anchor, joint, "", draw_friction(fit, torque, speed, f"{anchor}-plot", label))
    reach = fit.speed_range_rad_s
    return FrictionSheet(
        joint=joint,
        fit=fit,
        model=law_text(fit.model) if fit.model else "not fitted",
        plot=plot,
        parameters=tuple(rows.parameter_rows(fit)),
        points=tuple(_point_row(point, _all_disturbed(fit)) for point in fit.points),
        points_note=_points_note(fit),
        known=tuple((k.name, significant(k.value), interval(*k.ci95), k.unit) for k in fit.known),
        speeds=f"{significant(reach[0])} to {significant(reach[1])} {speed}" if reach else rows.NONE,
        rmse=f"{significant(fit.rmse_nm)} {torque}" if fit.rmse_nm is not None else rows.NONE,
        hold=f"{significant(law.hold)} {torque}" if law is not None else rows.NONE,
        torque_unit=torque,
        speed_unit=speed,
        has_band=law is not None and fit.covariance is not None,
        summary=_summary(fit),
    )


def _summary(fit: FrictionFit) -> str:
    if not fit.model:
        return f"Not fitted: {fit.reason or 'no reason was recorded'}"
    if fit.identifiable and not fit.not_identifiable:
        return f"{fit.model}, determined"
    if fit.identifiable:
        return f"{fit.model}, determined with a reservation"
    return f"{fit.model}, in part undetermined"


def _point_row(point: FrictionPoint, all_disturbed: bool) -> tuple[str, ...]:
    numbers = (significant(point.speed_rad_s, 4), significant(point.friction_nm, 4))
    spreads = (significant(point.se_nm, 2), significant(point.sd_nm, 2))
    way = "both" if point.source == "pair" else "+" if point.direction > 0 else "−"
    star = "*" if point.others_moving and not all_disturbed else ""
    return *(number.replace("-", "−") for number in numbers), *spreads, way + star


def _all_disturbed(fit: FrictionFit) -> bool:
    return all(point.others_moving for point in fit.points)


def _points_note(fit: FrictionFit) -> str:
    """How the points were found; only what occurs is said."""
    notes = []
    if any(point.source == "pair" for point in fit.points):
        notes.append("both: from both directions, gravity cancels")
    if any(point.source != "pair" for point in fit.points):
        notes.append("+ or −: from one direction, relies on the robot model")
    if _all_disturbed(fit):
        notes.append("other joints moved during every one")
    elif any(point.others_moving for point in fit.points):
        notes.append("*: other joints moved")
    return "; ".join(notes)
