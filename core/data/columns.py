"""Tables with a column for each joint that are computed, or filled up, where they are read.

A table of an hour takes 100 MB a quantity. What follows from other tables, or is known at few samples, is not kept.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from collaudit.core.numeric.arrays import FloatArray, IntArray, Span
from collaudit.core.numeric.filters import slope_between

#: Row numbers lie close together where so many times their number of rows, at most, hold all of them.
_CLOSE = 2


class Columns(Protocol):
    """An array (n, j), or what is read like one: ``x[rows, j]``, ``x[rows]``, or as a whole by ``np.asarray``."""

    @property
    def shape(self) -> tuple[int, ...]:
        """(n, j)."""

    def __getitem__(self, key: Any, /) -> Any:
        """An array: of a column's rows, or of rows of all columns."""


def read(table: Columns, rows: Any, j: int) -> Any:
    """Rows of one column: of an array several times as fast as ``table[rows, j]`` where the rows are numbers."""
    return table[:, j][rows] if isinstance(table, np.ndarray) else table[rows, j]


class ComputedColumns(ABC):
    """A table whose columns are computed when they are read."""

    __slots__ = ()

    @property
    @abstractmethod
    def shape(self) -> tuple[int, int]:
        """(n, j)."""

    @abstractmethod
    def _column(self, rows: Any, j: int) -> Any:
        """Rows, by any index of NumPy's, of one column."""

    def __getitem__(self, key: Any, /) -> Any:
        """See :class:`Columns`."""
        rows, columns = key if isinstance(key, tuple) else (key, slice(None))
        if isinstance(columns, int | np.integer):
            return self._column(rows, int(columns))
        picked = np.arange(self.shape[1])[columns].tolist()
        first = np.asarray(self._column(rows, picked[0] if picked else 0))
        out = np.empty((*first.shape, len(picked)), dtype=first.dtype, order="F")
        for place, j in enumerate(picked):
            out[..., place] = self._column(rows, j) if place else first
        return out

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> NDArray[Any]:
        """The whole table, column by column in memory."""
        return np.asarray(self[:], dtype=dtype)


@dataclass(frozen=True, slots=True, eq=False)
class OfTwo(ComputedColumns):
    """(n, j) an operation on two tables, value by value.

    Attributes:
        operation: of NumPy, such as its difference.
        first, second: (n, j).
    """

    operation: np.ufunc
    first: FloatArray
    second: FloatArray

    @property
    def shape(self) -> tuple[int, int]:
        """(n, j)."""
        return self.first.shape[0], self.first.shape[1]

    def __getitem__(self, key: Any, /) -> Any:
        """See :class:`Columns`."""
        if isinstance(key, tuple) and isinstance(key[1], int | np.integer):
            return self._column(key[0], int(key[1]))
        return self.operation(self.first[key], self.second[key])

    def _column(self, rows: Any, j: int) -> Any:
        return self.operation(read(self.first, rows, j), read(self.second, rows, j))


@dataclass(frozen=True, slots=True, eq=False)
class Slope(ComputedColumns):
    """(n, j) central differences of a table inside each stretch, as :func:`differentiate` gives them."""

    values: FloatArray
    segments: Sequence[Span]
    period_s: float

    @property
    def shape(self) -> tuple[int, int]:
        """(n, j)."""
        return self.values.shape[0], self.values.shape[1]

    def _column(self, rows: Any, j: int) -> Any:
        part = _stretch_of(rows, self.shape[0])
        start, stop = part or _around(rows, self.shape[0])
        out = slope_between(self.values[:, j], self.segments, self.period_s, start, stop)
        return out if part else out[rows - start if start else rows]


@dataclass(frozen=True, slots=True, eq=False)
class KnownAtFew(ComputedColumns):
    """(n, j) values that are known at some samples and NaN at the others.

    Attributes:
        count: n.
        rows: for each joint the samples at which its values are known, in order.
        values: for each joint the values there, all of one type.
    """

    count: int
    rows: Sequence[NDArray[np.int32] | IntArray]
    values: Sequence[NDArray[Any]]

    @property
    def shape(self) -> tuple[int, int]:
        """(n, j)."""
        return self.count, len(self.rows)

    def _column(self, rows: Any, j: int) -> Any:
        part = _stretch_of(rows, self.count)
        start, stop = part or (0, self.count)
        first, last = np.searchsorted(self.rows[j], (start, stop))
        out = np.full(stop - start, np.nan, dtype=self.values[j].dtype)
        out[self.rows[j][first:last] - start] = self.values[j][first:last]
        return out if part else out[rows]


def _stretch_of(rows: Any, count: int) -> tuple[int, int] | None:
    """First row, and the one after the last, where the rows follow each other."""
    if not isinstance(rows, slice) or rows.step not in (None, 1):
        return None
    start, stop, _ = rows.indices(count)
    return start, max(start, stop)


def _around(rows: Any, count: int) -> tuple[int, int]:
    """First row, and the one after the last, of row numbers that lie close together; all of any others."""
    if isinstance(rows, np.ndarray) and rows.dtype.kind == "i" and rows.size:
        start, stop = int(rows.min()), int(rows.max()) + 1
        if start >= 0 and stop - start <= _CLOSE * rows.size:
            return start, stop
    return 0, count
