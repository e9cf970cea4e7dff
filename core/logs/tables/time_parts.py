"""Which columns of a table make its time together, by their first cells: a date and a time, or a split second."""

from __future__ import annotations

import re
from itertools import pairwise

from collaudit.core.logs.csv.csv_text import is_time_of_day
from collaudit.core.logs.storage.table_reader import TableReader
from collaudit.core.logs.tables.time_columns import words_of_time

_DATE = re.compile(r"\d{4}-\d{1,2}-\d{1,2}|\d{1,2}\.\d{1,2}\.\d{4}")
_MILLISECONDS = frozenset({"ms", "msec", "msecs", "millis", "millisecond", "milliseconds"})
#: Whole seconds since the epoch, in our time.
_EPOCH_S = range(10**8, 10**10)
_NS = 10**9


def time_parts(reader: TableReader, time: int | None) -> list[str | int]:
    """The columns, as the configuration states them; empty where no columns are seen to be such parts.

    Args:
        reader: the table.
        time: the column that its name says is the time, which must be one of them; None without.
    """
    cells = {k: cells for k in range(len(reader.names)) if (cells := [c for c in reader.first_cells(k) if c])}
    found = _dated(reader.names, cells) or _split(cells)
    if time is not None and time not in found:
        return []
    return [reader.names[k] if reader.named else k + 1 for k in found]


def _dated(names: tuple[str, ...], cells: dict[int, list[str]]) -> list[int]:
    """A date, a time of day, and milliseconds where the time of day has none."""
    date = next((k for k, held in cells.items() if all(map(_DATE.fullmatch, held))), None)
    clock = next((k for k, held in cells.items() if all(is_time_of_day(c.replace(",", ".")) for c in held)), None)
    if date is None or clock is None:
        return []
    whole = all(cell.isalnum() for cell in (held.rpartition(":")[2] for held in cells[clock]))
    rest = [k for k in cells if whole and not _MILLISECONDS.isdisjoint(words_of_time(names[k])[-1:])]
    return [date, clock, *rest[:1]]


def _split(cells: dict[int, list[str]]) -> list[int]:
    """Whole seconds that stand or go on by one, and beside them what is less than a second in ns and grows within."""
    whole = {k: [int(cell) for cell in held] for k, held in cells.items() if all(map(str.isdecimal, held))}
    for first, seconds in whole.items():
        rest = whole.get(first + 1)
        if rest is None or len(rest) != len(seconds) or not all(s in _EPOCH_S for s in seconds):
            continue
        steps = [b - a for a, b in pairwise(s * _NS + r for s, r in zip(seconds, rest, strict=True))]
        if 10**6 <= max(rest) < _NS and steps and min(steps) > 0 and max(steps) < _NS:
            return [first, first + 1]
    return []
