"""Numbers of blocks of time in which a gap of the log, however long, takes few blocks."""

from __future__ import annotations

import numpy as np

from collaudit.core.numeric.arrays import IntArray


def without_gaps(numbers: IntArray, longest: int) -> IntArray:
    """Blocks numbered anew, with gaps cut: a clock that jumped by days would make millions of empty blocks.

    Args:
        numbers: (k,) the block of each sample, rising.
        longest: steps between two blocks that stay; what lies further apart comes so near.
    """
    return np.asarray(numbers - np.cumsum(np.maximum(np.diff(numbers, prepend=numbers[:1]) - longest, 0)))


def counted_in_time(numbers: IntArray, block: IntArray, start: int, stop: int) -> tuple[int, int]:
    """The stretch [start, stop) of blocks in the numbers they had; its first and its last block hold samples.

    Args:
        numbers: (k,) the block of each sample as counted in time.
        block: (k,) the same without gaps.
        start, stop: blocks without gaps.
    """
    return int(numbers[np.searchsorted(block, start)]), int(numbers[np.searchsorted(block, stop) - 1]) + 1
