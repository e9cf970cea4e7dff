"""Thresholds that follow the motion: by how much a contact-free residual scatters at each instant.

The errors of a model grow with speed and with how hard the arm accelerates, so a constant that is safe in fast motion
is blind in slow motion. A threshold may follow only what a contact cannot move: the speed of a position-controlled
joint, and acceleration over a second. The acceleration at the instant rises in a collision and would lift the threshold
with it.
"""

from __future__ import annotations

import numpy as np

from collaudit.core.data.threshold_result import MotionScale
from collaudit.core.numeric.arrays import FloatArray

#: The scale is at least this share of the usual one.
LEAST_SHARE = 0.3
#: Time over which acceleration is averaged, s: longer than a contact moves it.
_AVERAGED_S = 1.0
#: Below this speed friction depends on it most: Stribeck velocities of gears lie there, rad/s (m/s if prismatic).
_SLOW_RAD_S = 0.1


def motion_features(velocity: FloatArray, j: int, period_s: float) -> FloatArray:
    """(n, 5) one, closeness to rest, speed, the norm over the joints, and the mean |acceleration| of the second around.

    Args:
        velocity: (n, j) of the joints, rad/s; unknown values count as rest.
        j: the joint's column.
        period_s: sample period, s.
    """
    known = np.nan_to_num(velocity)
    own = known[:, j]
    width = max(1, round(_AVERAGED_S / period_s))
    # the mean of |a| over a window is the way that the velocity makes in it
    way = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(own, prepend=own[:1])))])
    at = np.arange(own.size)
    first, last = np.maximum(at - width // 2, 0), np.minimum(at + width // 2 + 1, own.size)
    turn = (way[last] - way[first]) / ((last - first) * period_s)
    speed = np.abs(own)
    slow = np.maximum(1.0 - speed / _SLOW_RAD_S, 0.0)
    return np.column_stack([np.ones(own.size), slow, speed, np.linalg.norm(known, axis=1), turn])


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


def relative_scale(scale: MotionScale, velocity: FloatArray, j: int, period_s: float) -> FloatArray:
    """(n,) scale of a joint's residual over the usual one; arguments as of :func:`motion_features`."""
    return scale_over(scale, motion_features(velocity, j, period_s)) / scale.usual_nm
