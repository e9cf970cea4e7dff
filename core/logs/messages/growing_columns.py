"""Columns that grow while a log is read."""

from __future__ import annotations

import numpy as np

from collaudit.core.numeric.arrays import FloatArray, IntArray
from collaudit.core.numeric.tables import table

#: Rows of room that a column grows by at least.
_LEAST_ROWS = 4096
Column = IntArray | FloatArray


class Growing:
    """An array that grows at its end, to twice its length each time: memory that is not written to costs nothing."""

    def __init__(self, width: int) -> None:
        """``width``: numbers of a row; 0 for one integer."""
        self._array: Column = np.empty((0, width)) if width else np.empty(0, dtype=np.int64)
        self._used = 0

    def add(self, values: Column) -> None:
        """Take in further rows."""
        start, self._used = self._used, self._used + values.shape[0]
        if self._used > self._array.shape[0]:
            longer = _empty(self._array, 2 * self._used + _LEAST_ROWS)
            longer[:start] = self._array[:start]
            self._array = longer
        self._array[start : self._used] = values

    def so_far(self) -> Column:
        """The rows so far, where they lie."""
        return self._array[: self._used]

    def __len__(self) -> int:
        return int(self._used)


def _empty(like: Column, rows: int) -> Column:
    return np.empty_like(like, shape=rows) if like.ndim == 1 else table(rows, like.shape[1])
