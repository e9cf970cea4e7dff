"""Columns that grow while a log is read, with room for all that is to come."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from collaudit.core.numeric.arrays import FloatArray, IntArray
from collaudit.core.numeric.tables import table

#: Rows of room that a column grows by at least.
_LEAST_ROWS = 4096
#: Room beyond what the share of the log read so far foretells, and how many times the rows so far at most.
_MARGIN, _MOST_FORESEEN = 1.1, 1000
#: A number of rows that the file claims is believed between so many times what the share foretells.
_BELIEVED = (0.5, 1.5)
Column = IntArray | FloatArray


class Growing:
    """An array that grows at its end, with room for all that is to come by the share of the log read so far.

    Memory that is not written to costs nothing, so room is taken generously and once: growing by resizing would write
    zeros into the new rows first, and in small pages. Room for just the rows that come costs least: of the page of
    2 MB in which a column ends, all is held.
    """

    def __init__(self, width: int, claimed: int = 0) -> None:
        """``width``: numbers of a row; 0 for one integer. ``claimed``: rows that the file claims; 0 for no number."""
        self._claimed = claimed
        self._array: Column = np.empty((0, width)) if width else np.empty(0, dtype=np.int64)
        self._used = 0

    def room(self, count: int, share: float, settle: Callable[[], None]) -> Column:
        """So many further rows, to be written to.

        Args:
            count: rows.
            share: how much of the log lies before these rows, 0 … 1; 0 where that is not known.
            settle: called before the rows so far are moved: waits until all of them are written.
        """
        start, self._used = self._used, self._used + count
        if self._used > self._array.shape[0]:
            settle()
            self._array = _with_room(self._array[:start], self._used, share, self._claimed)
        return self._array[start : self._used]

    def so_far(self) -> Column:
        """The rows so far, where they lie."""
        return self._array[: self._used]

    def __len__(self) -> int:
        return int(self._used)


def _with_room(rows: Column, least: int, share: float, claimed: int) -> Column:
    """A copy of rows with room for at least ``least``, and for the whole log when a share of it is known."""
    wanted = 2 * least + _LEAST_ROWS
    foreseen = int(least * min(_MARGIN / share, _MOST_FORESEEN)) if share > 0 else 0
    believed = max(least, _BELIEVED[0] * foreseen) <= claimed <= _BELIEVED[1] * foreseen
    for capacity in (claimed if believed else max(wanted, foreseen), wanted):
        try:
            out = np.empty_like(rows, shape=capacity) if rows.ndim == 1 else table(capacity, rows.shape[1])
            break
        except MemoryError:
            if capacity == wanted:
                raise
    out[: rows.shape[0]] = rows
    return out
