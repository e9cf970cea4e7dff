"""Runs of True in a mask, without a loop over samples."""

from __future__ import annotations

import numpy as np

from collaudit.core.numeric.arrays import BoolArray, IntArray


def run_bounds(mask: BoolArray) -> tuple[IntArray, IntArray]:
    """Starts and stops (half-open) of the runs of True in a (n,) mask."""
    edges = np.flatnonzero(mask[1:] != mask[:-1]) + 1
    first, last = mask[:1].nonzero()[0], mask[-1:].nonzero()[0] + mask.size
    edges = np.concatenate((first, edges, last)).astype(np.int64)
    return edges[::2], edges[1::2]


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
    marks = np.zeros(mask.size + 1)
    np.add.at(marks, starts[short], 1)
    np.add.at(marks, stops[short], -1)
    return np.asarray(mask | (np.cumsum(marks[:-1]) > 0))


def widened(mask: BoolArray, margin: int) -> BoolArray:
    """The mask with each run reaching ``margin`` samples further on both sides."""
    starts, stops = run_bounds(mask)
    marks = np.zeros(mask.size + 1)
    np.add.at(marks, np.maximum(starts - margin, 0), 1)
    np.add.at(marks, np.minimum(stops + margin, mask.size), -1)
    return np.asarray(np.cumsum(marks[:-1]) > 0)


def rows_within(starts: IntArray, stops: IntArray) -> IntArray:
    """(k,) all numbers inside half-open ranges, which rise at both ends and may overlap; each number once."""
    if starts.size == 0:
        return np.empty(0, dtype=np.int64)
    apart = np.flatnonzero(starts[1:] > stops[:-1])
    first, last = starts[np.append(0, apart + 1)], stops[np.append(apart, stops.size - 1)]
    count = last - first
    before = np.cumsum(count) - count
    return np.asarray(np.repeat(first - before, count) + np.arange(count.sum()), dtype=np.int64)
