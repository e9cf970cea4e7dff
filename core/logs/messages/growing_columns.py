"""Columns that grow while a log is read."""

from __future__ import annotations

import numpy as np

from collaudit.core.numeric.arrays import FloatArray, IntArray
from collaudit.core.numeric.tables import table

#: Rows of room that a column grows by at least.
_LEAST_ROWS = 4096
#: And how many times as long it becomes at most.
_MOST_TIMES = 64
Column = IntArray | FloatArray


class Growing:
    """An array that grows at its end: memory that is not written to costs nothing.

    It grows to as many rows as are claimed, within 64 times what is there, for claims may be false; to twice its length
    where no more are claimed.
    """

    def __init__(self, width: int, claimed: int = 0) -> None:
        """``width``: numbers of a row, 0 for one integer; ``claimed``: rows that are said to come."""
        self._array: Column = np.empty((0, width)) if width else np.empty(0, dtype=np.int64)
        self._used, self._claimed = 0, claimed

    def add(self, values: Column) -> None:
        """Take in further rows."""
        start, self._used = self._used, self._used + values.shape[0]
        if self._used > self._array.shape[0]:
            rows = min(self._claimed, _MOST_TIMES * self._used)
            longer = _empty(self._array, rows if rows >= self._used else 2 * self._used + _LEAST_ROWS)
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
