"""Efforts that pass a slow low-pass on their way into the log, and so flatten contact that is shorter.

What the drives supply is the model's torque and friction. Where the logged effort is that behind a low-pass of first
order, and no factors of gravity, inertia and friction explain it as well, the filter is the cause.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from collaudit.core.data.uniform_series import MOVING_RAD_S, UniformSeries
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray, Span
from collaudit.core.numeric.parallel import ordered_map
from collaudit.core.numeric.signal_filters import lfilter

#: Time constants that are tried, s: a faster one is no slower than the filters of most drives.
_LAGS_S = np.geomspace(0.1, 8.0, 24)
_RATE_HZ = 50.0
#: Shortest stretch without a gap, and least motion in all, s.
_LEAST_S = 5.0
#: Share of the torque's power that the model leaves at least, where anything has to be explained.
_AMISS = 0.02
#: Share of the power left that the low-pass leaves at most, of the model's and of any factors of its parts.
_LEFT, _LEFT_OF_FACTORS = 0.25, 0.5


@dataclass(frozen=True, slots=True)
class FilteredEffort:
    """A low-pass that the efforts of some joints have passed.

    Attributes:
        joints: columns that show it.
        lag_s: its time constant.
        left: share of what the model leaves of these joints' power that is left with the low-pass.
    """

    joints: tuple[int, ...]
    lag_s: float
    left: float


@dataclass(frozen=True, slots=True, eq=False)
class _Samples:
    """Samples without gaps, about fifty a second: (k, c) measured, supplied and parts; seconds each.

    ``known``: (k, c) where both torques are. ``told``: of these, in motion; at rest friction is an interval, and what
    is left there says nothing of a filter.
    """

    measured: FloatArray
    supplied: FloatArray
    friction: FloatArray
    gravity: FloatArray
    known: BoolArray
    told: BoolArray
    stretches: tuple[slice, ...]
    step_s: float


def filtered_effort(
    series: UniformSeries,
    drive_nm: FloatArray,
    rigid_nm: FloatArray,
    gravity: Gravity,
    friction: Mapping[int, Friction],
) -> FilteredEffort | None:
    """The low-pass that explains the efforts; None where nothing has to be explained, or something else does.

    Args:
        series: all joints of the log.
        drive_nm: (n, j) effort less the commanded tool force's torque; NaN where unknown.
        rigid_nm: (n, j) rigid-body torque.
        gravity: (k, j) gravity torque at (k, j) positions.
        friction: sliding friction at (k,) speeds, by column.
    """
    columns = _amiss(series, drive_nm, rigid_nm, friction)
    if not columns:
        return None
    samples = _samples(series, columns, drive_nm, rigid_nm, gravity, friction)
    plain = _power(samples, samples.supplied)
    factors = np.array([_with_factors(samples, c) for c in range(len(columns))])
    late = np.array([_power(samples, _behind(samples, float(lag))) for lag in _LAGS_S])
    shown = (late < _LEFT * plain) & (late < _LEFT_OF_FACTORS * factors)
    best = int(np.argmin(np.sum(np.log(late / plain), axis=1)))
    telling = np.flatnonzero(shown[best])
    if telling.size == 0 or (late[best] > plain).any():
        return None
    left = float(np.sum(late[best][telling]) / np.sum(plain[telling]))
    return FilteredEffort(tuple(columns[c] for c in telling), float(_LAGS_S[best]), left)


def _amiss(
    series: UniformSeries, drive_nm: FloatArray, rigid_nm: FloatArray, friction: Mapping[int, Friction]
) -> list[int]:
    """Columns in motion for a while whose residual is no small share of their torque."""
    rows = _rows(series)[0]

    def amiss(j: int) -> bool:
        speed, drive = series.velocity_rad_s[rows, j], drive_nm[rows, j]
        supplied = rigid_nm[rows, j] + friction[j](speed)
        use = np.isfinite(drive) & np.isfinite(supplied) & (np.abs(speed) >= MOVING_RAD_S)
        if np.count_nonzero(use) < _LEAST_S * _RATE_HZ:
            return False
        left = float(np.mean(np.square((drive - supplied)[use])))
        return left > _AMISS * float(np.var(supplied[use]))

    columns = sorted(friction)
    return [j for j, shown in zip(columns, ordered_map(amiss, columns), strict=True) if shown]


def _rows(series: UniformSeries) -> tuple[IntArray, tuple[slice, ...]]:
    """Samples at about fifty a second of the longer segments, and where each of these is among them."""
    every = _every(series)
    parts = [np.arange(s.start, s.stop, every) for s in series.segments if len(s) * series.period_s >= _LEAST_S]
    ends = np.cumsum([0, *(part.size for part in parts)])
    stretches = tuple(slice(int(a), int(b)) for a, b in pairwise(ends))
    return np.concatenate([*parts, np.zeros(0, dtype=np.int64)]).astype(np.int64), stretches


def _every(series: UniformSeries) -> int:
    return max(1, int(1.0 / (_RATE_HZ * series.period_s)))


def _samples(
    series: UniformSeries,
    columns: list[int],
    drive_nm: FloatArray,
    rigid_nm: FloatArray,
    gravity: Gravity,
    friction: Mapping[int, Friction],
) -> _Samples:
    rows, stretches = _rows(series)
    pick = np.ix_(rows, np.array(columns, dtype=np.int64))
    own = np.stack([friction[j](series.velocity_rad_s[rows, j]) for j in columns], axis=1)
    supplied = rigid_nm[pick] + own
    known = np.isfinite(drive_nm[pick]) & np.isfinite(supplied)
    return _Samples(
        measured=drive_nm[pick],
        supplied=np.nan_to_num(supplied),
        friction=own,
        gravity=gravity(series.position_rad[rows])[:, columns],
        known=known,
        told=known & (np.abs(series.velocity_rad_s[pick]) >= MOVING_RAD_S),
        stretches=stretches,
        step_s=_every(series) * series.period_s,
    )


def _power(samples: _Samples, explained: FloatArray) -> FloatArray:
    """(c,) mean square of what is left of the measured torque in motion."""
    left = np.where(samples.told, samples.measured - explained, 0.0)
    return np.asarray(np.sum(left**2, axis=0) / np.maximum(np.count_nonzero(samples.told, axis=0), 1))


def _behind(samples: _Samples, lag_s: float) -> FloatArray:
    """(k, c) what is supplied, behind the low-pass, which starts at the effort of that moment."""
    out = np.empty_like(samples.supplied)
    for part in samples.stretches:
        first = np.where(samples.known[part][0], samples.measured[part][0], samples.supplied[part][0])
        out[part] = low_passed(samples.supplied[part], samples.step_s / lag_s, first)
    return out


def _with_factors(samples: _Samples, column: int) -> float:
    """Mean square of what the best factors of gravity, inertia, friction and a constant leave of one joint's torque."""
    use = samples.told[:, column]
    weight, own = samples.gravity[use, column], samples.friction[use, column]
    inertial = samples.supplied[use, column] - own - weight
    design = np.column_stack([weight, inertial, own, np.ones(weight.size)])
    measured = samples.measured[use, column]
    left = measured - design @ np.linalg.lstsq(design, measured, rcond=None)[0]
    return float(np.mean(left**2))


