"""Smallest and largest values of windows that slide over a signal, exactly, a block in the cache at a time.

Windows of 1, 2, 4, … samples are formed from halves: log2(n) passes of NumPy's vectorised minimum, several times faster
than a running minimum sample by sample, and without the import of ``scipy.ndimage``.
"""

from __future__ import annotations

from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray

_Number = TypeVar("_Number", bound=np.generic)

#: Windows at a time: what is worked on stays in the cache.
_AT_ONCE = 1 << 16
#: So many values of a window, about, are looked at first.
_COARSE = 12


def window_minima(x: NDArray[_Number], n: int, out: NDArray[_Number] | None = None) -> NDArray[_Number]:
    """(m - n + 1,) smallest of each ``n`` values in a row of ``x`` (m,), by their first; empty for m < n.

    ``out``: memory for them, fresh memory without.
    """
    return _windows(x, n, np.minimum, out)


def window_maxima(x: NDArray[_Number], n: int, out: NDArray[_Number] | None = None) -> NDArray[_Number]:
    """(m - n + 1,) largest of each ``n`` values in a row of ``x`` (m,), as of :func:`window_minima`."""
    return _windows(x, n, np.maximum, out)


def centred_range(x: FloatArray, n: int) -> FloatArray:
    """(m,) largest less smallest of the ``n`` values about each of ``x``, as of :func:`centred_extremes`."""
    low, high = centred_extremes(x, n)
    return np.asarray(high - low)


def centred_extremes(x: FloatArray, n: int) -> tuple[FloatArray, FloatArray]:
    """Smallest and largest (m,) of the ``n`` values about each of ``x`` (m,), fewer at the ends.

    The window of sample k begins at k - n // 2. One that holds a NaN is NaN.
    """
    before, after = n // 2, n - 1 - n // 2
    low = window_minima(_padded(x, before, after, np.inf), n)
    return low, window_maxima(_padded(x, before, after, -np.inf), n)


def centred_range_at(x: FloatArray, n: int, rows: IntArray) -> FloatArray:
    """(k,) :func:`centred_range` of ``x`` (m,) at some samples (k,), in order; others are looked at only near them."""
    if 2 * rows.size > x.size:
        return np.asarray(centred_range(x, n)[rows])
    before, after = n // 2, n - 1 - n // 2
    apart = np.diff(rows, prepend=rows[:1]) > n
    edges = np.flatnonzero(apart)
    starts = rows[np.append(0, edges)] - before if rows.size else rows
    stops = rows[np.append(edges, rows.size) - 1] + after + 1 if rows.size else rows
    count = stops - starts
    left_out = starts - np.cumsum(count) + count  # before each stretch of samples that are looked at
    near = np.repeat(left_out, count) + np.arange(count.sum())
    spread = centred_range(x[near.clip(0, x.size - 1)], n)  # values held beyond an end change no extreme
    return np.asarray(spread[rows - left_out[np.cumsum(apart)]])


def range_exceeds(x: FloatArray, n: int, level: float) -> BoolArray:
    """(m,) whether :func:`centred_range` of ``x`` (m,) exceeds a level.

    A few values of each window tell it where they are far enough apart; elsewhere all are looked at.
    """
    step = n // _COARSE
    if step < 2:
        return np.asarray(centred_range(x, n) > level)
    few = x[::step]
    # Of those, the ones in the windows of all samples k·step to (k + 1)·step - 1, counted from number k.
    before, after = (n // 2 - step + 1) // step, (n - 1 - n // 2) // step
    low = window_minima(_padded(few, before, after, np.inf), before + 1 + after)
    high = window_maxima(_padded(few, before, after, -np.inf), before + 1 + after)
    out = np.repeat(high - low > level, step)[: x.size]
    rest = np.flatnonzero(~out)
    out[rest] = centred_range_at(x, n, rest) > level
    return out


def whole_window_minima(x: FloatArray, n: int, out: FloatArray | None = None) -> FloatArray:
    """(m,) smallest of the ``n`` values about each of ``x`` (m,), whose window begins at k - n // 2; 0 at the ends.

    ``out``: (m,) memory for them, fresh memory without.
    """
    out = np.zeros(x.size) if out is None else out
    out[: n // 2] = out[max(n // 2, x.size - (n - 1 - n // 2)) :] = 0.0
    _windows(x, n, np.minimum, out[n // 2 : max(n // 2, x.size - (n - 1 - n // 2))])
    return out


def lowest_in_row(x: FloatArray, n: int) -> FloatArray:
    """(…, t - n + 1) smallest of ``n`` values in a row on the last axis, by their first; empty where it is shorter."""
    length = 1
    while length < n and x.shape[-1] > 0:
        step = min(length, n - length)
        x = np.minimum(x[..., :-step], x[..., step:])
        length += step
    return x


def _padded(x: FloatArray, before: int, after: int, value: float) -> FloatArray:
    """``np.pad`` with one value, which takes a tenth of the time of a short array."""
    out = np.empty(before + x.size + after)
    out[:before] = out[before + x.size :] = value
    out[before : before + x.size] = x
    return out


def _windows(x: NDArray[_Number], n: int, of_two: np.ufunc, out: NDArray[_Number] | None = None) -> NDArray[_Number]:
    """(m - n + 1,) of the windows of (m,); ``out`` is memory for them, fresh memory without."""
    count = x.size - n + 1
    if n < 1 or count < 1:
        return np.empty(0, dtype=x.dtype)
    out = np.empty(count, dtype=x.dtype) if out is None else out
    if n == 1:
        out[...] = x
        return out
    step = max(_AT_ONCE, 4 * n)
    buffers = np.empty((2, step + n), dtype=x.dtype)
    for start in range(0, count, step):
        stop = min(start + step, count)
        part, held, turn = x[start : stop + n - 1], 1, 0
        while held < n:
            shift = min(held, n - held)
            held += shift
            size = part.size - shift
            into = out[start:stop] if held == n else buffers[turn, :size]
            part = of_two(part[:size], part[shift:], out=into)
            turn = 1 - turn
    return out
