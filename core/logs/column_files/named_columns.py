"""A table of columns in memory, whatever file they came from."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa

from collaudit.core.errors import LogError
from collaudit.core.logs.storage.table_reader import TableColumns, arrow_of, numbers_of
from collaudit.core.numeric.arrays import FloatArray

#: Cells that are compared to tell whether tables were written from one recording.
_FIRST_ROWS = 50


class NamedColumns:
    """Columns by name (see :class:`collaudit.core.logs.storage.table_reader.TableReader`).

    Args:
        path: the file, for messages.
        kind: what results call the format.
        title: of the format, in words.
        columns: name to an Arrow array of n values, all of one length.
        stated: keys of ``[log.csv]`` that the file itself states.
        left_out: arrays of the file that are no columns because of their length, each with its shape.
        named: whether the names are the file's, and no numbers.

    Raises:
        LogError: there are no columns, or no rows.
    """

    damage: str | None = None
    notes: tuple[str, ...] = ()

    def __init__(
        self,
        path: Path,
        kind: str,
        title: str,
        columns: Mapping[str, Any],
        stated: Mapping[str, str] | None = None,
        left_out: tuple[str, ...] = (),
        named: bool = True,
    ) -> None:
        if not columns or not len(next(iter(columns.values()))):
            raise LogError("the file holds no rows of data", where=str(path), found=f"{len(columns)} columns")
        self.path, self.format, self.layout = path, kind, f"{title}, {len(columns)} columns"
        self.names = tuple(columns)
        self.stated: Mapping[str, str] = stated or {}
        self.left_out, self.named = left_out, named
        self._columns = list(columns.values())

    def first_cells(self, column: int) -> tuple[str, ...]:
        """The first values of a column, as text."""
        return tuple("" if value is None else str(value) for value in self._columns[column][:_FIRST_ROWS].to_pylist())

    def read(self, groups: Mapping[str, Sequence[int]], time: int | None, texts: Sequence[int] = ()) -> TableColumns:
        """Columns as numbers, and some as text.

        Args:
            groups: name to indices of columns of numbers.
            time: index of the time column, or None.
            texts: indices of columns of text.

        Raises:
            LogError: naming the column, for one that holds no numbers.
        """
        values = {name: self._matrix(indices) for name, indices in groups.items()}
        words = {index: tuple("" if v is None else str(v) for v in self._columns[index].to_pylist()) for index in texts}
        return TableColumns(values, None if time is None else self._stamps(time), words)

    def _matrix(self, indices: Sequence[int]) -> FloatArray:
        return np.asfortranarray(np.column_stack([self._numbers(index) for index in indices]))

    def _numbers(self, index: int) -> FloatArray:

        column = self._columns[index]
        whole = _whole(column)
        try:
            return numbers_of(whole.cast(pa.int8()) if pa.types.is_boolean(whole.type) else whole)
        except (pa.ArrowInvalid, pa.ArrowNotImplementedError, pa.ArrowTypeError) as error:
            raise LogError(
                f"column {self.names[index]!r} does not hold numbers", where=str(self.path), found=str(column.type)
            ) from error

    def _stamps(self, index: int) -> Any:
        """The time column as a reader hands it on: timestamps in ns, ISO texts as timestamps."""

        column = self._columns[index]
        kind = column.type
        try:
            if pa.types.is_timestamp(kind) or pa.types.is_date(kind):
                return column.cast(pa.timestamp("ns", tz=getattr(kind, "tz", None)))
            if pa.types.is_duration(kind):
                return arrow_of(numbers_of(_whole(column).cast(pa.duration("ns")).cast(pa.int64())) / 1e9)
            if pa.types.is_string(kind) or pa.types.is_large_string(kind):
                return column.cast(pa.timestamp("ns"))
            return column if pa.types.is_integer(kind) or pa.types.is_decimal(kind) else column.cast(pa.float64())
        except (pa.ArrowInvalid, pa.ArrowNotImplementedError) as error:
            text = f"the time column {self.names[index]!r} holds neither numbers nor times"
            raise LogError(text, where=str(self.path), found=f"{kind} ({str(error)[:120]})") from error


def _whole(column: Any) -> Any:
    """An Arrow array in one piece."""
    return column.combine_chunks() if isinstance(column, pa.ChunkedArray) else column
