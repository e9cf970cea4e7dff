"""Values of joints: units and signs from the log's to SI, in place; and those that no arm can have."""

from __future__ import annotations

import json
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from math import pi

import numpy as np

from collaudit.core.config.schema import UnitsConfig
from collaudit.core.data.joint_log import EffortUnit, JointLog, WrenchSeries
from collaudit.core.errors import ConfigError
from collaudit.core.findings import Finding
from collaudit.core.logs.signals.joint_naming import NameMap, listed
from collaudit.core.numeric.arrays import BoolArray, FloatArray, frozen

#: Units of effort of which a constant of each drive makes N·m: the key of the constants, and how many of their units.
_BY_CONSTANT = {
    "A": ("torque_constant_nm_per_a", 1.0),
    "mA": ("torque_constant_nm_per_a", 1e-3),
    "percent": ("rated_torque_nm", 1e-2),
    "permille": ("rated_torque_nm", 1e-3),
}
_HINTS = {
    "torque_constant_nm_per_a": "collaudit init estimates them from the robot's description",
    "rated_torque_nm": "the drive's data sheet states it (CiA 402: object 6076h), times the ratio of the gear",
}
_UNITS_OF = {key: [unit for unit, (own, _) in _BY_CONSTANT.items() if own == key] for key in _HINTS}
#: No arm's values are larger, whatever their unit: rad or m (encoder counts too), rad/s, effort, N or N·m.
_LARGEST = 1e9
_WORDS = {"position_rad": "position", "velocity_rad_s": "velocity", "effort": "effort"}


def check_joint_keys(settings: UnitsConfig, known: Sequence[str]) -> None:
    """Refuse constants and signs for joints that nobody has.

    Args:
        settings: the units.
        known: joints of the robot and of the log, by either name.

    Raises:
        ConfigError: a key names no joint, or constants are given for efforts in another unit.
    """
    for key in (*_UNITS_OF, "effort_sign"):
        table: Mapping[str, float] = getattr(settings, key)
        for name in table:
            if name not in known:
                raise ConfigError(
                    f"[log.units] {key} names the joint {name!r}, which neither the log nor the robot has",
                    expected=f"one of {listed(known)}",
                )
        if key in _UNITS_OF and table and "effort" in settings.given and settings.effort not in _UNITS_OF[key]:
            raise ConfigError(
                f"[log.units] {key} is given, and effort is stated to be "
                f"{'in N·m' if settings.effort == 'Nm' else repr(settings.effort)}",
                hint=f"[log.units] effort = {' or '.join(map(json.dumps, _UNITS_OF[key]))}, or take the constants out",
            )


def with_currents(settings: UnitsConfig, where: str) -> UnitsConfig:
    """Units for efforts that are currents by what the log says of them, where the configuration says nothing.

    Raises:
        ConfigError: there are no torque constants.
    """
    if "effort" in settings.given:
        return settings
    if not settings.torque_constant_nm_per_a:
        raise ConfigError(
            "the efforts are currents, and their torque constants are not stated",
            where=where,
            expected='[log.units] effort = "A" with torque_constant_nm_per_a, or effort = "raw"',
            hint='[log.units] effort = "raw" fits friction in the log\'s own unit',
        )
    return settings.changed({"effort": "A"})


def _for(table: Mapping[str, float], model: str, log: str) -> float | None:
    return table.get(model, table.get(log))


def angle_factor(unit: str) -> float:
    """Factor to radians."""
    return pi / 180.0 if unit.startswith("deg") else 1.0


def to_si(
    columns: Mapping[str, FloatArray], names: NameMap, settings: UnitsConfig, prismatic: Collection[str], where: str
) -> EffortUnit:
    """Scale a log's columns to rad, rad/s (prismatic: m, m/s) and N·m in place, and tell the unit of the effort.

    Args:
        columns: quantity to (n, j).
        names: of the joints, in the order of the columns.
        settings: the units.
        prismatic: joints whose positions and velocities are lengths.
        where: file and topic, for messages.

    Raises:
        ConfigError: efforts are in a unit that constants convert, and a joint has none.
    """
    length = 1e-3 if settings.length == "mm" else 1.0
    for quantity, unit in (("position", settings.position), ("velocity", settings.velocity or settings.position)):
        factors = [length if joint in prismatic else angle_factor(unit) for joint in names.model]
        if quantity in columns and any(factor != 1.0 for factor in factors):
            values = columns[quantity]
            values *= factors
    return _scale_effort(columns.get("effort"), names, settings, where)


