"""Which column of a CSV is which signal of which joint: by the configuration's patterns, or by common names."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import TYPE_CHECKING

from collaudit.core.errors import LogError
from collaudit.core.logs.signals.joint_naming import listed

if TYPE_CHECKING:
    from collaudit.core.config.config_table import ColumnPattern
    from collaudit.core.config.schema import CsvConfig

MOTION = ("position", "velocity", "effort")
QUANTITIES = (*MOTION, "temperature")
_UNIT = re.compile(r"\s*[\[(]\s*([^\])]*?)\s*[\])]\s*$")

#: Common names of the time column, compared without case, blanks and units.
TIME_NAMES = ("t", "time", "timestamp", "time_s", "t_s", "stamp", "time_sec", "secs", "seconds", "time_stamp",
              "timestamp_s", "rosbagtimestamp", "%time", "time_ms", "time_us", "time_ns", "timestamp_ns",
              "timestamp_ms", "timestamp_us", "sim_time", "elapsed", "elapsed_s", "datetime")  # fmt: skip
_POSITION = ("position", "pos", "q", "angle", "theta", "actual_q", "joint_position", "jpos", "q_act", "positions")
_VELOCITY = ("velocity", "vel", "dq", "qd", "speed", "qdot", "actual_qd", "joint_velocity", "jvel", "dq_act",
             "omega", "velocities")  # fmt: skip
_EFFORT = ("effort", "eff", "tau", "torque", "current", "actual_current", "joint_torque", "joint_effort", "moment",
           "tau_j", "i_act", "actual_torque", "efforts")  # fmt: skip
_TEMPERATURE = ("temperature", "temp", "joint_temperature", "motor_temperature", "temperatures")
_WORDS = {"position": _POSITION, "velocity": _VELOCITY, "effort": _EFFORT, "temperature": _TEMPERATURE}
#: Words that say the numbers are currents.
CURRENT_WORDS = ("current", "actual_current", "i_act")


_NUMBERED_FORMS = ("{word}{i}", "{word}_{i}", "{word}[{i}]", "{word}.{i}", "{word}_j{i}", "{word}_joint{i}",
                   "{word}_joint_{i}", "joint{i}_{word}", "joint_{i}_{word}", "j{i}_{word}", "{word}_a{i}",
                   "a{i}_{word}", "axis{i}_{word}")  # fmt: skip
_NAMED_FORMS = ("{joint}_{word}", "{word}_{joint}", "{joint}.{word}", "{word}.{joint}", "{joint}/{word}",
                "{joint} {word}", "{word} {joint}", "{word}/{joint}")  # fmt: skip


def _guesses(word: str) -> tuple[str, ...]:
    """Patterns made of a word; the numbered ones first, because they are the narrower."""
    numbered = tuple(form.format(word=word, i=i) for i in ("{i}", "{i0}") for form in _NUMBERED_FORMS)
    named = tuple(form.format(word=word, joint="{joint}") for form in _NAMED_FORMS)
    return numbered + named


@dataclass(frozen=True, slots=True)
class Found:
    """Columns of one quantity.

    Attributes:
        joints: joint name of each column; "" where the configuration gives columns without names.
        columns: their indices.
        pattern: the pattern that found them, or "" for names and numbers.
    """

    joints: tuple[str, ...]
    columns: tuple[int, ...]
    pattern: str


@dataclass(frozen=True, slots=True)
class Assignment:
    """The columns of one file.

    Attributes:
        time: index of the time column, or None.
        quantities: quantity to its columns.
        wrench: six column indices, or empty.
        guessed: quantities (and ``time``) recognised by their names.
    """

    time: int | None
    quantities: dict[str, Found]
    wrench: tuple[int, ...]
    guessed: tuple[str, ...] = field(default=())


def bare(name: str) -> str:
    """A column name without a list mark in front and a unit behind."""
    text = name.strip()
    while text[:1] in ("-", "*", "/") and len(text) > 1:
        text = text[1:].lstrip()
    return _UNIT.sub("", text)


def unit_of(name: str) -> str | None:
    """The unit in a column name such as ``q1 [deg]``, or None."""
    match = _UNIT.search(name.strip())
    return match.group(1) if match and not match.group(1).isdigit() else None


@lru_cache(maxsize=4096)
def _regex(pattern: str) -> re.Pattern[str]:
    parts = re.split(r"(\{joint\}|\{i\}|\{i0\})", pattern)
    groups = {"{joint}": "(?P<joint>.+?)", "{i}": r"(?P<i>\d+)", "{i0}": r"(?P<i>\d+)"}
    seen: set[str] = set()
    out = ""
    for part in parts:
        if part in groups and groups[part] not in seen:
            out += groups[part]
            seen.add(groups[part])
        else:
            out += re.escape(part)
    return re.compile(out, re.IGNORECASE)


def match_pattern(names: Sequence[str], pattern: str) -> Found | None:
    """Columns that match a pattern, in the order of their numbers or of the file."""
    regex = _regex(pattern)
    first = 0 if "{i0}" in pattern else 1
    numbered = "{i" in pattern
    hits: list[tuple[int, str, int]] = []
    for index, name in enumerate(names):
        match = regex.fullmatch(name.strip()) or regex.fullmatch(bare(name))
        if match is None:
            continue
        if numbered:
            number = int(match.group("i"))
            if number >= first:
                hits.append((number, f"joint{number - first + 1}", index))
        else:
            hits.append((index, bare(match.group("joint")) if "{joint}" in pattern else "", index))
    if not hits:
        return None
    hits.sort()
    order = [hit[0] for hit in hits]
    if numbered and order != list(range(first, first + len(order))):
        return None
    return Found(tuple(hit[1] for hit in hits), tuple(hit[2] for hit in hits), pattern)


def column_index(names: Sequence[str], key: str | int) -> int | None:
    """Index of a column by its name (as written, or without list mark and unit) or by its number from 1."""
    if isinstance(key, int):
        return key - 1 if 1 <= key <= len(names) else None
    unmarked = key.lstrip("#% ")  # a line of names may stand behind the mark of a comment
    for form in (
        lambda n: n.strip() == key,
        lambda n: bare(n) == key,
        lambda n: bare(n).lower() == key.lower(),
        lambda n: n.strip() == unmarked,
    ):
        hits = [index for index, name in enumerate(names) if form(name)]
        if len(hits) == 1:
            return hits[0]
    return None


def _configured(names: Sequence[str], pattern: ColumnPattern, quantity: str) -> Found | None:
    if isinstance(pattern, str):
        if "{" in pattern:
            return match_pattern(names, pattern)
        pattern = [pattern]
    found = [column_index(names, key) for key in pattern]
    if all(index is None for index in found):
        return None
    missing = [str(key) for key, index in zip(pattern, found, strict=True) if index is None]
    if missing:
        raise LogError(
            f"[log.csv] {quantity} names columns that the file does not have: {listed(missing)}",
            found=listed(names, 40),
        )
    joints = tuple(f"joint{number + 1}" for number in range(len(found)))
    return Found(joints, tuple(index for index in found if index is not None), "")


def _guess_quantity(names: Sequence[str], quantity: str, taken: Iterable[int]) -> Found | None:
    free = [name if index not in set(taken) else "" for index, name in enumerate(names)]
    best: Found | None = None
    text = "\n".join(free).lower()
    for word in _WORDS[quantity]:
        if word not in text:
            continue
        for pattern in _guesses(word):
            found = match_pattern(free, pattern)
            if found is not None and (best is None or len(found.columns) > len(best.columns)):
                best = found
    return best


def guess_time(names: Sequence[str]) -> int | None:
    """Index of the column that is named like a time, or None."""
    for wanted in TIME_NAMES:
        for index, name in enumerate(names):
            if bare(name).lower().replace(" ", "_") == wanted:
                return index
    return None


def assign(names: Sequence[str], settings: CsvConfig, *, header: bool) -> Assignment:
    """Assign a file's columns.

    Args:
        names: column names.
        settings: the configuration's patterns; what it leaves open is recognised by common names.
        header: False for files without names, which are never guessed.

    Raises:
        LogError: the configuration names columns the file does not have.
    """
    quantities: dict[str, Found] = {}
    guessed: list[str] = []
    stated = {quantity: getattr(settings, quantity) for quantity in QUANTITIES}
    for quantity, pattern in stated.items():
        if pattern is not None:
            found = _configured(names, pattern, quantity)
            if found is not None:
                quantities[quantity] = found
    if header and all(pattern is None for pattern in stated.values()):
        time = guess_time(names)
        for quantity in QUANTITIES:
            taken = [c for found in quantities.values() for c in found.columns] + ([time] if time is not None else [])
            found = _guess_quantity(names, quantity, taken)
            if found is not None:
                quantities[quantity] = found
                guessed.append(quantity)
    time = column_index(names, settings.time) if settings.time is not None else None
    if settings.time is None and header:
        time = guess_time(names)
        if time is not None:
            guessed.append("time")
    wrench = [column_index(names, key) for key in settings.wrench or ()]
    six = tuple(index for index in wrench if index is not None)
    return Assignment(time, quantities, six if len(six) == 6 else (), tuple(guessed))
