"""Runs of True in a mask, without a loop over samples."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from collaudit.core.numeric.arrays import BoolArray, IntArray, Span


def run_bounds(mask: BoolArray) -> tuple[IntArray, IntArray]:
    """Starts and stops (half-open) of the runs of True in a (n,) mask."""
    edges = np.flatnonzero(mask[1:] != mask[:-1]) + 1
    first, last = mask[:1].nonzero()[0], mask[-1:].nonzero()[0] + mask.size
    edges = np.concatenate((first, edges, last)).astype(np.int64)
    return edges[::2], edges[1::2]


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
