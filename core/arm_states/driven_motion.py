"""Whether the drives move an arm along its path, as they do in the rest of the log.

Beside the rigid-body torque a drive that moves a joint brings up friction, y = effort - tau_rigid > 0 along the motion.
Where a hand moves it, or nothing does, it does not: y is near zero, or against the motion by what inertia takes.
"""

from __future__ import annotations

import numpy as np

from collaudit.core.data.uniform_series import MOVING_RAD_S, UniformSeries
from collaudit.core.numeric.arrays import BoolArray, FloatArray, Span
from collaudit.core.numeric.stats import median_of, robust_sd

#: Share of its usual friction that a joint's drive brings up at least, in the median of the joints that tell.
_DRIVEN = 0.6
#: Joints that must tell, and samples in motion that each needs.
_LEAST_JOINTS, _LEAST_SAMPLES = 2, 5
#: A joint tells where its friction is so many standard errors of its scatter in the stretch.
_CLEAR = 4.0


def driven(series: UniformSeries, rigid_nm: FloatArray, outside: BoolArray, span: Span) -> bool:
    """Whether the drives plainly move the arm in a stretch.

    Args:
        series: all joints of the log, efforts in N·m.
        rigid_nm: (n, j) rigid-body torque.
        outside: (n,) samples that tell how the drives act elsewhere.
        span: the stretch.
    """
    if series.effort is None:
        return False
    shares = []
    for j in range(len(series.joint_names)):
        velocity = series.velocity_rad_s[:, j]
        with np.errstate(invalid="ignore"):
            along = (series.effort[:, j] - rigid_nm[:, j]) * np.sign(velocity)
            moves = (np.abs(velocity) > MOVING_RAD_S) & np.isfinite(along)
        usual, here = along[outside & moves], along[span.slice][moves[span.slice]]
        if usual.size < _LEAST_SAMPLES or here.size < _LEAST_SAMPLES:
            continue
        level = median_of(usual)
        if level > _CLEAR * robust_sd(usual) / np.sqrt(here.size):
            shares.append(median_of(here) / level)
    return len(shares) >= _LEAST_JOINTS and float(np.median(shares)) >= _DRIVEN
