"""Computations over long, narrow arrays, by blocks of samples in threads."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.numeric.parallel import ordered_map
from collaudit.core.numeric.tables import blocks, table

#: Samples at a time: long enough that calling NumPy costs little, short enough that results stay in the cache.
_BLOCK = 8192


def evaluate(compute: Callable[..., FloatArray], signals: Sequence[FloatArray], outputs: int) -> FloatArray:
    """(n, outputs) of a computation over all samples; one with any input that is not finite is NaN altogether.

    Args:
        compute: from (c, m) of each signal to (outputs, m).
        signals: (n, c) each.
        outputs: numbers that come out of a sample.
    """
    count = signals[0].shape[0]
    out = table(count, outputs)

    def one(block: slice) -> None:
        rows = [signal[block].T for signal in signals]
        known = np.all([np.isfinite(x).all(axis=0) for x in rows], axis=0)
        with np.errstate(invalid="ignore"):  # the sine of what is not finite is not a number, and that is right
            out[block] = np.where(known, compute(*rows), np.nan).T

    for _ in ordered_map(one, list(blocks(count, _BLOCK))):
        pass
    return out