def _scale_effort(effort: FloatArray | None, names: NameMap, settings: UnitsConfig, where: str) -> EffortUnit:
    """Apply the constants of the drives and signs in place."""
    joints = list(zip(names.model, names.log, strict=True))
    factors = [float(_for(settings.effort_sign, name, alias) or 1) for name, alias in joints]
    if settings.effort in _BY_CONSTANT and effort is not None:
        key, scale = _BY_CONSTANT[settings.effort]
        constants = [_for(getattr(settings, key), name, alias) for name, alias in joints]
        missing = [name for name, constant in zip(names.model, constants, strict=True) if constant is None]
        if missing:
            said = key.removesuffix("_nm_per_a").removesuffix("_nm").replace("_", " ")
            raise ConfigError(
                f"effort is in {settings.effort}, and there is no {said} of {', '.join(map(repr, missing))}",
                where=where,
                expected=f"[log.units] {key} = {{ " + ", ".join(f'"{name}" = …' for name in missing) + " }",
                hint=f'{_HINTS[key]}; or [log.units] effort = "raw": collaudit fit then identifies a gain for each '
                "joint whose motion tells it",
            )
        factors = [factor * scale * (constant or 1.0) for factor, constant in zip(factors, constants, strict=True)]
    if effort is not None and any(factor != 1.0 for factor in factors):
        effort *= factors
    return "raw" if settings.effort == "raw" else "Nm"


def without_impossible(log: JointLog, what: str) -> JointLog:
    """The log without rows whose stamp is infinite, and with values that no arm can have as missing ones.

    Args:
        log: as read.
        what: "row" or "message", as the findings count.
    """
    findings: list[Finding] = []
    changed: dict[str, FloatArray] = {}
    far = np.isinf(log.time_s)
    for name, word in _WORDS.items():
        values: FloatArray | None = getattr(log, name)
        if values is None or (bad := _beyond(values)) is None:
            continue
        bad &= ~far[:, None]  # of rows that are left out anyway nothing is said
        for j in np.flatnonzero(bad.any(axis=0)).tolist():
            joint = log.joint_names[j]
            findings.append(_finding(bad[:, [j]], values[:, [j]], f"{word} of joint '{joint}'", what, joint))
        changed[name] = _missing(values, bad)
    wrench = log.wrench
    if wrench is not None and (bad := _beyond(wrench.wrench)) is not None:
        findings.append(_finding(bad, wrench.wrench, f"wrench of {wrench.topic}", what))
        wrench = WrenchSeries(wrench.time_s, _missing(wrench.wrench, bad), wrench.topic)
    if findings:
        log = replace(log, wrench=wrench, findings=(*log.findings, *findings), **changed)  # type: ignore[arg-type]
    return _without_rows(log, far) if far.any() else log


def _without_rows(log: JointLog, far: BoolArray) -> JointLog:
    wrench = log.wrench
    if wrench is not None:
        keep = ~np.isinf(wrench.time_s)
        wrench = WrenchSeries(frozen(wrench.time_s[keep]), frozen(wrench.wrench[keep]), wrench.topic)
    return replace(log.samples(~far), wrench=wrench)


def _beyond(values: FloatArray) -> BoolArray | None:
    """Which of the numbers (n, c) no arm can have; None where there are none."""
    if not any(bool((np.abs(column) > _LARGEST).any()) for column in values.T):
        return None
    bad: BoolArray = (np.abs(values) > _LARGEST) & np.isfinite(values)
    return bad if bad.any() else None


def _missing(values: FloatArray, bad: BoolArray) -> FloatArray:
    out = values.copy(order="K")
    out[bad] = np.nan
    return frozen(out)


def _finding(bad: BoolArray, values: FloatArray, signal: str, what: str, joint: str | None = None) -> Finding:
    rows = np.flatnonzero(bad.any(axis=1))
    text = (
        f"{rows.size} values of the {signal} are beyond what an arm can have and count as missing; the "
        f"first is {values[bad][0]:.3g} in {what} {rows[0] + 1}."
    )
    return Finding("log-nan", "warning", text, joint=joint)
