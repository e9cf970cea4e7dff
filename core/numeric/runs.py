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
