"""Smallest, largest and mean values of windows that slide over a signal; a window that holds a NaN is NaN."""

from __future__ import annotations

import numpy as np

from collaudit.core.numeric.arrays import BoolArray, FloatArray


def lowest_in_row(x: FloatArray, n: int) -> FloatArray:
    """(…, t - n + 1) smallest of ``n`` values in a row on the last axis, by their first; empty where it is shorter.

    Windows of 1, 2, 4, … samples are formed from halves: log2(n) passes of NumPy's minimum.
    """
    length = 1
    while length < n and x.shape[-1] > 0:
        step = min(length, n - length)
        x = np.minimum(x[..., :-step], x[..., step:])
        length += step
    return x


def centred_extremes(x: FloatArray, n: int) -> tuple[FloatArray, FloatArray]:
    """Smallest and largest (m,) of the ``n`` values about each of ``x`` (m,), fewer at the ends.

    The window of sample k begins at k - n // 2.
    """
    held = np.pad(x, (n // 2, n - 1 - n // 2), mode="edge" if x.size else "constant")
    return lowest_in_row(held, n), -lowest_in_row(-held, n)


def range_exceeds(x: FloatArray, n: int, level: float) -> BoolArray:
    """(m,) whether the largest less the smallest of the ``n`` values about each of ``x`` (m,) exceeds a level."""
    low, high = centred_extremes(x, n)
    return np.asarray(high - low > level)


def whole_window_minima(x: FloatArray, n: int) -> FloatArray:
    """(m,) smallest of the ``n`` values about each of ``x`` (m,), whose window begins at k - n // 2; 0 at the ends."""
    out, found = np.zeros(x.size), lowest_in_row(x, n)
    out[n // 2 : n // 2 + found.size] = found
    return out


def trailing_means(x: FloatArray, counts: BoolArray, n: int) -> FloatArray:
    """(m,) mean of the ``n`` values of ``x`` (m,) up to each; NaN where one of them does not count, or is missing."""
    out = np.full(x.size, np.nan)
    if n <= x.size:
        total = np.append(0.0, np.cumsum(np.where(counts, x, 0.0)))
        lost = np.append(0, np.cumsum(~counts))
        whole = lost[n:] == lost[:-n]
        out[n - 1 :] = np.where(whole, (total[n:] - total[:-n]) / n, np.nan)
    return out
