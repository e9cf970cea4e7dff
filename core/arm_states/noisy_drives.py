"""Drives that bear nothing although their efforts are noisy: a sensor reads on when brakes hold the arm.

No single sample of such an effort is zero, but its mean is. While the arm stands, the means of all joints are nothing
beside their noise, and those of loaded joints a small part of the load: brakes bear it.
"""

from __future__ import annotations

from math import ceil, sqrt

import numpy as np

from collaudit.core.numeric.arrays import BoolArray, FloatArray
from collaudit.core.numeric.runs import run_bounds, widened
from collaudit.core.numeric.stats import median_of, quantile_of

#: Means are taken over this time, and brakes take so long to grip or let go, s.
_MEAN_S, _GRIP_S = 0.3, 0.15
#: A mean is nothing within so many of its standard errors, or within this share of the arm's largest load: sensors
#: have offsets. A loaded joint bears no more than this share of its own load.
_ERRORS, _BIAS, _SHARE = 5.0, 0.05, 0.2
#: Where so many joints are loaded and bear nothing, offsets of others do not count.
_MANY = 2
_MOSTLY = 0.5
#: A joint is loaded with so many times what counts as nothing, and this much at least, N·m.
_LOAD_TIMES, _LEAST_NM = 5.0, 1.0
_NOISE_SAMPLES = 50_000


def noisy_zero(
    effort: FloatArray, rigid_nm: FloatArray | None, still: BoolArray, period_s: float, exact: BoolArray | None = None
) -> BoolArray:
    """(n,) samples of an arm at rest whose efforts are nothing but noise, though gravity pulls.

    Args:
        effort: (n, j), all joints.
        rigid_nm: (n, j) model torque; without it nothing is told.
        still: (n,) the arm stands.
        period_s: sample period, s.
        exact: (n,) samples whose efforts are zero one by one; stretches that are mostly so are left to those.
    """
    none = np.zeros(effort.shape[0], dtype=np.bool_)
    width = max(1, round(_MEAN_S / period_s))
    if rigid_nm is None or effort.shape[0] < 2 * width or not still.any():
        return none
    known = np.flatnonzero(np.isfinite(effort).any(axis=0))
    some = _every(effort, _NOISE_SAMPLES)
    if known.size == 0:
        return none
    load = np.zeros(effort.shape[1])
    load[known] = [_usual(column) for column in np.abs(rigid_nm[some][:, known]).T]
    limit = np.maximum(_ERRORS * _noise(effort) / sqrt(width), _BIAS * load.max())
    out, bears = still.copy(), np.zeros(still.size, dtype=np.int64)
    for j in known[np.argsort(-load[known])]:
        size = np.abs(rigid_nm[:, j])
        with np.errstate(invalid="ignore"):
            loaded = size > max(_LOAD_TIMES * limit[j], _LEAST_NM)
            if not loaded.any() and not (out & (bears < _MANY)).any():
                continue
            small = np.abs(_mean(effort[:, j], width)) <= np.where(
                loaded, np.maximum(limit[j], _SHARE * size), limit[j]
            )
        out &= small | ~(loaded | (bears < _MANY))
        bears += loaded
        if not (out & (bears > 0)).any():
            return none
    found = np.zeros(out.size, dtype=np.bool_)
    for a, b in zip(*run_bounds(out & (bears > 0)), strict=True):
        found[a:b] = b - a >= width and (exact is None or not np.mean(exact[a:b]) > _MOSTLY)
    return widened(found, width // 2 + ceil(_GRIP_S / period_s)) if found.any() else found


def _mean(x: FloatArray, width: int) -> FloatArray:
    """(n,) running mean; not a number where a sample is."""
    before = width // 2
    summed = np.cumsum(np.pad(np.nan_to_num(x), (before + 1, width - 1 - before), mode="edge"))
    mean: FloatArray = (summed[width:] - summed[:-width]) / width
    unknown = np.isnan(x)
    if unknown.any():
        mean[widened(unknown, width // 2)] = np.nan
    return mean


def _usual(load: FloatArray) -> float:
    told = load[~np.isnan(load)]
    return quantile_of(told, 0.95) if told.size else np.nan


def _noise(effort: FloatArray) -> FloatArray:
    """(j,) standard deviation of white noise, from second differences of some samples."""
    at = _every(effort[:-2], _NOISE_SAMPLES)
    bend = np.abs(effort[at] - 2.0 * effort[at + 1] + effort[at + 2])
    known = np.isfinite(bend).any(axis=0)
    out = np.zeros(effort.shape[1])
    out[known] = [median_of(column[~np.isnan(column)]) / (0.6745 * sqrt(6.0)) for column in bend[:, known].T]
    return out


def _every(x: FloatArray, most: int) -> np.ndarray:
    """Indices of at most so many rows, evenly spread."""
    return np.arange(0, x.shape[0], max(1, x.shape[0] // most))
