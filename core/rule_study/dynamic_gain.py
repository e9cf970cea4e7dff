"""Whether a threshold that grows with the motion would notice more than a constant one with the same guarantee.

Both are learnt from one half of the clean time, by turns of ten seconds: 1.25 times the lowest that never alarms there.
The other half, which neither has seen, tells whether they hold, and the motion of all of it how much is gained.
"""

from __future__ import annotations

import math

import numpy as np

from collaudit.core.data.rule_study_result import DynamicGain
from collaudit.core.detection.threshold import dynamic_shape
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.rule_study.alarm_grid import alarm_grid, excess, sustained_level
from collaudit.core.rule_study.joint_plane import JointSeries

_TURN_S, _MARGIN = 10.0, 1.25
#: Less of each half than this says nothing.
_LEAST_S = 30.0


def dynamic_gain(joint: JointSeries, n: int, velocity: FloatArray, acceleration: FloatArray) -> DynamicGain:
    """What a dynamic threshold would gain.

    Args:
        joint: its residual.
        n: persistence, samples.
        velocity, acceleration: (n,) through the detector's kernel.
    """
    turns = (np.arange(joint.clean.size) * joint.period_s // _TURN_S).astype(np.int64) % 2 == 0
    moving = np.isfinite(velocity) & np.isfinite(acceleration) & np.isfinite(joint.residual_nm)
    learn, check = joint.clean & turns & moving, joint.clean & ~turns & moving
    seconds = float(min(np.count_nonzero(learn), np.count_nonzero(check))) * joint.period_s
    hours = seconds / 3600.0
    if seconds < _LEAST_S:
        told = math.floor(10.0 * seconds) / 10.0  # never rounded up to what is asked
        return _unknown(hours, f"only {told:g} s of clean motion in each half (at least {_LEAST_S:g} s)")
    columns = np.stack([np.ones_like(velocity), np.abs(velocity), np.abs(acceleration)], axis=1)
    shape = columns @ dynamic_shape(np.abs(joint.residual_nm[learn]), columns[learn])
    counts = np.array([n])
    with np.errstate(invalid="ignore", divide="ignore"):
        seen = excess(joint.residual_nm, joint.uncertainty_nm, learn)
        constant = _MARGIN * float(sustained_level(seen, counts)[0])
        scale = _MARGIN * float(sustained_level(np.where(learn, seen / shape, -np.inf), counts)[0])
    if not (constant > 0 and scale > 0):
        return _unknown(hours, "its clean residual never exceeds its own uncertainty")
    level = scale * shape
    fresh = excess(joint.residual_nm, joint.uncertainty_nm, check)
    alarms = [
        int(alarm_grid(x, np.array([limit]), counts, joint.merge_samples)[0, 0])
        for x, limit in ((fresh, constant), (fresh - level, 0.0))
    ]
    over = level[learn | check]
    return DynamicGain(
        constant_nm=constant,
        median_nm=float(np.median(over)),
        lower_share=float(np.mean(over < constant)),
        sensitivity_gain=float(1.0 - np.exp(np.mean(np.log(over / constant)))),
        alarms_constant=alarms[0],
        alarms_dynamic=alarms[1],
        hours=hours,
    )


def _unknown(hours: float, why: str) -> DynamicGain:
    return DynamicGain(None, None, None, None, None, None, hours, why)
