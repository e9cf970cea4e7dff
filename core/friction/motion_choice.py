"""Sections of constant speed or arbitrary motion: which tells a joint's friction over the speeds it is used at."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from collaudit.core.data.friction_result import FrictionPoint
from collaudit.core.data.uniform_series import MOVING_RAD_S
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.prepare.prepared import Prepared

#: Speeds closer than this ratio are one speed.
_DISTINCT = 1.1
#: As many distinct speeds show how friction goes with speed; with fewer, any other source that has more is better.
_ENOUGH = 5
#: Pairs of directions are free of the model's errors: they are kept over any motion at this much less of the time.
_GAIN, _GAIN_OVER_PAIRS = 0.1, 0.3
_MARGIN = 1.05  # friction is used a little beyond the speeds it was measured at


def distinct_speeds(points: Sequence[FrictionPoint]) -> int:
    """Number of speeds that differ by more than a tenth."""
    count, start = 0, 0.0
    for speed in sorted(p.speed_rad_s for p in points):
        if speed > _DISTINCT * start:
            count, start = count + 1, speed
    return count


def moving_speeds(prepared: Sequence[Prepared], joint: str) -> FloatArray:
    """(n,) speeds of a joint while it moves, over all logs."""
    parts = []
    for log in prepared:
        if joint in log.judged:
            speed = np.abs(log.series.velocity_rad_s[:, log.series.column(joint)])
            parts.append(speed[speed > MOVING_RAD_S])
    return np.concatenate(parts) if parts else np.empty(0)


def covered(points: Sequence[FrictionPoint], speeds: FloatArray) -> float:
    """Share of the moving time whose speed lies within the range of the points."""
    if not points or speeds.size == 0:
        return 0.0
    measured = [p.speed_rad_s for p in points]
    return float(np.mean((speeds >= min(measured) / _MARGIN) & (speeds <= max(measured) * _MARGIN)))


def any_motion_tells_more(
    sections: Sequence[FrictionPoint], motion: Sequence[FrictionPoint], speeds: FloatArray
) -> bool:
    """Whether arbitrary motion shows friction at more speeds, or over more of the speeds used, than sections do.

    Args:
        sections: points of constant speed.
        motion: points of arbitrary motion; they rest on the model's torque.
        speeds: (n,) speeds that the joint moves at.
    """
    here, there = distinct_speeds(sections), distinct_speeds(motion)
    if there < 3:
        return False
    if here < _ENOUGH:
        return there > here
    paired = sum(p.source == "pair" for p in sections) >= _ENOUGH
    return covered(motion, speeds) - covered(sections, speeds) > (_GAIN_OVER_PAIRS if paired else _GAIN)


def beyond(motion: Sequence[FrictionPoint], sections: Sequence[FrictionPoint]) -> list[FrictionPoint]:
    """Sections slower or faster than what arbitrary motion shows: rare speeds that no bin of it holds."""
    if not motion:
        return []
    speeds = [p.speed_rad_s for p in motion]
    low, high = min(speeds) / _DISTINCT, max(speeds) * _DISTINCT
    return [p for p in sections if not low <= p.speed_rad_s <= high]
