"""Stamps as seconds, and values brought to other stamps."""

from __future__ import annotations

import numpy as np

from collaudit.core.numeric.arrays import FloatArray, IntArray
from collaudit.core.numeric.stats import median_of

#: A value is interpolated only between neighbours closer than this many of their own periods.
NEIGHBOUR_PERIODS = 2.5


def seconds_since(stamps_ns: IntArray, origin_ns: int) -> FloatArray:
    """(n,) seconds since an origin; the difference is taken in whole nanoseconds before it becomes a float."""
    return np.asarray((stamps_ns - np.int64(origin_ns)) / 1e9)


def interpolate(at_s: FloatArray, time_s: FloatArray, values: FloatArray) -> FloatArray:
    """Linear interpolation that never crosses a gap.

    Args:
        at_s: (m,) where values are wanted.
        time_s: (n,) stamps of the values, any order.
        values: (n, k).

    Returns:
        (m, k); NaN outside the stamps and between neighbours further apart than ``NEIGHBOUR_PERIODS`` of their
        own median period.
    """
    out = np.full((at_s.shape[0], values.shape[1]), np.nan)
    time_s, first = np.unique(time_s, return_index=True)
    values = values[first]
    if time_s.shape[0] == 0:
        return out
    right = np.searchsorted(time_s, at_s, side="left")
    exact = (right < time_s.shape[0]) & (time_s[np.minimum(right, time_s.shape[0] - 1)] == at_s)
    out[exact] = values[right[exact]]
    if time_s.shape[0] < 2:
        return out
    limit = NEIGHBOUR_PERIODS * median_of(np.diff(time_s))
    inside = ~exact & (right > 0) & (right < time_s.shape[0])
    hi = right[inside]
    step = time_s[hi] - time_s[hi - 1]
    share = ((at_s[inside] - time_s[hi - 1]) / step)[:, None]
    mixed = values[hi - 1] * (1 - share) + values[hi] * share
    mixed[step > limit] = np.nan
    out[inside] = mixed
    return out
