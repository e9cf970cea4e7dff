"""The lowest and the highest sample of every pixel column."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray
from collaudit.reports.plots.joint_trace import Series


def column_extremes(values: Series, mask: BoolArray, columns: int) -> tuple[IntArray, FloatArray, FloatArray]:
    """Extremes of the masked finite samples in each of ``columns`` equal stretches.

    Args:
        values: (n,).
        mask: (n,) samples that count.
        columns: how many stretches, at most n are made.

    Returns:
        First sample of each stretch (k + 1,), then least and greatest (k,); NaN where none counts.
    """
    n = len(values)
    edges = np.linspace(0, n, min(columns, n) + 1).astype(np.int64)
    if n == 0:
        return edges, np.empty(0), np.empty(0)
    low, high = np.full(len(edges) - 1, np.nan), np.full(len(edges) - 1, np.nan)
    for k, (start, stop) in enumerate(pairwise(edges.tolist())):  # each stretch stays in the processor's cache
        told = values[start:stop][mask[start:stop]]
        told = told[np.isfinite(told)]
        if told.size:
            low[k], high[k] = told.min(), told.max()
    return edges, low, high
