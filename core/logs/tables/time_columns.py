"""Which column of a table is its time, by its name; whole seconds and their nanoseconds may be two columns."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

import numpy as np

from collaudit.core.logs.storage.table_reader import numbers_of
from collaudit.core.logs.tables.column_patterns import bare
from collaudit.core.logs.tables.table_stamps import UNIT_OF_WORD
from collaudit.core.numeric.arrays import FloatArray

#: Common names, the usual first, compared without case, blanks and units.
_NAMES = ("t", "time", "timestamp", "time_s", "t_s", "stamp", "time_sec", "secs", "seconds", "time_stamp",
          "timestamp_s", "rosbagtimestamp", "%time", "time_ms", "time_us", "time_ns", "timestamp_ns", "timestamp_ms",
          "timestamp_us", "sim_time", "elapsed", "elapsed_s", "datetime", "__time", "state.time",
          "field.header.stamp", "header.stamp", "ts", "zeit", "times", "timestamps")  # fmt: skip
#: Words that such a name may end in, before its unit.
_WORDS = frozenset({"t", "time", "timestamp", "stamp", "elapsed", "rosbagtimestamp"})
#: Words in front of them that say nothing; ``x`` is what MATLAB puts before a name that begins with no letter.
_FRONT = frozenset({"x", "field", "header", "state", "robot", "sim", "ros", "log", "record", "recv", "receive", "time"})
_SECONDS = frozenset({"s", "sec", "secs", "second", "seconds"})
#: Words of the rest of a second, and its nanoseconds.
_REST = dict.fromkeys(("ns", "nsec", "nsecs", "nanosec", "nanosecs", "nanosecond", "nanoseconds"), 1)
_REST |= dict.fromkeys(("us", "usec", "usecs", "microsec", "microsecond", "microseconds"), 1000)
#: Group of the column of the rest of a second beside the time column.
FRACTION = "rest of a second"
_NS = 1_000_000_000


def guess_time(names: Sequence[str]) -> int | None:
    """Index of the column that is named like a time, or None.

    A common name comes first, then a word for time with any unit behind it, then the seconds of a split stamp.
    """
    plain = [bare(name).lower().replace(" ", "_") for name in names]
    for wanted in _NAMES:
        if wanted in plain:
            return plain.index(wanted)
    tails = [k for k, name in enumerate(plain) if re.split(r"[./]", name)[-1] in _NAMES]
    if len(tails) == 1:  # a field of a struct, or of a message
        return tails[0]
    words = [_words(name) if not re.search(r"\d", name) else [] for name in names]
    for index, parts in enumerate(words):
        rest = parts[:-1] if len(parts) > 1 and parts[-1] in UNIT_OF_WORD else parts
        if rest and rest[-1] in _WORDS and set(rest[:-1]) <= _FRONT:
            return index
    stamps = (
        k for k, parts in enumerate(words) if parts and parts[-1] in _SECONDS and fraction_of(names, k) is not None
    )
    return next(stamps, None)


def fraction_of(names: Sequence[str], time: int) -> int | None:
    """Index of the column of nano- or microseconds that goes with one of whole seconds, by the rest of its name."""
    front = _words(names[time])
    if not front or front[-1] not in _SECONDS:
        return None
    for index, name in enumerate(names):
        words = _words(name)
        if words and words[-1] in _REST and words[:-1] == front[:-1]:
            return index
    return None


def joined_stamps(stamps: Any, fraction: FloatArray, name: str) -> Any | None:
    """Stamps in ns from whole seconds and the rest of each; None where the two columns are no split stamp.

    Args:
        stamps: the seconds, an Arrow array.
        fraction: (n, 1) the nano- or microseconds, less than a second; rows where either is missing become null.
        name: of its column.
    """
    import pyarrow as pa

    if pa.types.is_timestamp(stamps.type):
        return None
    whole = stamps.combine_chunks() if isinstance(stamps, pa.ChunkedArray) else stamps
    seconds, rest = numbers_of(whole), fraction[:, 0] * _REST[_words(name)[-1]]
    known = np.isfinite(seconds) & np.isfinite(rest)
    if not known.any() or bool((seconds[known] % 1 != 0).any()) or bool(((rest < 0) | (rest >= _NS))[known].any()):
        return None
    with np.errstate(invalid="ignore"):
        both = np.where(known, seconds, 0).astype(np.int64) * _NS + np.where(known, rest, 0).astype(np.int64)
    return pa.array(both, mask=~known)


def _words(name: str) -> list[str]:
    return [word for word in re.split(r"[^a-zµμ]+", bare(name).lower()) if word]
