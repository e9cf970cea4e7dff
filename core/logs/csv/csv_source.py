"""The bytes of a table as Arrow takes them: as they are, or without what is no row of it."""

from __future__ import annotations

import io
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

from collaudit.core.errors import LogError
from collaudit.core.logs.csv.csv_stream import LineStream
from collaudit.core.logs.csv.csv_text import COMMENT, Dialect, open_bytes, rows_as_text
from collaudit.core.logs.file_kind import compression_of, head_of

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


def source_of(path: Path, dialect: Dialect, mend: Mend | None) -> tuple[Any, int, str, str]:
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
    if compression_of(head_of(path, 8)) is None:
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
