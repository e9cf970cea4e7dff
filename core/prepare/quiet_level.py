"""The torque of an arm that never moves while nobody touches it: what changes of torque are judged against.

A touch is never as even as rest. Quiet samples are those about which the torque of every joint varies hardly more than
where it varies least; their median is the level, their spread about it what the torque does by itself: noise, and what
gears and control keep of the touch before. More than half of the time may be touched.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import ceil

import numpy as np

from collaudit.core.numeric.arrays import BoolArray, FloatArray
from collaudit.core.numeric.null_tail import ARM_PER_HOUR, MARGIN, block_peaks, null_tail
from collaudit.core.numeric.stats import SD_PER_MAD, median_of, smallest_step
from collaudit.core.prepare.prepared import Prepared

#: A joint that stays within this never moves, rad (m of a prismatic joint).
STILL_TRAVEL = 0.01
#: Evenness is told over this time; quiet is up to so many times the evenness of the most even fifth.
_WINDOW_S, _EVEN_SHARE, _EVEN_TIMES = 0.25, 0.2, 3.0
#: The level follows drift from one stretch of this length to the next, s.
DRIFT_S = 120.0
#: Less quiet time than this, or than this share, tells no level.
_LEAST_S, _LEAST_SHARE = 1.0, 0.05
#: Changes count from this many spreads on, or from what their peaks reach by themselves: noise decides, nothing else.
_SPREADS = 6.0


@dataclass(frozen=True, slots=True, eq=False)
class QuietLevel:
    """What one still joint's torque does by itself.

    Attributes:
        level_nm: (n,) measured less rigid-body torque while nothing touches the arm.
        gamma_nm: threshold of changes that follows from it.
        quiet_s: time it was measured in.
        stretch_s: a load that is constant for as long as this is part of the level.
        beyond_nm: threshold of torque beyond what friction can hold; infinite where friction tells nothing.
    """

    level_nm: FloatArray
    gamma_nm: float
    quiet_s: float
    stretch_s: float
    beyond_nm: float = np.inf


def never_moves(prepared: Prepared) -> bool:
    """Whether no joint of the log ever leaves its place: gravity's torque is then constant."""
    position = prepared.series.position_rad
    low, high = np.nanmin(position, axis=0, initial=np.inf), np.nanmax(position, axis=0, initial=-np.inf)
    return bool((low <= high).all() and (high - low < STILL_TRAVEL).all())


def quiet_levels(prepared: Prepared) -> Mapping[str, QuietLevel]:
    """The level of every judged joint of an arm that never moves; empty where it moves, or where it is never quiet."""
    series = prepared.series
    if series.effort is None or series.effort_unit != "Nm" or prepared.rigid_nm is None or not never_moves(prepared):
        return {}
    torque = series.effort - np.nanmedian(prepared.rigid_nm, axis=0)
    quiet, noise = _quiet(prepared, torque)
    count, recorded = int(np.count_nonzero(quiet)), sum(len(segment) for segment in series.segments)
    if count * series.period_s < _LEAST_S or count < _LEAST_SHARE * recorded:
        return {}
    stretch = min(DRIFT_S, float(series.time_s[-1] - series.time_s[0]))
    out = {}
    for joint in prepared.judged:
        j = series.column(joint)
        level = _level(torque[:, j], quiet, series.time_s)
        spread = SD_PER_MAD * float(np.median(np.abs(torque[quiet, j] - level[quiet])))
        least = max(float(noise[j]), smallest_step(torque[:, j]))  # torques in coarse steps do not vary at rest at all
        if not least > 0.0:
            continue  # a torque that is the same all the time tells nothing
        spread = max(spread, least)
        rigid = prepared.rigid_nm[:, j] - np.nanmedian(prepared.rigid_nm[:, j])
        off = np.where(quiet, np.abs(torque[:, j] - level), 0.0)
        tail = null_tail(block_peaks(np.nan_to_num(off), quiet, series.period_s), contact_free=True)
        needed = 0.0 if tail is None else MARGIN * tail.level(ARM_PER_HOUR / len(prepared.judged))
        gamma = max(needed, _SPREADS * (spread if tail is None else least))
        out[joint] = QuietLevel(level - rigid, gamma, count * series.period_s, stretch)
    return out


def _quiet(prepared: Prepared, torque: FloatArray) -> tuple[BoolArray, FloatArray]:
    """(n,) samples about which no joint's torque varies by more than rest does, and (j,) how much that is, N·m."""
    series = prepared.series
    width = max(4, ceil(_WINDOW_S / series.period_s))
    spread = np.full(torque.shape, np.nan)
    for segment in series.segments:
        if len(segment) > width:
            half = segment.start + width // 2
            spread[half : half + len(segment) - width + 1] = _moving_sd(torque[segment.slice], width)
    known = np.isfinite(spread).all(axis=1)
    if not known.any():
        return known, np.zeros(torque.shape[1])
    noise = np.quantile(spread[known], _EVEN_SHARE, axis=0)
    noise = np.maximum(noise, [smallest_step(column) for column in torque[known].T])
    with np.errstate(invalid="ignore"):
        quiet = known & (spread <= _EVEN_TIMES * np.maximum(noise, 1e-12)).all(axis=1)
    return np.asarray(quiet), noise


def _moving_sd(x: FloatArray, width: int) -> FloatArray:
    """(m - width + 1, j) standard deviation over each window of so many rows; NaN where a value is missing."""
    middle = [median_of(column[np.isfinite(column)]) for column in x.T]
    centred, start = np.nan_to_num(x - middle), np.zeros((1, x.shape[1]))
    runs = (np.cumsum(np.concatenate((start, part)), axis=0) for part in (centred, centred**2, ~np.isfinite(x)))
    mean, square, missing = ((run[width:] - run[:-width]) / width for run in runs)
    return np.asarray(np.where(missing > 0.0, np.nan, np.sqrt(np.maximum(square - mean**2, 0.0))))


def _level(torque: FloatArray, quiet: BoolArray, time_s: FloatArray) -> FloatArray:
    """(n,) median of the quiet samples, stretch by stretch, straight between the stretches' middles."""
    length = float(time_s[-1] - time_s[0])
    count = max(1, round(length / DRIFT_S))
    edges = time_s[0] + length / count * np.arange(count + 1)
    at, value = [], []
    for k in range(count):
        inside = quiet & (time_s >= edges[k]) & (time_s <= edges[k + 1])
        if inside.any():
            at.append(0.5 * (edges[k] + edges[k + 1]))
            value.append(float(np.median(torque[inside])))
    return np.asarray(np.interp(time_s, at, value))
