"""Stamps made of several columns, a date and a time or a split second: which columns these are, and what they say.

Counters that wrapped go on.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

from collaudit.core.errors import LogError
from collaudit.core.logs.csv.csv_text import is_time_of_day
from collaudit.core.logs.storage.table_reader import TableReader, arrow_of, integers_of, numbers_of
from collaudit.core.logs.tables.time_columns import NS, REST, words_of_time
from collaudit.core.numeric.arrays import FloatArray

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


#: What is shown where parts are no stamp.
_EXPECTED = "whole seconds and nanoseconds; or a date (2026-11-24, 24.11.2026), a time (08:53:20.123) and milliseconds"
_WITH_DOTS = r"^\s*(\d{1,2})\.(\d{1,2})\.(\d{4})\s*$"
_DAY_NS = 86_400 * NS
#: A counter that wrapped goes on within so many of its usual steps.
_GOES_ON = 100


def joined_stamps(stamps: Any, fraction: FloatArray, name: str) -> Any | None:
    """Stamps in ns from whole seconds and the rest of each; None where the two columns are no split stamp.

    Args:
        stamps: the seconds, an Arrow array.
        fraction: (n, 1) the nano- or microseconds, less than a second; rows where either is missing become null.
        name: of its column, which says which; nanoseconds where it does not.
    """
    if pa.types.is_timestamp(stamps.type) or pa.types.is_time(stamps.type):
        return None
    whole = stamps.combine_chunks() if isinstance(stamps, pa.ChunkedArray) else stamps
    words = words_of_time(name)
    seconds, rest = numbers_of(whole), fraction[:, 0] * REST.get(words[-1] if words else "", 1)
    known = np.isfinite(seconds) & np.isfinite(rest)
    if not known.any() or bool((seconds[known] % 1 != 0).any()) or bool(((rest < 0) | (rest >= NS))[known].any()):
        return None
    with np.errstate(invalid="ignore"):
        both = np.where(known, seconds, 0).astype(np.int64) * NS + np.where(known, rest, 0).astype(np.int64)
    return arrow_of(both, known)


def dated_stamps(parts: Sequence[Sequence[str]], where: str) -> Any:
    """Stamps from columns of dates and times of day, and of milliseconds where there are three.

    Args:
        parts: n texts of each; the date comes first or second.
        where: the file and the key, for messages.

    Raises:
        LogError: they are none.
    """
    texts = [pc.utf8_trim_whitespace(pa.array(words, pa.string())) for words in parts]
    date, time = texts[:2] if ":" in (texts[1][0].as_py() or "") else texts[1::-1]
    date = pc.replace_substring_regex(date, _WITH_DOTS, r"\3-\2-\1")
    for end in ("-", "$"):  # two digits of month and day
        date = pc.replace_substring_regex(date, rf"-(\d)({end})", r"-0\1\2")
    time = pc.replace_substring_regex(pc.replace_substring(time, ",", "."), r"^(\d):", r"0\1:")
    if len(texts) == 3:
        time = pc.binary_join_element_wise(time, pc.utf8_lpad(texts[2], 3, "0"), ".")
    try:
        return pc.binary_join_element_wise(date, time, " ").cast(pa.timestamp("ns"))
    except pa.ArrowInvalid as error:
        found = " and ".join(repr(text[0].as_py()) for text in texts)
        raise LogError("the columns make no time together", where=where, found=found, expected=_EXPECTED) from error


def unwrapped(stamps: Any) -> tuple[Any, str | None]:
    """Stamps that go on where a counter of 32 bits, or a time of day, began again; and what is to be said of it.

    Args:
        stamps: the time column, an Arrow array.
    """
    time_of_day = pa.types.is_time(stamps.type)
    if not (time_of_day or pa.types.is_integer(stamps.type)) or stamps.null_count or len(stamps) < 2:
        return stamps, None
    whole = stamps.combine_chunks() if isinstance(stamps, pa.ChunkedArray) else stamps
    values = integers_of(whole.cast(pa.time64("ns")) if time_of_day else whole)
    modulus = _DAY_NS if time_of_day else 1 << 32
    steps = np.diff(values)
    if steps.min() > -modulus // 2 or (not time_of_day and int(values.max()) - int(values.min()) >= modulus):
        return stamps, None
    usual = max(float(np.median(np.abs(steps))), 1.0)
    wraps = (steps + modulus > 0) & (steps + modulus <= _GOES_ON * usual)
    if not wraps.any():
        return stamps, None
    values = values + modulus * np.concatenate([[0], np.cumsum(wraps)])
    count = int(np.count_nonzero(wraps))
    if time_of_day:
        said = f"The time of day passed midnight {count} times: time goes on."
        return arrow_of(values).cast(pa.timestamp("ns")), said
    return arrow_of(values), f"The time column wrapped at 2^32 {count} times: 2^32 was added to what follows."
