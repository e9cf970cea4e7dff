"""Units and signs: from the log's to SI, in place."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from math import pi

from collaudit.core.config.schema import UnitsConfig
from collaudit.core.data.joint_log import EffortUnit
from collaudit.core.errors import ConfigError
from collaudit.core.logs.signals.joint_naming import NameMap, listed
from collaudit.core.numeric.arrays import FloatArray


def check_joint_keys(settings: UnitsConfig, known: Sequence[str]) -> None:
    """Refuse torque constants and signs for joints that nobody has.

    Args:
        settings: the units.
        known: joints of the robot and of the log, by either name.

    Raises:
        ConfigError: a key names no joint, or torque constants are given for efforts that are not currents.
    """
    for key, table in (
        ("torque_constant_nm_per_a", settings.torque_constant_nm_per_a),
        ("effort_sign", settings.effort_sign),
    ):
        for name in table:
            if name not in known:
                raise ConfigError(
                    f"[log.units] {key} names the joint {name!r}, which neither the log nor the robot has",
                    expected=f"one of {listed(known)}",
                )
    if settings.torque_constant_nm_per_a and settings.effort == "Nm" and "effort" in settings.given:
        raise ConfigError(
            "[log.units] torque_constant_nm_per_a is given, and effort is stated to be in N·m",
            hint='set effort = "A" when the log holds currents, or take the constants out',
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
            hint='effort = "raw" fits friction in the log\'s own unit',
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
    """Scale a log's columns to rad, rad/s and N·m in place, and tell the unit of the effort that results.

    Args:
        columns: quantity to (n, j).
        names: of the joints, in the order of the columns.
        settings: the units.
        prismatic: joints whose positions and velocities are in metres already.
        where: file and topic, for messages.

    Raises:
        ConfigError: efforts are currents and a joint has no torque constant.
    """
    for quantity, unit in (("position", settings.position), ("velocity", settings.velocity or settings.position)):
        if quantity in columns and (factor := angle_factor(unit)) != 1.0:
            values = columns[quantity]
            values *= [1.0 if joint in prismatic else factor for joint in names.model]
    return _scale_effort(columns.get("effort"), names, settings, where)


def _scale_effort(effort: FloatArray | None, names: NameMap, settings: UnitsConfig, where: str) -> EffortUnit:
    """Apply torque constants and signs in place."""
    joints = list(zip(names.model, names.log, strict=True))
    factors = [float(_for(settings.effort_sign, name, alias) or 1) for name, alias in joints]
    if settings.effort == "A" and effort is not None:
        constants = [_for(settings.torque_constant_nm_per_a, name, alias) for name, alias in joints]
        missing = [name for name, constant in zip(names.model, constants, strict=True) if constant is None]
        if missing:
            raise ConfigError(
                f"effort is in A, and there is no torque constant of {', '.join(map(repr, missing))}",
                where=where,
                expected="[log.units] torque_constant_nm_per_a = { "
                + ", ".join(f'"{name}" = …' for name in missing)
                + " }",
                hint='collaudit init estimates them from the robot\'s description; or set effort = "raw": collaudit '
                "fit then identifies a gain for each joint whose motion tells it",
            )
        factors = [factor * (constant or 1.0) for factor, constant in zip(factors, constants, strict=True)]
    if effort is not None and any(factor != 1.0 for factor in factors):
        effort *= factors
    return "raw" if settings.effort == "raw" else "Nm"
