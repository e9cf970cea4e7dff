"""Recommended thresholds in the form of a configuration, or of a controller whose interface is public."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import tomlkit
from tomlkit.items import KeyType, SingleKey, Table

from collaudit.core.config.toml_text import to_toml
from collaudit.core.errors import ConfigError
from collaudit.core.recommend.arm_recommendation import ArmRecommendation
from collaudit.reports.terminal.recommendation_text import claim

#: What :func:`snippet` makes.
SNIPPETS = ("config", "franka", "kuka", "ur")

_FRANKA = """\
// libfranka, from collaudit: {claim}
// Joints in this order: {joints}
// External torque above the lower threshold is reported as a contact; above the upper one the robot stops. The logs
// tell the lower one. Where the robot must stop is yours to state: upper_torque_nm, above the lower one.
// What these logs say of forces is not here: keep the force thresholds that are set ({{...}} below).
// The controller estimates external torque by a filter of its own: try these before relying on them.
const std::array<double, {count}> lower_torque_nm{{{{{values}}}}};
robot.setCollisionBehavior(lower_torque_nm, upper_torque_nm, {{...}}, {{...}});
"""
_KUKA = """\
; KUKA KR C: not comparable. SET_TQ_VALUES(TQ_AX1, ..., TQ_AX6) sets $COLLMON_TOL_PRO[axis], without improved collision
; monitoring $TORQMON[axis]: by axis, in whole numbers, the tolerance about the torque that the controller's own model
; asks for. Beyond it the arm stops. A threshold of a residual is no such tolerance, and a contact is no order to stop.
; Run the program free of contact, read off the controller how far each axis departs, and stay above that.
; These logs, for comparison: {values}
"""
_UR = """\
# Universal Robots: not comparable. Safety limits bound force, power, momentum, speed and stopping at the level of the
# safety system, which computes torques in its own way and does not take thresholds of a residual per joint.
# Do not set them from these numbers: {values}
"""


def snippet(kind: str, found: ArmRecommendation) -> str:
    """The thresholds as text to paste.

    Args:
        kind: one of :data:`SNIPPETS`.
        found: the recommendation.
    """

    gammas = {joint: rule.gamma_nm for joint, rule in found.joints.items() if rule.gamma_nm is not None}
    if kind == "config":
        return f"# {claim(found.rate)}\n{written_into('', found)}"
    if kind == "franka":
        values = ", ".join(f"{gamma:g}" for gamma in gammas.values())
        return _FRANKA.format(claim=claim(found.rate), joints=", ".join(gammas), count=len(gammas), values=values)
    values = ", ".join(f"{joint} {gamma:g} {found.units.get(joint, 'N·m')}" for joint, gamma in gammas.items())
    return (_KUKA if kind == "kuka" else _UR).format(values=values)


def written_into(text: str, found: ArmRecommendation, robot: str | None = None) -> str:
    """A configuration with the recommended thresholds; everything else in it stays, comments included.

    The persistence is written where it was asked for or chosen, and where the file has none. A joint without a
    recommendation keeps its threshold.

    Args:
        text: of the file.
        found: the recommendation; of one that is refused nothing is written.
        robot: write the thresholds into this robot's table of the fleet instead of ``[detect]``.

    Raises:
        ConfigError: the file has no table for this robot.
    """

    document: Any = tomlkit.parse(text)
    gammas = {joint: rule.gamma_nm for joint, rule in found.joints.items() if rule.gamma_nm is not None}
    if robot is not None:
        robots = document.get("fleet", {}).get("robots", {})
        if robot not in robots:
            expected = f"a table [fleet.robots.{robot}]"
            raise ConfigError(
                "the file does not describe this robot", found=", ".join(robots) or None, expected=expected
            )
        _set(robots[robot], found, gammas)
        return tomlkit.dumps(document)
    if "detect" not in document:
        document.append("detect", tomlkit.table())
    detect = document["detect"]
    if found.chosen_by != "set" or not {"n", "persistence_ms"} & set(detect):
        detect.pop("n", None)
        detect["persistence_ms"] = round(1e3 * found.persistence_s, 6)
    _set(detect, found, gammas)
    return tomlkit.dumps(document)


def _set(table: Any, found: ArmRecommendation, gammas: dict[str, float]) -> None:
    """Change thresholds where they stand, so that comments beside them stay; else put a table in their place."""
    stated = table.get("gamma_nm")
    if isinstance(stated, dict):
        for joint, gamma in gammas.items():
            stated[joint] = gamma
        return
    of_all = dict.fromkeys(found.joints, float(stated)) if isinstance(stated, int | float) else {}
    table.pop("gamma_nm", None)
    table.append("gamma_nm", _table(of_all | gammas))


def _table(gammas: Mapping[str, float]) -> Table:
    thresholds = tomlkit.table()
    for joint, gamma in gammas.items():
        thresholds.append(_key(joint), gamma)
    return thresholds


def _key(name: str) -> SingleKey:
    """A quoted key, in which nothing can hide."""
    return SingleKey(name, KeyType.Basic, original=to_toml(name))
