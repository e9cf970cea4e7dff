"""Columns that grow while a log is read, with room for all that is to come."""

from __future__ import annotations

import numpy as np

from collaudit.core.numeric.arrays import FloatArray, IntArray
from collaudit.core.numeric.tables import table

#: Rows of room that a column grows by at least.
_LEAST_ROWS = 4096
#: Room beyond what the share of the log read so far foretells, and how many times the rows so far at most.
_MARGIN, _MOST_FORESEEN = 1.1, 1000
Column = IntArray | FloatArray


class Growing:
    """An array that grows at its end, with room for all that is to come by the share of the log read so far.

    Memory that is not written to costs nothing, so room is taken generously and once: growing by resizing would write
    zeros into the new rows first, and in small pages.
    """

    def __init__(self, width: int) -> None:
        """``width``: numbers of a row; 0 for one integer."""
        self._array: Column = np.empty((0, width)) if width else np.empty(0, dtype=np.int64)
        self._used = 0

    def add(self, values: Column, share: float) -> None:
        """Take in further rows.

        Args:
            values: the rows.
            share: how much of the log lies before these rows, 0 … 1; 0 where that is not known.
        """
        start, self._used = self._used, self._used + values.shape[0]
        if self._used > self._array.shape[0]:
            self._array = _with_room(self._array[:start], self._used, share)
        self._array[start : self._used] = values

    def so_far(self) -> Column:
        """The rows so far, where they lie."""
        return self._array[: self._used]

    def __len__(self) -> int:
        return int(self._used)


def _with_room(rows: Column, least: int, share: float) -> Column:
    """A copy of rows with room for at least ``least``, and for the whole log when a share of it is known."""
    wanted = 2 * least + _LEAST_ROWS
    foreseen = int(least * min(_MARGIN / share, _MOST_FORESEEN)) if share > 0 else 0
    try:
        out = _empty(rows, max(wanted, foreseen))
    except MemoryError:
        out = _empty(rows, wanted)
    out[: rows.shape[0]] = rows
    return out


def _empty(like: Column, rows: int) -> Column:
    return np.empty_like(like, shape=rows) if like.ndim == 1 else table(rows, like.shape[1])