#: Time constants that are tried, s; samples looked at in a second; how long before the stretch the low-pass starts, in
#: time constants.
_LATE_LAGS_S, _LATE_RATE_HZ, _BEFORE = (0.1, 0.15, 0.25, 0.4, 0.6, 0.8, 1.0, 1.25, 1.6, 2.0, 2.5), 50.0, 5.0
#: Share of the effort beside gravity, as its power, that a late drive leaves at most. Simulated, it leaves up to 0.3,
#: and an arm in a hand ten times the whole and more.
_LATE_LEFT = 0.5

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
    every = max(1, int(1.0 / (_LATE_RATE_HZ * series.period_s)))
    floor = max((segment.start for segment in series.segments if segment.start <= span.start), default=0)
    start = max(floor, span.start - round(_BEFORE * _LATE_LAGS_S[-1] / series.period_s))
    rows = np.arange(start, span.stop, every)
    inside = rows >= span.start
    pick = np.array(joints, dtype=np.int64)
    weight = gravity(series.position_rad[rows[inside]])[:, pick]
    drive = drive_nm[np.ix_(rows[inside], pick)]
    own = np.stack([friction[j](series.velocity_rad_s[rows, j]) for j in joints], axis=1)
    supplied = np.nan_to_num(rigid_nm[np.ix_(rows, pick)] + own)
    beside = np.nansum(np.square(drive - weight), axis=0)
    for lag_s in _LATE_LAGS_S:
        late = low_passed(supplied, every * series.period_s / lag_s, supplied[0])[inside]
        if (np.nansum(np.square(drive - late), axis=0) < _LATE_LEFT * beside).all():
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
