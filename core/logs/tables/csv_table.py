"""Reading the columns of a CSV as numbers through Arrow, with errors that name line and column."""

from __future__ import annotations

import csv
import io
import json
import os
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import cached_property, partial
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
from pyarrow import csv as arrow_csv
from pyarrow import enable_signal_handlers

from collaudit.core.config.schema import CsvConfig
from collaudit.core.errors import LogError
from collaudit.core.logs.storage.readers import TableColumns, TableReader, numbers_of
from collaudit.core.logs.tables.csv_text import (
    BLANKS,
    COMMENT,
    NULLS,
    Dialect,
    dialect_of,
    is_iso,
    is_number,
    is_time_of_day,
    rows_as_text,
    unpacked,
)
from collaudit.core.numeric.arrays import FloatArray

#: Rows whose cells are compared to tell whether tables were written from one recording.
_FIRST_ROWS = 50
#: Bytes parsed at once: what fits a core's second-level cache beside its numbers.
_BLOCK = 3 << 18
#: Lines of text behind a table are fewer.
_TRAILER = 50
#: Numbers with a mark between thousands and one before decimals, by the decimal mark: no other number is meant.
_GROUPED = {",": re.compile(r"[+-]?\d{1,3}(\.\d{3})+,\d+"), ".": re.compile(r"[+-]?\d{1,3}(,\d{3})+\.\d+")}
_DELIMITERS = {",": "comma", ";": "semicolon", "\t": "tab", "|": "bar", " ": "blank"}


