"""Hard limits of a planned motion: the description's, replaced by what ``[plan]`` states; none is guessed silently."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from collaudit.core.config.schema import PlanConfig, RobotConfig
from collaudit.core.errors import ConfigError
from collaudit.core.numeric.arrays import BoolArray, FloatArray
from collaudit.core.robot.robot_description import unknown_name
from collaudit.core.robot.robot_model import RobotModel

#: Where no acceleration is stated, the highest speed takes a second; where no jerk is, the highest acceleration 0.2 s.
TO_SPEED_S, TO_ACCELERATION_S = 1.0, 0.2
#: Kept free at each end of a joint's range, rad (m if prismatic): what a drive overshoots.
POSITION_MARGIN_RAD = 0.05
#: Share of a drive's highest torque that model and friction together may ask for; the rest is the controller's.
TORQUE_SHARE = 0.8
_BY_JOINT = ("start_rad", "position_rad", "speed_rad_s", "acceleration_rad_s2", "torque_nm")


@dataclass(frozen=True, slots=True, eq=False)
class ArmLimits:
    """What a motion keeps within; rad and N·m, or m and N of prismatic joints.

    Attributes:
        joint_names: j joints in model order.
        low, high: (j,) positions, margin taken off.
        speed, acceleration, jerk: (j,).
        torque: (j,), the share that may be asked for taken.
        start: (j,) where the motion starts and ends.
        assumed: which limits are not stated, in words.
    """

    joint_names: tuple[str, ...]
    low: FloatArray
    high: FloatArray
    speed: FloatArray
    acceleration: FloatArray
    jerk: FloatArray
    torque: FloatArray
    start: FloatArray
    assumed: tuple[str, ...]

    def inside(self, q: FloatArray) -> BoolArray:
        """(n,) which of (n, j) positions are within the range of every joint."""
        return np.asarray(np.all((q >= self.low - 1e-9) & (q <= self.high + 1e-9), axis=1))


def arm_limits(robot: RobotModel, settings: RobotConfig, plan: PlanConfig,
               speed_scale: float = 1.0) -> ArmLimits:  # fmt: skip
    """Limits of an arm.

    Args:
        robot: the arm.
        settings, plan: the configuration's tables.
        speed_scale: the motion takes 1 / speed_scale of its time: speeds shrink by it, accelerations by its square,
            jerks by its cube.

    Raises:
        ConfigError: a limit is neither described nor stated, or the start is outside of the limits.
    """
    if settings.reduction is not None or settings.joint_offset_rad is not None:
        raise ConfigError(
            "no motion is planned for an arm whose controller counts other joint angles than its description",
            where="[robot] reduction, joint_offset_rad",
            hint="give a configuration for the plan whose description has the controller's zero, without these keys",
        )
    names = robot.joint_names
    for key in _BY_JOINT:
        for name in getattr(plan, key):
            if name not in names:
                raise unknown_name("the robot has no such joint", f"[plan] {key}", name, names)
    described = zip(names, robot.position_limits, strict=True)
    ranges = np.array([plan.position_rad.get(name, tuple(row)) for name, row in described])
    speed = _stated(plan.speed_rad_s, names, robot.speed_limits)
    torque = _stated(plan.torque_nm, names, robot.effort_limit_nm)
    _refuse_missing(names, {"position_rad": ranges.sum(axis=1), "speed_rad_s": speed, "torque_nm": torque})
    low, high = ranges[:, 0] + POSITION_MARGIN_RAD, ranges[:, 1] - POSITION_MARGIN_RAD
    for name, a, b in zip(names, low, high, strict=True):
        if not a < b:
            raise ConfigError("the range of a joint leaves no room", where=f"[plan] position_rad: {name}",
                              found=f"{a:.3g} to {b:.3g}, margin taken off", expected="room")  # fmt: skip
    acceleration = _stated(plan.acceleration_rad_s2, names, speed / TO_SPEED_S)
    jerk = acceleration / TO_ACCELERATION_S
    start = _stated(plan.start_rad, names, 0.5 * (low + high))
    found = ArmLimits(
        names, low, high, speed * speed_scale, acceleration * speed_scale**2, jerk * speed_scale**3,
        TORQUE_SHARE * torque, start, _assumed(plan, names),
    )  # fmt: skip
    _refuse_start(found)
    return found


def _stated(stated: Mapping[str, float], names: tuple[str, ...], otherwise: FloatArray) -> FloatArray:
    return np.array([stated.get(name, float(value)) for name, value in zip(names, otherwise, strict=True)])


def _refuse_missing(names: tuple[str, ...], known: Mapping[str, FloatArray]) -> None:
    for key, values in known.items():
        lacking = [name for name, value in zip(names, values, strict=True) if not np.isfinite(value)]
        if lacking:
            raise ConfigError(
                "the arm has no such limit, and none is guessed",
                where=f"[plan] {key}",
                found=f"nothing for {', '.join(lacking)}, neither in the robot's description nor stated",
                expected="a value for every joint",
                hint=f"state it from the robot's data sheet, e.g. {key} = {{ {lacking[0]} = … }}",
            )


def _refuse_start(limits: ArmLimits) -> None:
    for k, name in enumerate(limits.joint_names):
        if not limits.low[k] <= limits.start[k] <= limits.high[k]:
            raise ConfigError(
                "the start is outside of the joint's range",
                where=f"[plan] start_rad: {name}",
                found=f"{limits.start[k]:.4g}",
                expected=f"{limits.low[k]:.4g} to {limits.high[k]:.4g}, margin taken off",
            )


def _assumed(plan: PlanConfig, names: tuple[str, ...]) -> tuple[str, ...]:
    words = [f"jerk: taken so that the highest acceleration takes {TO_ACCELERATION_S:g} s"]
    if lacking := [name for name in names if name not in plan.acceleration_rad_s2]:
        text = (
            f"acceleration of {', '.join(lacking)}: not stated, taken so that the highest speed takes {TO_SPEED_S:g} s"
        )
        words.insert(0, text)
    if lacking := [name for name in names if name not in plan.start_rad]:
        words.append(f"start of {', '.join(lacking)}: not stated, the middle of the range")
    return tuple(words)
