"""Keys that do nothing unless another key goes with them: what is stated without effect is a mistake."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from collaudit.core.config.config_table import ConfigTable
from collaudit.core.config.schema import Config


@dataclass(frozen=True, slots=True)
class Need:
    """What a key needs for an effect.

    Attributes:
        key: dotted.
        needs: the line that goes with it, in words.
        holds: whether a configuration has it.
    """

    key: str
    needs: str
    holds: Callable[[Config], bool]


#: All keys of which that is known.
NEEDS = (
    Need(
        "log.units.torque_constant_nm_per_a",
        '[log.units] effort = "A" or "mA"',
        lambda config: config.log.units.effort in ("A", "mA"),
    ),
    Need(
        "log.units.rated_torque_nm",
        '[log.units] effort = "percent" or "permille"',
        lambda config: config.log.units.effort in ("percent", "permille"),
    ),
    Need("robot.dh_convention", "[[robot.dh]] rows", lambda config: bool(config.robot.dh)),
    Need("robot.motor_side", "[robot] reduction", lambda config: config.robot.reduction is not None),
    Need(
        "robot.tool.com_m",
        "[robot.tool] mass_kg",
        lambda config: "mass_kg" in config.robot.tool.given and config.robot.tool.mass_kg != "estimate",
    ),
    Need(
        "detect.observer_gain_per_s",
        "[detect] detector with an observer, not direct",
        lambda config: config.detect.detector != "direct",
    ),
)


def without_effect(config: Config) -> tuple[Need, ...]:
    """Keys that the configuration states and that do nothing in it."""
    return tuple(need for need in NEEDS if _states(config, need.key) and not need.holds(config))


def _states(config: Config, dotted: str) -> bool:
    *tables, key = dotted.split(".")
    table: ConfigTable = config
    for name in tables:
        table = getattr(table, name)
    return key in table.given
