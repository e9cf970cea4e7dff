"""The first cell or row of a table that is not what it should be, found line by line."""

from __future__ import annotations

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
        cut: whether it is the file's last line, not ended, and only its end is wrong: the file was cut inside it.
    """

    error: LogError
    line: int
    cut: bool


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
                return Fault(error, line, last and len(cells) < width and not set(bad) - {len(cells) - 1})
            name = dialect.names[bad[0]] if dialect.header else f"number {bad[0] + 1}"
            message = f"the cell in column {name!r} is not a number"
            error = LogError(message, where=where, found=repr(cells[bad[0]].strip()[:60]))
            return Fault(error, line, last and bad == [width - 1])
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
