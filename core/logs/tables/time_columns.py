"""The time column of a table: which it is by its name, its unit, and its stamps as seconds.

A date and a time, or whole seconds and the rest of each, may be columns of their own. The unit is stated, told by the
name, by the size of the numbers, or by what the joints do meanwhile.
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
from collaudit.core.logs.signals.joint_naming import listed
from collaudit.core.logs.signals.sample_clock import garbage_stamps
from collaudit.core.logs.signals.signal_names import bare
from collaudit.core.logs.storage.readers import TableReader, arrow_of, integers_of, numbers_of
from collaudit.core.logs.tables.csv_text import is_time_of_day
from collaudit.core.numeric.arrays import BoolArray, FloatArray

#: Words that the name of a time ends in before its unit, the usual first.
_WORDS = ("t", "time", "timestamp", "stamp", "rosbagtimestamp", "elapsed", "datetime", "ts", "zeit", "times",
          "timestamps", "secs", "seconds")  # fmt: skip
#: Words in front of them that say nothing; ``x`` is what MATLAB puts before a name that begins with no letter.
_FRONT = frozenset({"x", "field", "header", "state", "robot", "sim", "ros", "log", "record", "recv", "receive", "time"})
#: Words of the rest of a second, and its nanoseconds.
REST = dict.fromkeys(("ns", "nsec", "nsecs", "nanosec", "nanosecs", "nanosecond", "nanoseconds", "nanos"), 1)
REST |= dict.fromkeys(("us", "usec", "usecs", "microsec", "microsecond", "microseconds", "micros"), 1000)
#: Group of the column of the rest of a second beside the time column.
FRACTION = "rest of a second"
NS = 1_000_000_000
#: Units of a stamp in a second.
SCALES = {"s": 1.0, "ms": 1e3, "us": 1e6, "ns": 1e9}

#: Last words of a time column's name, and the unit they state.
UNIT_OF_WORD = {
    word: unit
    for unit, words in {
        "s": "s sec secs second seconds",
        "ms": "ms msec msecs millis millisecond milliseconds",
        "us": "us µs μs usec usecs micros microsecond microseconds",
        "ns": "ns nsec nsecs nanos nanosecond nanoseconds",
    }.items()
    for word in words.split()
}

#: Later stamps are no times since the epoch, but garbage.
_MOST_NS = 9e18


def guess_time(names: Sequence[str]) -> int | None:
    """Index of the column that is named like a time, or None.

    By the usual word first, and those with no other in front; then the one field of a struct or a message that is
    named so, then the seconds of a split stamp.
    """
    named = [(len(words) > 1, _WORDS.index(words[-1]), k) for k, name in enumerate(names) if (words := _of_time(name))]
    if named:
        return min(named)[-1]
    fields = [k for k, name in enumerate(names) if _of_time(re.split(r"[./]", bare(name))[-1])]
    if len(fields) == 1:
        return fields[0]
    return next((k for k, name in enumerate(names) if name and fraction_of(names, k) is not None), None)


def _of_time(name: str) -> list[str]:
    """The words of a time's name without its unit; none where it is no time's."""
    words = words_of_time(name) if not re.search(r"\d", name) else []
    words = words[:-1] if len(words) > 1 and words[-1] in UNIT_OF_WORD else words
    return words if words and words[-1] in _WORDS and {*words[:-1]} <= _FRONT else []


def fraction_of(names: Sequence[str], time: int) -> int | None:
    """Index of the column of nano- or microseconds that goes with one of whole seconds, by the rest of its name."""
    front = words_of_time(names[time])
    if not front or UNIT_OF_WORD.get(front[-1]) != "s":
        return None
    for index, name in enumerate(names):
        words = words_of_time(name)
        if words and words[-1] in REST and words[:-1] == front[:-1]:
            return index
    return None


def words_of_time(name: str) -> list[str]:
    """The words of a column's name, in lower case, without its unit."""
    return [word for word in re.split(r"[^a-zµμ]+", bare(name).lower()) if word]


def seconds_of(stamps: Any, unit: str) -> tuple[FloatArray, int | None, str]:
    """Seconds from the first stamp that is a time, its absolute time in ns, None without, and the unit used.

    Stamps that are no numbers become NaN, those that are no times of this recording infinite.

    Args:
        stamps: the time column as Arrow read it.
        unit: ``auto``, ``s``, ``ms``, ``us``, ``ns`` or ``iso``.
    """
    iso = pa.types.is_timestamp(stamps.type) or pa.types.is_time(stamps.type)
    if iso:
        stamps, unit = stamps.cast(pa.int64()), "ns"
    numbers = numbers_of(stamps)
    scale, guessed, garbage = _scale(numbers, unit)
    used = "iso" if iso else guessed
    known = np.flatnonzero(np.isfinite(numbers) & ~garbage)
    if not known.size:
        return np.full(numbers.shape, np.nan), None, used
    time_s, start = _seconds(stamps, numbers, int(known[0]), scale)
    if known.size < numbers.size:
        time_s = np.where(garbage, np.inf, np.where(np.isfinite(numbers), time_s, np.nan))
    return time_s, start, used


