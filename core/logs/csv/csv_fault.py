"""The first cell or row of a table that is not what it should be, found line by line."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from collaudit.core.errors import LogError
from collaudit.core.logs.csv.csv_text import BLANKS, NULLS, Dialect, is_iso, is_number, open_bytes, rows_as_text

_PIECE = 1 << 20


@dataclass(frozen=True, slots=True)
class Fault:
    """What is wrong with a row.

    Attributes:
        error: what to tell the user, with line and column.
        line: number of the line, from 1.
        before: bytes of text before it, when it is the file's last line, not ended, and nothing but its end is wrong:
            the file was cut inside it. None otherwise.
    """

    error: LogError
    line: int
    before: int | None


def first_fault(
    path: Path, dialect: Dialect, wanted: Sequence[int], numeric: Sequence[int], time: int | None
) -> Fault | None:
    """Find the first row that has too few or too many cells, or a cell that is no number.

    Args:
        path: the file.
        dialect: how it is written.
        wanted: indices of the columns that must be numbers.
        numeric: those of them that may be empty.
        time: index of the time column, which may hold ISO stamps; None without.
    """
    width = len(dialect.names)
    may_be_empty = set(numeric)
    rows = rows_as_text(path, dialect)
    try:
        for line, cells in rows:
            where = f"{path}, line {line}"
            held = [(k, cells[k].strip(BLANKS)) for k in wanted if k < len(cells)]
            bad = [k for k, cell in held if not _fine(cell, k, dialect, may_be_empty, time)]
            if len(cells) == width and not bad:
                continue
            before = _whole_lines(path, dialect) if next(rows, None) is None else None
            if len(cells) != width:
                message = "the row has another number of cells than the columns"
                error = LogError(message, where=where, found=f"{len(cells)} cells", expected=f"{width}")
                cut = len(cells) < width and not set(bad) - {len(cells) - 1}
                return Fault(error, line, before if cut else None)
            name = dialect.names[bad[0]] if dialect.header else f"number {bad[0] + 1}"
            message = f"the cell in column {name!r} is not a number"
            error = LogError(message, where=where, found=repr(cells[bad[0]].strip()[:60]))
            return Fault(error, line, before if bad == [width - 1] else None)
    except csv.Error as error:
        return Fault(LogError(f"cannot be cut into cells: {error}", where=str(path)), 0, None)
    return None


def _fine(cell: str, index: int, dialect: Dialect, may_be_empty: set[int], time: int | None) -> bool:
    if cell in NULLS and index in may_be_empty:
        return True
    return is_number(cell, dialect.decimal) or (index == time and is_iso(cell))


def _whole_lines(path: Path, dialect: Dialect) -> int | None:
    """Bytes of text up to the end of its last whole line, or None when nothing follows it (or it cannot be told)."""
    if dialect.encoding == "utf-16":
        return None
    whole = total = 0
    with open_bytes(path) as stream:
        while piece := stream.read(_PIECE):
            found = piece.rfind(b"\n")
            whole = total + found + 1 if found >= 0 else whole
            total += len(piece)
    return whole if whole < total else None
