"""Runs of True in a mask, and of equal values, without a loop over samples.

Smallest, largest and mean values of windows that slide over a signal; a window that holds a NaN is NaN.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray, Span


def run_bounds(mask: BoolArray) -> tuple[IntArray, IntArray]:
    """Starts and stops (half-open) of the runs of True in a (n,) mask."""
    edges = np.flatnonzero(mask[1:] != mask[:-1]) + 1
    first, last = mask[:1].nonzero()[0], mask[-1:].nonzero()[0] + mask.size
    edges = np.concatenate((first, edges, last)).astype(np.int64)
    return edges[::2], edges[1::2]


def equal_runs(x: NDArray[Any]) -> tuple[IntArray, IntArray]:
    """Starts and stops (half-open) of the runs of equal values in (n,) numbers, n > 0."""
    starts = np.concatenate(([0], np.flatnonzero(x[1:] != x[:-1]) + 1))
    return starts, np.append(starts[1:], x.size)


def covered(spans: Iterable[Span], size: int) -> BoolArray:
    """(size,) True in the spans."""
    out = np.zeros(size, dtype=np.bool_)
    for span in spans:
        out[span.slice] = True
    return out


def spread_over_unknown(mask: BoolArray, known: BoolArray, most: int) -> BoolArray:
    """The mask with the unknown runs set that adjoin what it holds: up to ``most`` samples, between two twice as many.

    Args:
        mask: (n,).
        known: (n,) samples about which the mask tells something.
        most: samples.
    """
    out = mask.copy()
    for a, b in zip(*run_bounds(~known), strict=True):
        sides = int(a > 0 and mask[a - 1]) + int(b < mask.size and mask[b])
        out[a:b] |= 0 < b - a <= most * sides
    return out


def closed(mask: BoolArray, dip: int) -> BoolArray:
    """The mask with holes no longer than ``dip`` filled."""
    starts, stops = run_bounds(~mask)
    short = (stops - starts <= dip) & (starts > 0) & (stops < mask.size)
    return mask | marked(starts[short], stops[short], mask.size)


def lasting(mask: BoolArray, least: int) -> BoolArray:
    """The mask without runs of fewer than ``least`` samples."""
    starts, stops = run_bounds(mask)
    long = stops - starts >= least
    return marked(starts[long], stops[long], mask.size)


def widened(mask: BoolArray, margin: int) -> BoolArray:
    """The mask with each run reaching ``margin`` samples further on both sides."""
    starts, stops = run_bounds(mask)
    return marked(np.maximum(starts - margin, 0), np.minimum(stops + margin, mask.size), mask.size)


def marked(starts: IntArray, stops: IntArray, size: int) -> BoolArray:
    """(size,) True inside half-open ranges, which rise at both ends and may overlap."""
    first, last = _apart(starts, stops)
    edges = np.empty(2 * first.size + 2, dtype=np.int64)
    edges[0], edges[1:-1:2], edges[2:-1:2], edges[-1] = 0, first, last, size
    return np.repeat(np.arange(edges.size - 1) % 2 == 1, np.diff(edges))


def _apart(starts: IntArray, stops: IntArray) -> tuple[IntArray, IntArray]:
    """The ranges with those that meet or overlap made one."""
    if starts.size == 0:
        return starts, stops
    apart = np.flatnonzero(starts[1:] > stops[:-1])
    return starts[np.append(0, apart + 1)], stops[np.append(apart, stops.size - 1)]


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
