"""The contact forces that must have alarmed for a log to be judged: as stated, else by default.

The defaults are round numbers, of the size of the weight of 10 and 15 kg, which is a hard push by hand; the forearm's
is larger since fewer joints feel a force there, on shorter levers. They are no limits of body regions. They depend on
the arm alone, not on thresholds, fit or noise: by a yardstick made of those any log would pass.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from collaudit.core.config.schema import PolicyConfig
from collaudit.core.data.sensitivity_result import FOREARM, TOOL, AskedBy
from collaudit.core.errors import ConfigError, did_you_mean
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.numeric.stats import median_of
from collaudit.core.robot.robot_model import RobotModel
from collaudit.core.verdict.arm_places import Place, directions, torque_per_newton

DEFAULT_N: Mapping[str, float] = {TOOL: 100.0, FOREARM: 150.0}
#: A default is at most this share of what the arm can exert: a contact that takes more than that stops a small arm.
_OF_STRENGTH = 0.5
#: What the arm can exert: from so many of the directions, in the middle of its poses.
_DIRECTIONS = 0.8


@dataclass(frozen=True, slots=True)
class RequiredForce:
    """A force that must have alarmed, N, and who asks for it."""

    force_n: float
    by: AskedBy


def asked_forces(
    policy: PolicyConfig, robot: RobotModel, places: Sequence[Place], position_rad: FloatArray, limit_nm: FloatArray
) -> dict[str, RequiredForce]:
    """The forces asked for, by place.

    Args:
        policy: what is stated.
        robot: the arm.
        places: on it.
        position_rad: (k, j) poses of the log.
        limit_nm: (j,) the joints' torque limits, N·m (N); NaN where none is known.

    Raises:
        ConfigError: a force is stated for a place that the arm does not have.
    """
    names = [place.name for place in places]
    for name in policy.observable_n:
        if names and name not in names:
            raise ConfigError(
                "a force is asked for at a place that this arm does not have",
                where="[policy] observable_n",
                found=name,
                expected="some of " + ", ".join(names),
                hint=did_you_mean(name, names),
            )
    out = {}
    for place in places:
        if place.name in policy.observable_n:
            out[place.name] = RequiredForce(policy.observable_n[place.name], "stated")
        elif place.name in DEFAULT_N:
            out[place.name] = _default(robot, place, position_rad, limit_nm)
    return out


def _default(robot: RobotModel, place: Place, position_rad: FloatArray, limit_nm: FloatArray) -> RequiredForce:
    usual = DEFAULT_N[place.name]
    strength = exerted_force(robot, place, position_rad, limit_nm)
    if strength is None or _OF_STRENGTH * strength >= usual:
        return RequiredForce(usual, "default")
    return RequiredForce(_rounded_down(_OF_STRENGTH * strength), "arm-limits")


def exerted_force(robot: RobotModel, place: Place, position_rad: FloatArray, limit_nm: FloatArray) -> float | None:
    """The force, N, that the joints' limits let an arm exert at a place from most directions, in its median pose.

    Without its weight: f = min_j limit_j / |J_v,j · d|. None where a joint before the place has no known limit.
    """
    limits = limit_nm[: place.joints]
    if not np.isfinite(limits).all() or not len(position_rad):
        return None
    arm = np.abs(torque_per_newton(robot, position_rad, place.frame)[:, : place.joints] @ directions())
    with np.errstate(divide="ignore"):
        force = np.sort((limits[:, None] / arm).min(axis=1), axis=1)
    strength = median_of(force[:, int((1.0 - _DIRECTIONS) * force.shape[1])])
    return strength if np.isfinite(strength) else None


def _rounded_down(force_n: float) -> float:
    """To two digits."""
    step = 10.0 ** (math.floor(math.log10(force_n)) - 1)
    return step * math.floor(force_n / step + 1e-9)
