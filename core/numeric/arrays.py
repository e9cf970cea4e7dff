"""Arrays as the program passes them on: their types, read-only copies, and stretches of samples.

Runs of True in a mask, and of equal values, are found without a loop over samples. Of windows that slide over a signal:
their smallest and largest values (a window that holds a NaN is NaN), and the one most like another recording.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
IntArray = NDArray[np.int64]
#: Nothing of a robot is as large in any unit; sums of such numbers are still finite.
LARGEST = 1e15


def frozen(array: FloatArray) -> FloatArray:
    """Return the array as float64 that cannot be written to, rows or columns contiguous; copies only when it must.

    Signals lie column by column in memory wherever they are long: nearly all that is done with them follows time.
    """
    out = np.asarray(array, dtype=np.float64)
    if not out.flags.c_contiguous and out.strides[0] != out.itemsize:
        out = np.ascontiguousarray(out)
    if out is array and out.flags.writeable:
        out = out.view()
    out.flags.writeable = False
    return out


@dataclass(frozen=True, slots=True, order=True)
class Span:
    """Half-open range of sample indices, ``start <= k < stop``."""

    start: int
    stop: int

    def __len__(self) -> int:
        return self.stop - self.start

    @property
    def slice(self) -> slice:
        """The span as a slice."""
        return slice(self.start, self.stop)


def blocks(count: int, size: int) -> Iterator[slice]:
    """Slices that cover so many samples, in order, each of ``size`` but the last."""
    return (slice(start, min(start + size, count)) for start in range(0, count, size))


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


def stretch_distances(short: FloatArray, whole: FloatArray) -> FloatArray:
    """(n - m + 1,) how far each stretch of ``whole`` is from ``short``: the root of their mean squared distance.

    With Σ(w - s)² = Σw² - 2 Σ w s + Σs² it takes a convolution a column.

    Args:
        short: (m, j) values.
        whole: (n, j) values at the same steps, n >= m; a stretch with NaN is infinitely far.
    """
    length = short.shape[0]
    missing = ~np.isfinite(whole)
    known = np.where(missing, 0.0, whole)
    squares = np.full(whole.shape[0] - length + 1, float(np.sum(short**2)))
    for own, other in zip(short.T, known.T, strict=True):
        squares += np.convolve(other**2, np.ones(length), "valid") - 2.0 * np.convolve(other, own[::-1], "valid")
    holes = np.convolve(missing.any(axis=1).astype(np.float64), np.ones(length), "valid") > 0.5
    squares[holes] = np.inf
    return np.asarray(np.sqrt(np.maximum(squares, 0.0) / length))


def nearest_stretch(short: FloatArray, whole: FloatArray, allowed: BoolArray | None = None) -> tuple[int, float] | None:
    """The stretch of ``whole`` whose values differ least from ``short``.

    Args:
        short, whole: as of :func:`stretch_distances`.
        allowed: (n - m + 1,) which starts count; None: all.

    Returns:
        Its first row and the distance; None where there is none.
    """
    if whole.shape[0] < short.shape[0]:
        return None
    distance = stretch_distances(short, whole)
    if allowed is not None:
        distance[~allowed] = np.inf
    best = int(np.argmin(distance))
    return (best, float(distance[best])) if np.isfinite(distance[best]) else None
