"""Reading the columns of a CSV as numbers, with errors that name line and column."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa

from collaudit.core.config.schema import CsvConfig
from collaudit.core.errors import LogError
from collaudit.core.logs.csv.csv_parsing import parse, parse_rewritten
from collaudit.core.logs.csv.csv_text import (
    BLANKS,
    NULLS,
    Dialect,
    dialect_of,
    is_iso,
    is_number,
    open_bytes,
    read_head,
    rows_as_text,
    split,
)
from collaudit.core.logs.storage.table_reader import TableColumns, TableReader, numbers_of
from collaudit.core.numeric.arrays import FloatArray

#: Rows whose cells are compared to tell whether tables were written from one recording.
_FIRST_ROWS = 50
_Parse = Callable[[Sequence[Any], dict[str, Any]], tuple[Any, str | None]]
_DELIMITERS = {",": "comma", ";": "semicolon", "\t": "tab", "|": "bar", " ": "blank"}
_PIECE = 1 << 20


class CsvTable:
    """A CSV (see :class:`collaudit.core.logs.storage.table_reader.TableReader`)."""

    format = "csv"
    left_out: tuple[str, ...] = ()

    def __init__(self, path: Path, settings: CsvConfig) -> None:
        self.path = path
        self.dialect = dialect_of(path, settings)
        self.names = self.dialect.names
        self.named = self.dialect.header
        delimiter, decimal = self.dialect.delimiter, self.dialect.decimal
        self.layout = (
            f"{_DELIMITERS.get(delimiter, delimiter)}-separated, decimal {'comma' if decimal == ',' else 'point'}"
        )
        self.stated: Mapping[str, str] = {"delimiter": delimiter, "decimal": decimal}

    def first_cells(self, column: int) -> tuple[str, ...]:
        """The cells of a column in the first rows, stripped."""
        return tuple(row[column].strip() for row in self._first_rows if column < len(row))

    @cached_property
    def _first_rows(self) -> list[list[str]]:
        lines = read_head(self.path).decode(self.dialect.encoding, errors="replace").splitlines()
        return [split(line, self.dialect.delimiter) for line in lines[self.dialect.skip :][:_FIRST_ROWS]]

    def read(self, groups: Mapping[str, Sequence[int]], time: int | None, texts: Sequence[int] = ()) -> TableColumns:
        """Read columns as numbers, and some as text.

        Args:
            groups: name to indices of columns of numbers.
            time: index of the time column, or None.
            texts: indices of columns of text.

        Raises:
            LogError: naming line and column, for a ragged row or a cell that is not a number.
        """

        path, dialect = self.path, self.dialect
        columns = [index for group in groups.values() for index in group]
        wanted = sorted({*columns, *([time] if time is not None else []), *texts})
        types: dict[str, Any] = {f"c{index}": pa.float64() for index in columns}
        types |= {f"c{index}": pa.string() for index in texts}
        try:
            table, damage = _typed(partial(parse, path, dialect), dialect, wanted, types, time)
        except pa.ArrowInvalid as failure:
            fault = _first_fault(path, dialect, [k for k in wanted if k not in texts], columns, time)
            try:
                table, damage = _mended(path, dialect, wanted, types, time, fault)
            except pa.ArrowInvalid:
                unread = LogError("cannot be read as a table of numbers", where=str(path), found=str(failure)[:200])
                raise (unread if fault is None else fault.error) from None
        stamps = table.column(f"c{time}") if time is not None else None
        words = {index: tuple(text or "" for text in table.column(f"c{index}").to_pylist()) for index in texts}
        values = {group: _matrix(table, indices) for group, indices in groups.items()}
        return TableColumns(values, stamps, words, damage)


def _typed(
    parse_as: _Parse, dialect: Dialect, wanted: Sequence[int], types: dict[str, Any], time: int | None
) -> tuple[Any, str | None]:
    """The table by one way of parsing, with the first type that its stamps fit.

    Raises:
        ArrowInvalid: they fit none, or another cell or row is not as it should be.
    """

    kinds = _time_types(dialect.first[time]) if time is not None and time < len(dialect.first) else []
    for kind in kinds[:-1]:
        with suppress(pa.ArrowInvalid):
            return parse_as(wanted, types | {f"c{time}": kind})
    return parse_as(wanted, types | {f"c{time}": kind for kind in kinds[-1:]})


def _mended(
    path: Path, dialect: Dialect, wanted: Sequence[int], types: dict[str, Any], time: int | None, fault: _Fault | None
) -> tuple[Any, str | None]:
    """The table without what is no row of it: comments with as many cells as it has columns, a last row cut short.

    Raises:
        ArrowInvalid: it cannot be read without them either.
        LogError: the fault is another one.
    """
    if fault is not None and not fault.cut:
        raise fault.error
    rewritten = partial(parse_rewritten, path, dialect, stop=None if fault is None else fault.line)
    table, damage = _typed(rewritten, dialect, wanted, types, time)
    if fault is None:
        return table, damage
    return table, damage or f"its last row, line {fault.line}, ends in the middle and was left out"


def _matrix(table: Any, indices: Sequence[int]) -> FloatArray:
    """Columns one after the other in memory, strung together by Arrow in one go."""

    pieces = [piece for index in indices for piece in table.column(f"c{index}").chunks]
    values = numbers_of(pa.concat_arrays(pieces)) if pieces else np.empty(0)
    return values.reshape((table.num_rows, len(indices)), order="F")


def _time_types(first: str) -> list[Any]:

    text = first.strip()
    if is_iso(text):
        zoned = re.search(r"(Z|[+-]\d{2}:?\d{2})$", text) is not None
        return [pa.timestamp("ns", "UTC") if zoned else pa.timestamp("ns")]
    if re.fullmatch(r"[+-]?\d+", text):
        return [pa.int64(), pa.decimal128(37, 12), pa.float64()]
    if re.fullmatch(r"\d{7,}[.,]\d+", text):
        return [pa.decimal128(37, 12), pa.float64()]
    return [pa.float64()]


#: How the table of formats opens a file.
open_csv: Callable[[Path, CsvConfig], TableReader] = CsvTable


@dataclass(frozen=True, slots=True)
class _Fault:
    """What is wrong with a row.

    Attributes:
        error: what to tell the user, with line and column.
        line: number of the line, from 1.
        cut: whether it is the file's last line, not ended, and only its end is wrong: the file was cut inside it.
    """

    error: LogError
    line: int
    cut: bool


def _first_fault(
    path: Path, dialect: Dialect, wanted: Sequence[int], numeric: Sequence[int], time: int | None
) -> _Fault | None:
    """Find the first row that has too few or too many cells, or a cell that is no number.

    Args:
        path: the file.
        dialect: how it is written.
        wanted: indices of the columns that must be numbers.
        numeric: those of them that may be empty.
        time: index of the time column, which may hold ISO stamps; None without.

    Raises:
        LogError: as of :func:`~collaudit.core.logs.csv.csv_text.rows_as_text`.
    """
    width = len(dialect.names)
    may_be_empty = set(numeric)
    with open_bytes(path) as raw:
        rows = rows_as_text(path, raw, dialect)
        for line, cells in rows:
            where = f"{path}, line {line}"
            held = [(k, cells[k].strip(BLANKS)) for k in wanted if k < len(cells)]
            bad = [k for k, cell in held if not _fine(cell, k, dialect, may_be_empty, time)]
            if len(cells) == width and not bad:
                continue
            last = next(rows, None) is None and _lacks_its_end(path, dialect)
            if len(cells) != width:
                message = "the row has another number of cells than the columns"
                error = LogError(message, where=where, found=f"{len(cells)} cells", expected=f"{width}")
                return _Fault(error, line, last and len(cells) < width and not set(bad) - {len(cells) - 1})
            name = dialect.names[bad[0]] if dialect.header else f"number {bad[0] + 1}"
            message = f"the cell in column {name!r} is not a number"
            error = LogError(message, where=where, found=repr(cells[bad[0]].strip()[:60]))
            return _Fault(error, line, last and bad == [width - 1])
    return None


def _fine(cell: str, index: int, dialect: Dialect, may_be_empty: set[int], time: int | None) -> bool:
    if cell in NULLS and index in may_be_empty:
        return True
    return is_number(cell, dialect.decimal) or (index == time and is_iso(cell))


def _lacks_its_end(path: Path, dialect: Dialect) -> bool:
    """Whether the last line has no end; of UTF-16 that is not told."""
    end = b"\n"
    with open_bytes(path) as stream:
        while piece := stream.read(_PIECE):
            end = piece[-1:]
    return end != b"\n" and dialect.encoding != "utf-16"
