"""What a reader of tables hands on: names of columns, and columns as numbers or text."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray


@dataclass(frozen=True, slots=True, eq=False)
class TableColumns:
    """Columns of one file.

    Attributes:
        values: name of a group to (n, c) numbers, NaN where missing; column after column in memory (Fortran order) is
            the fastest.
        stamps: the time column as an Arrow array of n integers, float64, decimals or timestamps, which keep
            nanoseconds since the epoch exactly; None without.
        texts: index of a column to n texts.
    """

    values: dict[str, FloatArray]
    stamps: Any
    texts: dict[int, tuple[str, ...]]


class TableReader(Protocol):
    """An opened table: one row a sample, columns by their number from 0.

    Attributes:
        path: the file.
        format: what results call the format.
        names: of the columns; "1", "2" … of a table without names.
        named: whether the table itself holds the names.
        layout: how it is written, in words, for ``inspect``.
        stated: keys of ``[log.csv]`` that let the file be read as it was recognised; empty where nothing is guessed.
        left_out: what the file holds besides and is no column, in words.
        notes: what is in the file beside the table and was left out, in words; more once columns were read.
        damage: where the file could not be read to its end, or None; known once columns were read.
    """

    path: Path
    format: str
    names: tuple[str, ...]
    named: bool
    layout: str
    stated: Mapping[str, str]
    left_out: tuple[str, ...]
    notes: tuple[str, ...]
    damage: str | None

    def first_cells(self, column: int) -> tuple[str, ...]:
        """Some cells from the beginning of a column, as text: equal where tables were written from one recording."""

    def read(self, groups: Mapping[str, Sequence[int]], time: int | None, texts: Sequence[int] = ()) -> TableColumns:
        """Read columns as numbers, and some as text.

        Args:
            groups: name to indices of columns of numbers.
            time: index of the time column, or None.
            texts: indices of columns of text.

        Raises:
            LogError: naming line and column where it can, for a cell that is not a number.
        """


def numbers_of(column: Any) -> FloatArray:
    """An Arrow array (n,) as float64, NaN where missing; its own ``to_numpy`` imports pandas (0.2 s)."""
    import pyarrow as pa

    column = column.cast(pa.float64(), safe=False)  # a column of time may be asked for as numbers too
    whole = column.fill_null(float("nan")) if column.null_count else column
    return np.asarray(_held(whole, np.float64))


def integers_of(column: Any) -> IntArray:
    """An Arrow array (n,) without missing values as int64, without pandas as :func:`numbers_of`."""
    import pyarrow as pa

    return np.asarray(_held(column.cast(pa.int64()), np.int64))


def _held(whole: Any, kind: type[np.float64] | type[np.int64]) -> Any:
    """(n,) what an Arrow array of this kind holds, not copied."""
    return np.frombuffer(whole.buffers()[1], dtype=kind, count=len(whole) + whole.offset)[whole.offset :]


def arrow_of(values: NDArray[Any], known: BoolArray | None = None) -> Any:
    """Numbers or truth values (n,) as an Arrow array; ``pyarrow.array`` imports pandas.

    Args:
        values: of the byte order of this machine.
        known: (n,) where they are not missing; None for everywhere.
    """
    import pyarrow as pa

    held = _bits(values) if values.dtype.kind == "b" else pa.py_buffer(np.ascontiguousarray(values))
    missing = None if known is None else _bits(known)
    return pa.Array.from_buffers(pa.from_numpy_dtype(values.dtype), values.size, [missing, held])


def _bits(flags: BoolArray) -> Any:
    """Truth values (n,) as Arrow keeps them."""
    import pyarrow as pa

    return pa.py_buffer(np.packbits(flags, bitorder="little"))
