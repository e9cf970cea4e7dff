"""What a reader of tables hands on: names of columns, and columns as numbers or text."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from collaudit.core.numeric.arrays import FloatArray


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
    """An Arrow array as float64, NaN where missing; its own ``to_numpy`` imports pandas (0.2 s)."""
    import pyarrow as pa

    column = column.cast(pa.float64(), safe=False)  # a column of time may be asked for as numbers too
    whole = column.fill_null(float("nan")) if column.null_count else column
    values = np.frombuffer(whole.buffers()[1], dtype=np.float64, count=len(whole) + whole.offset)
    return np.asarray(values[whole.offset :])
