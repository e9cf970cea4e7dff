"""Drives whose efforts are logged late, behind a slow low-pass: such an effort is no sign of a hand on the arm."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from collaudit.core.data.uniform_series import UniformSeries
from collaudit.core.numeric.arrays import FloatArray, Span
from collaudit.core.numeric.signal_filters import lfilter

#: Time constants that are tried, s; samples looked at in a second; how long before the stretch the low-pass starts, in
#: time constants.
_LAGS_S, _RATE_HZ, _BEFORE = (0.1, 0.15, 0.25, 0.4, 0.6, 0.8, 1.0, 1.25, 1.6, 2.0, 2.5), 50.0, 5.0
#: Share of the effort beside gravity, as its power, that a late drive leaves at most. Simulated, it leaves up to 0.3,
#: and an arm in a hand ten times the whole and more.
_LEFT = 0.5

Gravity = Callable[[FloatArray], FloatArray]
Friction = Callable[[FloatArray], FloatArray]


def follows_late(
    series: UniformSeries,
    span: Span,
    joints: tuple[int, ...],
    drive_nm: FloatArray,
    rigid_nm: FloatArray,
    gravity: Gravity,
    friction: Mapping[int, Friction],
) -> bool:
    """Whether in a stretch the efforts of all these joints are what their drives supply, behind one low-pass.

    Args:
        series: all joints of the log.
        span: the stretch.
        joints: columns that seem not to be driven.
        drive_nm: (n, j) effort less the commanded tool force's torque; NaN where unknown.
        rigid_nm: (n, j) rigid-body torque.
        gravity: (k, j) gravity torque at (k, j) positions.
        friction: sliding friction at (k,) speeds, by column.
    """
    every = max(1, int(1.0 / (_RATE_HZ * series.period_s)))
    floor = max((segment.start for segment in series.segments if segment.start <= span.start), default=0)
    start = max(floor, span.start - round(_BEFORE * _LAGS_S[-1] / series.period_s))
    rows = np.arange(start, span.stop, every)
    inside = rows >= span.start
    pick = np.array(joints, dtype=np.int64)
    weight = gravity(series.position_rad[rows[inside]])[:, pick]
    drive = drive_nm[np.ix_(rows[inside], pick)]
    own = np.stack([friction[j](series.velocity_rad_s[rows, j]) for j in joints], axis=1)
    supplied = np.nan_to_num(rigid_nm[np.ix_(rows, pick)] + own)
    unfiltered = np.nansum(np.square(drive - weight), axis=0)
    for lag_s in _LAGS_S:
        late = low_passed(supplied, every * series.period_s / lag_s, supplied[0])[inside]
        if (np.nansum(np.square(drive - late), axis=0) < _LEFT * unfiltered).all():
            return True
    return False


def low_passed(values: FloatArray, step: float, start: FloatArray) -> FloatArray:
    """(k, j) behind a low-pass of first order.

    Args:
        values: (k, j) before it.
        step: the period by its time constant.
        start: (j,) what it gave before the first sample.
    """
    share = step / (1.0 + step)
    b, a = np.array([share]), np.array([1.0, share - 1.0])
    return lfilter(b, a, values, (1.0 - share) * start[None])