def named_unit(name: str) -> str | None:
    """The unit that the name of a time column ends in, such as ``time_ms`` or ``t [ns]``; None without."""
    words = [word for word in re.split(r"[^a-zµμ]+", name.strip().lower()) if word]
    return UNIT_OF_WORD.get(words[-1]) if len(words) > 1 else None


def _scale(numbers: FloatArray, unit: str) -> tuple[float, str, BoolArray]:
    """Units in a second, their name, and (n,) stamps that are no times of this recording, which have no say."""
    sizes, guessed = np.abs(numbers[np.isfinite(numbers)]), unit in ("auto", "iso")
    used = guess_time_unit(float(np.median(sizes)) if sizes.size else 0.0) if guessed else unit
    with np.errstate(over="ignore"):
        garbage = garbage_stamps(numbers if SCALES[used] == 1.0 else numbers / SCALES[used])
    if guessed:
        rest = np.abs(numbers[np.isfinite(numbers) & ~garbage]) if garbage.any() else sizes
        used = guess_time_unit(float(rest.max()) if rest.size else 0.0)
    return SCALES[used], used, garbage


def _seconds(stamps: Any, numbers: FloatArray, first: int, scale: float) -> tuple[FloatArray, int | None]:
    """Seconds from stamp number ``first``, and its absolute time in ns; integers and decimals lose nothing."""

    kind, zero = stamps.type, stamps[first].as_py()
    exact = abs(float(zero)) * 1e9 / scale < _MOST_NS
    start = None if not exact else round(float(zero) * 1e9 / scale) if scale != 1e9 else int(zero)
    if stamps.null_count or pa.types.is_floating(kind):
        return (numbers - numbers[first]) / scale, start
    whole = stamps.cast(pa.int64(), safe=False) if pa.types.is_integer(kind) else stamps
    return numbers_of(pc.subtract(whole, whole[first])) / scale, start


def guess_time_unit(size: float) -> str:
    """The unit of stamps as large as ``size``, taken as seconds since the epoch or as a short time in seconds."""
    for unit, floor in (("ns", 1e17), ("us", 1e14), ("ms", 1e11)):
        if size >= floor:
            return unit
    return "s"


_DATE = re.compile(r"\d{4}-\d{1,2}-\d{1,2}|\d{1,2}\.\d{1,2}\.\d{4}")
_MILLISECONDS = frozenset({"ms", "msec", "msecs", "millis", "millisecond", "milliseconds"})
#: Whole seconds since the epoch, in our time.
_EPOCH_S = range(10**8, 10**10)
_NS = 10**9


def time_parts(reader: TableReader, time: Sequence[int] = ()) -> list[str | int]:
    """The columns, as the configuration states them; empty where no columns are seen to be such parts.

    Args:
        reader: the table.
        time: the columns that their names say are the time, which must be among them.
    """
    cells = {k: cells for k in range(len(reader.names)) if (cells := [c for c in reader.first_cells(k) if c])}
    found = _dated(reader.names, cells) or _split(cells)
    if not {*time} <= {*found}:
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


def joined_stamps(stamps: Any, fraction: FloatArray, names: Sequence[str], where: str) -> Any:
    """Stamps in ns from whole seconds and the rest of each.

    Args:
        stamps: the seconds, an Arrow array.
        fraction: (n, 1) the nano- or microseconds, less than a second; rows where either is missing become null.
        names: of both columns; the second says which it holds, nanoseconds where it does not.
        where: the file and the key, for messages.

    Raises:
        LogError: they are no split stamp.
    """
    words = words_of_time(names[1])
    seconds, rest = numbers_of(stamps), fraction[:, 0] * REST.get(words[-1] if words else "", 1)
    known = np.isfinite(seconds) & np.isfinite(rest)
    if not known.any() or bool((seconds[known] % 1 != 0).any()) or bool(((rest < 0) | (rest >= NS))[known].any()):
        raise LogError(
            f"the columns {listed(names)} are no whole seconds and the rest of each",
            where=where,
            expected="whole seconds, then nanoseconds below 1000000000; or the one column that holds the time",
        )
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
    values = integers_of(stamps.cast(pa.time64("ns")) if time_of_day else stamps)
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