class CsvTable:
    """A CSV (see :class:`collaudit.core.logs.storage.readers.TableReader`)."""

    format = "csv"
    left_out: tuple[str, ...] = ()

    def __init__(self, path: Path, settings: CsvConfig) -> None:
        self.path = self._file = path
        self.damage: str | None = None
        self.notes: tuple[str, ...] = ()
        self.dialect = dialect_of(path, settings)
        self.names = self.dialect.names
        self.named = self.dialect.header
        if self.dialect.before:
            self.notes = (f"{self.dialect.before} lines before its line of names",)
        delimiter, decimal = self.dialect.delimiter, self.dialect.decimal
        self.layout = (
            f"{_DELIMITERS.get(delimiter, delimiter)}-separated, decimal {'comma' if decimal == ',' else 'point'}"
        )
        self.stated: Mapping[str, str] = {"delimiter": delimiter, "decimal": decimal}

    def first_cells(self, column: int) -> tuple[str, ...]:
        """The cells of a column in the first rows, stripped."""
        return tuple(cells[column].strip() for cells in self._first_rows if column < len(cells))

    @cached_property
    def _first_rows(self) -> list[list[str]]:
        return [cells for _, cells in islice(self._rows(), _FIRST_ROWS)]

    def _rows(self) -> Iterator[tuple[int, list[str]]]:
        rows = rows_as_text(self._file, str(self.path), self.dialect)
        return ((line, unpacked(cells, self.dialect.lists)) for line, cells in rows)

    def read(self, groups: Mapping[str, Sequence[int]], time: int | None, texts: Sequence[int] = ()) -> TableColumns:
        """Read columns as numbers, and some as text.

        Args:
            groups: name to indices of columns of numbers.
            time: index of the time column, or None.
            texts: indices of columns of text.

        Raises:
            LogError: naming line and column, for a ragged row or a cell that is not a number.
        """
        numbers = {index for group in groups.values() for index in group}
        types = {f"c{index}": pa.float64() for index in numbers} | {f"c{index}": pa.string() for index in texts}
        wanted = sorted({*numbers, *([time] if time is not None else []), *texts})
        try:
            table = self._typed(*self._source(), wanted, types, time)
        except pa.ArrowInvalid:
            checked = self._checked([index for index in wanted if index not in texts], numbers, time)
            try:
                table = self._typed(*self._rewritten(checked), wanted, types, time)
            except pa.ArrowInvalid as failure:
                unread = "cannot be read as a table of numbers"
                raise LogError(unread, where=str(self.path), found=str(failure)[:200]) from None
        stamps = table.column(f"c{time}").combine_chunks() if time is not None else None
        words = {index: tuple(text or "" for text in table.column(f"c{index}").to_pylist()) for index in texts}
        return TableColumns({group: _matrix(table, indices) for group, indices in groups.items()}, stamps, words)

    def _source(self) -> tuple[Any, Dialect]:
        """What Arrow reads: the file, or its rows written anew: between blanks, in UTF-16, with lists in cells."""
        if self.dialect.lists or self.dialect.delimiter == " " or self.dialect.encoding == "utf-16":
            return self._rewritten(self._rows())
        return pa.PythonFile(self._file.open("rb"), "r"), self.dialect  # Arrow opens no name that is not UTF-8

    def _rewritten(self, rows: Iterable[tuple[int, list[str]]]) -> tuple[io.BytesIO, Dialect]:
        """Rows between tabs, in UTF-8, without comments between them; of those between blanks cells keep quotes."""
        out = io.StringIO()
        if self.dialect.delimiter == " ":
            out.writelines("\t".join(cells) + "\n" for _, cells in rows)
        else:
            csv.writer(out, delimiter="\t", lineterminator="\n").writerows(cells for _, cells in rows)
        text = io.BytesIO(out.getvalue().encode("utf-8", "replace"))
        return text, replace(self.dialect, skip=0, delimiter="\t", encoding="utf-8")

    def _typed(
        self, source: Any, dialect: Dialect, wanted: Sequence[int], types: Mapping[str, Any], time: int | None
    ) -> Any:
        """The table with the first type that its stamps fit.

        Raises:
            ArrowInvalid: they fit none, or another cell or row is not as it should be.
        """
        kinds = _time_types(next(iter(self.first_cells(time)), "")) if time is not None else []
        with source:
            for kind in kinds[:-1]:
                with suppress(pa.ArrowInvalid):
                    return _parsed(source, dialect, wanted, {**types, f"c{time}": kind})
            return _parsed(source, dialect, wanted, {**types, **{f"c{time}": kind for kind in kinds[-1:]}})

    def _checked(
        self, numeric: Sequence[int], may_be_empty: set[int], time: int | None
    ) -> Iterator[tuple[int, list[str]]]:
        """The rows, without a last one that was cut.

        Args:
            numeric: indices of the columns that must be numbers.
            may_be_empty: those of them that may be empty.
            time: index of the time column, which may hold ISO stamps; None without.

        Raises:
            LogError: a row has too few or too many cells, or a cell is no number.
        """
        width, rows = len(self.names), self._rows()
        repeated = 0
        for line, cells in rows:
            if tuple(cells) == self.dialect.head:
                repeated += 1
                continue
            cells = _ungrouped(cells, self.dialect.decimal)
            held = [index for index in numeric if index < len(cells)]
            bad = [k for k in held if not _fine(cells[k].strip(BLANKS), self.dialect, k in may_be_empty, k == time)]
            if len(cells) == width and not bad:
                yield line, cells
                continue
            behind = list(islice(rows, _TRAILER))
            if self._ends_with([cells, *(row for _, row in behind)]):
                self.notes += (f"text behind the table, from line {line} on",)
                break
            cut = len(cells) < width and set(bad) <= {len(cells) - 1} if len(cells) != width else bad == [width - 1]
            if not cut or behind or not self._lacks_its_end():
                raise self._refusal(line, cells, bad, time)
            self.damage = f"its last row, line {line}, ends in the middle and was left out"
        if repeated:
            self.notes += (f"its line of names, repeated {repeated} times",)

    def _ends_with(self, rows: Sequence[Sequence[str]]) -> bool:
        """Whether these last rows are text: fewer cells than columns each, and none begins with a number."""
        return len(rows) < _TRAILER and all(
            len(cells) < len(self.names) and not is_number(cells[0], self.dialect.decimal) and not is_iso(cells[0])
            for cells in rows
        )

    def _refusal(self, line: int, cells: Sequence[str], bad: Sequence[int], time: int | None) -> LogError:
        """Why a row is none, and the line of the configuration that reads the file where there is one."""
        first, numbers = cells[0].strip(), sum(is_number(cell, self.dialect.decimal) for cell in cells)
        hint = None
        keys: dict[str, object] = {}
        if not numbers and line == self.dialect.skip + 1 and self.dialect.header:
            keys = {"log.csv.units_row": True}
            hint = (
                "[log.csv] units_row = true, if this row holds the units of the columns; "
                f"[log.csv] header = {line}, if it holds their names"
            )
        elif not numbers and first:
            begins = [*self.dialect.comment[len(COMMENT) :], first[:40]]
            keys = {"log.csv.comment": begins}
            hint = f"lines that begin so are no rows: [log.csv] comment = {json.dumps(begins, ensure_ascii=False)}"
        elif time in bad:
            hint = (
                'name the columns that make a time together: [log.csv] time = ["Date", "Time"]; dates as 2026-11-24 or '
                "24.11.2026, times as 08:53:20.123"
            )
        where, width = f"{self.path}, line {line}", len(self.names)
        if len(cells) != width:
            message = "the row has another number of cells than the columns"
            return LogError(
                message, where=where, found=f"{len(cells)} cells", expected=f"{width}", hint=hint, keys=keys
            )
        name = self.names[bad[0]] if self.named else f"number {bad[0] + 1}"
        found = repr(cells[bad[0]].strip()[:60])
        return LogError(f"the cell in column {name!r} is not a number", where=where, found=found, hint=hint, keys=keys)

    def _lacks_its_end(self) -> bool:
        """Whether the last line has no end; of UTF-16 that is not told."""
        with self._file.open("rb") as stream:
            stream.seek(-1, os.SEEK_END)
            return stream.read() != b"\n" and self.dialect.encoding != "utf-16"


