"""The level a residual has to exceed: gamma, constant or in step with the motion, raised by what is uncertain.

The errors of a model grow with speed (friction, Coriolis terms) and acceleration (inertia), so a constant that is safe
while moving fast is blind while moving slowly.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from collaudit.core.data.audit_result import RuleFacts
from collaudit.core.data.recommendation_result import MotionScale
from collaudit.core.data.signals import State
from collaudit.core.data.uniform_series import UniformSeries
from collaudit.core.numeric.arrays import FloatArray, IntArray
from collaudit.core.residual.residual import Residual


@dataclass(frozen=True, eq=False)
class Threshold:
    """The level of each joint plus the residual's own uncertainty, computed where it is asked for.

    Attributes:
        series: the judged joints.
        residual: its uncertainty is added, and its kernel is what the threshold passes as well.
        rule: thresholds, and how they follow the motion.
    """

    series: UniformSeries
    residual: Residual
    rule: RuleFacts
    _kept: dict[int, FloatArray] = field(default_factory=dict)

    def of(self, j: int, part: slice | IntArray = slice(None)) -> FloatArray:
        """(n,) N·m of one joint, or of a part of its samples; NaN without one."""
        joint = self.series.joint_names[j]
        follows = joint in self.rule.follows
        level = self._moving(j, joint)[part] if follows else self.rule.gamma_nm.get(joint, np.nan)
        level = np.asarray(self.residual.uncertainty_nm[:, j][part] + level)
        if extra := self.rule.at_rest_nm.get(joint, 0.0):
            level = np.where(self.residual.state[:, j][part] == State.FRICTION_INTERVAL, level + extra, level)
        return level

    def lasting(self, j: int) -> FloatArray | None:
        """(n,) the lower level of the mean residual of one joint, N·m; None where it has none.

        In slow motion it is no lower: friction errs there for as long as the joint is slow.
        """
        joint = self.series.joint_names[j]
        if joint not in self.rule.lasting_nm:
            return None
        series, level = self.series, self.of(j)
        relative = self._relative(self.rule.lasting_follows[joint], j)
        lower = level - self._moving(j, joint) + self.rule.lasting_nm[joint] * relative
        fast = np.abs(series.velocity_rad_s[:, j]) > _SLOW_RAD_S
        return np.where(fast, lower, np.maximum(lower, level))

    def _moving(self, j: int, joint: str) -> FloatArray:
        """(n,) threshold of a joint that follows the motion, through the residual's kernel."""
        if j not in self._kept:
            series, kernel = self.series, self.residual.balance.kernel
            level = self.rule.gamma_nm[joint] * self._relative(self.rule.follows[joint], j)
            self._kept[j] = kernel.apply(level[:, None], series.segments, series.period_s)[:, 0]
        return self._kept[j]

    def _relative(self, scale: MotionScale, j: int) -> FloatArray:
        return relative_scale(scale, self.series.velocity_rad_s, j, self.series.period_s, self._arm_speed)

    @cached_property
    def _arm_speed(self) -> FloatArray:
        return arm_speed(self.series.velocity_rad_s)

    def all_joints(self) -> FloatArray:
        """(n, j) N·m."""
        out = np.empty(self.residual.uncertainty_nm.shape, order="F")
        for j in range(len(self.series.joint_names)):
            out[:, j] = self.of(j)
        return out


#: The scale is at least this share of the usual one.
LEAST_SHARE = 0.3
#: Time over which acceleration is averaged, s: longer than a contact moves it.
_AVERAGED_S = 1.0
#: Below this speed friction depends on it most: Stribeck velocities of gears lie there, rad/s (m/s if prismatic).
_SLOW_RAD_S = 0.1


def arm_speed(velocity: FloatArray) -> FloatArray:
    """(n,) norm of the joints' speeds (n, j); unknown values count as rest."""
    return np.asarray(np.linalg.norm(np.nan_to_num(velocity), axis=1))


def motion_features(velocity: FloatArray, j: int, period_s: float, arm: FloatArray | None = None) -> FloatArray:
    """(n, 5) one, closeness to rest, speed, the norm over the joints, and the mean |acceleration| of the second around.

    Args:
        velocity: (n, j) of the joints, rad/s; unknown values count as rest.
        j: the joint's column.
        period_s: sample period, s.
        arm: :func:`arm_speed` of the same, for whoever asks for several joints.
    """
    own = np.nan_to_num(velocity[:, j])
    width = max(1, round(_AVERAGED_S / period_s))
    # the mean of |a| over a window is the way that the velocity makes in it
    way = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(own, prepend=own[:1])))])
    at = np.arange(own.size)
    first, last = np.maximum(at - width // 2, 0), np.minimum(at + width // 2 + 1, own.size)
    turn = (way[last] - way[first]) / ((last - first) * period_s)
    speed = np.abs(own)
    slow = np.maximum(1.0 - speed / _SLOW_RAD_S, 0.0)
    return np.column_stack([np.ones(own.size), slow, speed, arm_speed(velocity) if arm is None else arm, turn])


def scale_over(scale: MotionScale, features: FloatArray) -> FloatArray:
    """(n,) standard deviation at motions with these features (n, 5), N·m."""
    weights = (
        scale.base_nm,
        scale.slow_nm,
        scale.speed_nm_s_per_rad,
        scale.arm_speed_nm_s_per_rad,
        scale.acceleration_nm_s2_per_rad,
    )
    return np.asarray(np.maximum(features @ np.array(weights), LEAST_SHARE * scale.usual_nm))


def relative_scale(
    scale: MotionScale, velocity: FloatArray, j: int, period_s: float, arm: FloatArray | None = None
) -> FloatArray:
    """(n,) scale of a joint's residual over the usual one; arguments as of :func:`motion_features`."""
    return scale_over(scale, motion_features(velocity, j, period_s, arm)) / scale.usual_nm
