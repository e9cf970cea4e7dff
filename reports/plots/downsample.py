"""Fewer points for a plot, with every extreme kept."""

from __future__ import annotations

import numpy as np
from tsdownsample import MinMaxDownsampler

from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray
from collaudit.reports.plots.joint_trace import Series


def extremes(values: Series, points: int) -> IntArray:
    """Samples with the least and the greatest finite value of each of ``points`` / 2 stretches.

    MinMaxLTTB is not used: its second stage may drop one of two spikes that fall into the same stretch.
    """
    finite = np.isfinite(values)
    if len(values) <= points or not finite.any():
        return np.flatnonzero(finite)
    clean = np.where(finite, values, np.nan)
    index = MinMaxDownsampler().downsample(clean, n_out=2 * max(2, points // 2))  # type: ignore[no-untyped-call]
    index = np.unique(index.astype(np.int64))
    return np.asarray(index[finite[index]])


def thin(time_s: FloatArray, values: FloatArray, points: int) -> tuple[FloatArray, FloatArray]:
    """Reduce a curve so that its highest and lowest sample of every pixel column stay in it.

    Args:
        time_s: (n,) ascending.
        values: (n,) NaN or infinite where there is no curve.
        points: about how many points to keep.

    Returns:
        Time and value of the points kept, with a NaN wherever the curve is interrupted.
    """
    finite = np.isfinite(values)
    if len(values) <= points:
        return time_s, np.where(finite, values, np.nan)
    index = extremes(values, points)
    breaks = np.flatnonzero(np.diff(np.cumsum(~finite)[index]) > 0) + 1
    kept_time, kept = time_s[index], values[index]
    return np.insert(kept_time, breaks, kept_time[breaks - 1]), np.insert(kept, breaks, np.nan)


def column_edges(count: int, columns: int) -> IntArray:
    """(k + 1,) first sample of each of ``columns`` equal stretches, at most as many as samples, and their number."""
    return np.linspace(0, count, min(columns, count) + 1).astype(np.int64)


def column_shares(mask: BoolArray, edges: IntArray) -> FloatArray:
    """(k,) share of True in each stretch."""
    return np.asarray(np.add.reduceat(mask, edges[:-1], dtype=np.float64) / np.diff(edges))


def column_extremes(values: Series, mask: BoolArray, edges: IntArray) -> tuple[FloatArray, FloatArray]:
    """(k,) least and greatest of the masked finite values of each stretch; NaN where there is none."""
    shown = np.where(mask & np.isfinite(values), values, np.nan)
    return np.fmin.reduceat(shown, edges[:-1]), np.fmax.reduceat(shown, edges[:-1])