#: How the table of formats opens a file.
open_csv: Callable[[Path, CsvConfig], TableReader] = CsvTable


def _parsed(source: Any, dialect: Dialect, wanted: Sequence[int], types: Mapping[str, Any]) -> Any:
    """Let Arrow read columns ``c{index}`` in this thread, with comments between the rows left out.

    Arrow's own threads go on after an error and can abort the process; its handler of Ctrl-C is a thread, too.

    Raises:
        ArrowInvalid: a row or a cell is not as it should be.
    """
    enable_signal_handlers(False)
    source.seek(0)
    return arrow_csv.read_csv(
        source,
        read_options=arrow_csv.ReadOptions(
            column_names=[f"c{index}" for index in range(len(dialect.names))],
            skip_rows=dialect.skip,
            block_size=_BLOCK,
            encoding=dialect.encoding.removesuffix("-sig"),
            use_threads=False,
        ),
        parse_options=arrow_csv.ParseOptions(
            delimiter=dialect.delimiter, invalid_row_handler=partial(_comment_or_error, dialect.comment)
        ),
        convert_options=arrow_csv.ConvertOptions(
            include_columns=[f"c{index}" for index in wanted],
            column_types=dict(types),
            decimal_point=dialect.decimal,
            null_values=list(NULLS),
        ),
    )


def _comment_or_error(comment: tuple[str, ...], row: Any) -> str:
    text = str(row.text).strip()
    return "skip" if not text or text.startswith(comment) else "error"


def _matrix(table: Any, indices: Sequence[int]) -> FloatArray:
    """Columns one after the other in memory, strung together by Arrow in one go."""
    pieces = [piece for index in indices for piece in table.column(f"c{index}").chunks]
    values = numbers_of(pa.concat_arrays(pieces)) if pieces else np.empty(0)
    return values.reshape((table.num_rows, len(indices)), order="F")


def _time_types(first: str) -> list[Any]:
    """Arrow's types that a column of stamps may be of, the one that loses least first."""
    if is_iso(first):
        zoned = re.search(r"(Z|[+-]\d{2}:?\d{2})$", first) is not None
        return [pa.timestamp("ns", "UTC") if zoned else pa.timestamp("ns")]
    if is_time_of_day(first):
        return [pa.time64("ns")]
    if re.fullmatch(r"[+-]?\d+", first):
        return [pa.int64(), pa.decimal128(37, 12), pa.float64()]
    if re.fullmatch(r"\d{7,}[.,]\d+", first):
        return [pa.decimal128(37, 12), pa.float64()]
    return [pa.float64()]


def _ungrouped(cells: list[str], decimal: str) -> list[str]:
    """The cells without marks between thousands."""
    mark, grouped = "." if decimal == "," else ",", _GROUPED[decimal]
    return [cell.replace(mark, "") if mark in cell and grouped.fullmatch(cell.strip()) else cell for cell in cells]


def _fine(cell: str, dialect: Dialect, may_be_empty: bool, may_be_iso: bool) -> bool:
    return (
        (may_be_empty and cell in NULLS)
        or is_number(cell, dialect.decimal)
        or (may_be_iso and (is_iso(cell) or is_time_of_day(cell)))
    )
