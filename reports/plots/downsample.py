"""Fewer points for a plot, with every extreme kept."""

from __future__ import annotations

import numpy as np
from tsdownsample import MinMaxDownsampler

from collaudit.core.numeric.arrays import BoolArray, FloatArray


def thin(time_s: FloatArray, values: FloatArray, points: int) -> tuple[FloatArray, FloatArray]:
    """Reduce a curve so that its highest and lowest sample of every pixel column stay in it.

    MinMaxLTTB is not used: its second stage may drop one of two spikes that fall into the same column.

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
    clean = np.where(finite, values, np.nan)
    index = np.unique(MinMaxDownsampler().downsample(clean, n_out=2 * (points // 2)))  # type: ignore[no-untyped-call]
    index = index[finite[index]]
    breaks = np.flatnonzero(np.diff(np.cumsum(~finite)[index]) > 0) + 1
    kept_time, kept = time_s[index], clean[index]
    return np.insert(kept_time, breaks, kept_time[breaks - 1]), np.insert(kept, breaks, np.nan)


def column_shares(mask: BoolArray, columns: int) -> FloatArray:
    """Share of True in each of ``columns`` equal stretches; (min(columns, n),)."""
    edges = np.linspace(0, len(mask), min(columns, len(mask)) + 1).astype(np.int64)
    return np.asarray(np.add.reduceat(mask, edges[:-1], dtype=np.float64) / np.diff(edges))
