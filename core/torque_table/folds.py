"""Blocks of time that are held out in turn: one division of a log serves every choice and every residual."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from collaudit.core.data.joint_log import UniformSeries

#: Blocks of time a fold at least, so that no fold is one kind of motion only; a long log has so many longer ones.
_BLOCKS_A_FOLD, _ENOUGH_BLOCKS = 3, 20
_BLOCK_S = 10.0
#: With so many samples a fit without a third of them is as good as one without a fifth, and takes less time. A half
#: would often lack speeds of the other.
_MANY, _FEWEST_FOLDS = 100_000, 3


def fold_count(logs: Sequence[UniformSeries], most: int) -> int:
    """How many folds there are of these logs, of at most so many."""
    return most if sum(series.time_s.size for series in logs) <= _MANY else min(most, _FEWEST_FOLDS)


def block_length_s(series: UniformSeries, folds: int) -> float:
    """Length of the blocks of time that are dealt out in turn, so that each fold has a part of every kind of motion."""
    duration_s = float(series.time_s[-1] - series.time_s[0]) + series.period_s
    usual_s = max(_BLOCK_S, duration_s / (folds * _ENOUGH_BLOCKS))
    return min(usual_s, duration_s / (folds * _BLOCKS_A_FOLD))


def fold_of_sample(series: UniformSeries, folds: int) -> NDArray[np.int16]:
    """(n,) fold of each sample of a log.

    Args:
        series: the log.
        folds: how many there are.
    """
    block = np.floor((series.time_s - series.time_s[0]) / block_length_s(series, folds))
    return np.asarray(block.astype(np.int64) % folds, dtype=np.int16)
