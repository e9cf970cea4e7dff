"""The bytes of a table as Arrow takes them: as they are, or without what is no row of it."""

from __future__ import annotations

import io
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

from collaudit.core.logs.csv_stream import LineStream
from collaudit.core.logs.csv_text import COMMENT, Dialect, open_bytes, rows_as_text
from collaudit.core.logs.sniff import compression_of, head_of

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


def source_of(path: Path, dialect: Dialect, mend: Mend | None) -> tuple[Any, int, str]:
    """A byte source for Arrow, the lines it must skip, and the delimiter; white space becomes commas."""
    import pyarrow as pa

    if dialect.delimiter == " ":
        stop = mend.line if mend is not None else None
        rows = (",".join(cells) for line, cells in rows_as_text(path, dialect) if stop is None or line < stop)
        return io.BytesIO("\n".join(rows).encode()), 0, ","
    if mend is not None:
        stream = open_bytes(path)
        lines = LineStream(_rows(stream, dialect.skip, mend.before), stream)
        return io.BufferedReader(lines), dialect.skip, dialect.delimiter
    if compression_of(head_of(path, 8)) is None:
        return pa.OSFile(str(path)), dialect.skip, dialect.delimiter
    return open_bytes(path), dialect.skip, dialect.delimiter


def _rows(stream: IO[bytes], skip: int, before: int | None) -> Iterator[bytes]:
    """The lines of the first so many bytes, without the comments after those that are skipped."""
    at = 0
    for number, line in enumerate(stream):
        at += len(line)
        if before is not None and at > before:
            return
        if number < skip or not line.lstrip().startswith(_COMMENT):
            yield line
