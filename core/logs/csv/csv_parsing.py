"""Parsing a CSV once, through Arrow, for whose single delimiters runs of blanks between cells are rewritten."""

from __future__ import annotations

import io
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from math import ceil
from pathlib import Path
from typing import IO, Any

from collaudit.core.errors import LogError
from collaudit.core.logs.csv.csv_stream import BoundedStream, LineStream
from collaudit.core.logs.csv.csv_text import COMMENT, NULLS, Dialect, open_bytes, rows_as_text
from collaudit.core.logs.storage.decompression import decompression_errors
from collaudit.core.logs.storage.file_head import compression_at
from collaudit.core.numeric.parallel import ordered_map

#: Bytes parsed at once: what fits a core's second-level cache beside its numbers.
_BLOCK = 3 << 18
#: Bytes of a file that is read by several threads, and that one of them reads at a time at most: to begin costs as
#: much as parsing a megabyte.
_LARGE, _PART = 1 << 24, 1 << 25
_COMMENT = tuple(mark.encode() for mark in COMMENT)


@dataclass(frozen=True, slots=True)
class Mend:
    """What to leave out: comments between the rows, and a last row that was cut.

    Attributes:
        line: number from 1 of the last row, when it is left out.
        before: bytes of text before it.
    """

    line: int | None = None
    before: int | None = None


def parse(
    path: Path,
    dialect: Dialect,
    wanted: Sequence[int],
    types: Mapping[str, Any],
    mend: Mend | None = None,
    *,
    quotes: bool = True,
) -> tuple[Any, str | None]:
    """Parse a table once, with the types given.

    Args:
        path: the file.
        dialect: how it is written.
        wanted: indices of columns.
        types: the Arrow type of each column ``c{index}``.
        mend: what to leave out; None leaves the file as it is.
        quotes: whether cells may stand in quotes.

    Returns:
        An Arrow table with columns ``c{index}``, and where a compressed file could not be read to its end.

    Raises:
        ArrowInvalid: a row or a cell is not as it should be.
        LogError: a compressed file cannot be read at all.
    """
    from pyarrow import ArrowInvalid, NativeFile, enable_signal_handlers

    # Arrow's handler of Ctrl-C is a thread of its own; Python's serves between the parts.
    enable_signal_handlers(False)
    try:
        source, skip, delimiter, encoding = _source(path, dialect, mend)
        reading = _Reading(len(dialect.names), skip, delimiter, encoding, quotes, wanted, types, dialect.decimal)
        with source:
            if isinstance(source, NativeFile) and encoding == "utf-8" and not quotes and source.size() > _LARGE:
                try:
                    return reading.table_of_parts(path), None
                except ArrowInvalid:
                    pass  # the whole file tells at which row
            table = reading.table(source)
            stream = getattr(source, "raw", None)
            return table, stream.damage if isinstance(stream, (BoundedStream, LineStream)) else None
    except decompression_errors() as error:
        raise LogError(f"cannot be read to its end: {error}", where=str(path)) from error


@dataclass(frozen=True, slots=True)
class _Reading:
    """What Arrow is told about a table."""

    width: int
    skip: int
    delimiter: str
    encoding: str
    quotes: bool
    wanted: Sequence[int]
    types: Mapping[str, Any]
    decimal: str

    def table_of_parts(self, path: Path) -> Any:
        """Read a plain file without quotes in parts that end with a line, several at a time.

        Arrow's own threads go on after an error and can abort the process; ours are waited for.
        """
        import pyarrow as pa

        def part(span: tuple[int, int]) -> Any:
            first, stop = span
            own = self if first == 0 else replace(self, skip=0)
            return own.table(pa.OSFile(str(path)).get_stream(first, stop - first))

        return pa.concat_tables(ordered_map(part, list(pairwise(_line_starts(path)))))

    def table(self, source: Any) -> Any:
        """Read it in this thread, with comments between the rows left out."""
        from pyarrow import csv as arrow_csv

        return arrow_csv.read_csv(
            source,
            read_options=arrow_csv.ReadOptions(
                column_names=[f"c{index}" for index in range(self.width)],
                skip_rows=self.skip,
                block_size=_BLOCK,
                encoding=self.encoding,
                use_threads=False,
            ),
            parse_options=arrow_csv.ParseOptions(
                delimiter=self.delimiter,
                quote_char='"' if self.quotes else False,
                invalid_row_handler=_comment_or_error,
            ),
            convert_options=arrow_csv.ConvertOptions(
                include_columns=[f"c{index}" for index in self.wanted],
                column_types=dict(self.types),
                decimal_point=self.decimal,
                null_values=list(NULLS),
            ),
        )


def _line_starts(path: Path) -> list[int]:
    """Where parts of at most about ``_PART`` bytes begin, each with a line, and the end of the file.

    They are as many as two threads share evenly.
    """
    size = path.stat().st_size
    count = 2 * ceil(size / (2 * _PART))
    starts = [0]
    with path.open("rb") as file:
        for k in range(1, count):
            file.seek(k * size // count)
            file.readline()
            if starts[-1] < file.tell() < size:
                starts.append(file.tell())
    return [*starts, size]


def _comment_or_error(row: Any) -> str:
    text = str(row.text).strip()
    return "skip" if not text or text.startswith(COMMENT) else "error"


def _source(path: Path, dialect: Dialect, mend: Mend | None) -> tuple[Any, int, str, str]:
    """A byte source for Arrow, the lines it must skip, the delimiter and the encoding.

    White space becomes commas, and UTF-16 becomes UTF-8.

    Raises:
        LogError: what should be UTF-16 is not.
    """
    import pyarrow as pa

    encoding = dialect.encoding.removesuffix("-sig")
    if dialect.delimiter == " ":
        stop = mend.line if mend is not None else None
        rows = (",".join(cells) for line, cells in rows_as_text(path, dialect) if stop is None or line < stop)
        return io.BytesIO("\n".join(rows).encode()), 0, ",", "utf-8"
    if encoding == "utf-16":
        return io.BytesIO(_from_utf16(path, dialect.skip, mend)), dialect.skip, dialect.delimiter, "utf-8"
    if mend is not None:
        stream = open_bytes(path)
        lines = LineStream(_rows(stream, dialect.skip, mend.before), stream)
        return io.BufferedReader(lines), dialect.skip, dialect.delimiter, encoding
    if compression_at(path) is None:
        return pa.OSFile(str(path)), dialect.skip, dialect.delimiter, encoding
    return open_bytes(path), dialect.skip, dialect.delimiter, encoding


def _from_utf16(path: Path, skip: int, mend: Mend | None) -> bytes:
    """The text as UTF-8, without comments after the lines that are skipped when it is to be mended."""
    try:
        with open_bytes(path) as raw, io.TextIOWrapper(raw, "utf-16", newline="") as text:
            lines = list(text)
    except UnicodeError as error:
        raise LogError(f"begins as UTF-16 text and does not go on so: {error}", where=str(path)) from error
    if mend is not None:
        lines = [line for k, line in enumerate(lines) if k < skip or not line.lstrip().startswith(COMMENT)]
    return "".join(lines).encode()


def _rows(stream: IO[bytes], skip: int, before: int | None) -> Iterator[bytes]:
    """The lines of the first so many bytes, without the comments after those that are skipped."""
    at = 0
    for number, line in enumerate(stream):
        at += len(line)
        if before is not None and at > before:
            return
        if number < skip or not line.lstrip().startswith(_COMMENT):
            yield line
