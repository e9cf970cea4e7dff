"""Which column of a CSV is which signal of which joint: by the configuration's patterns, or by common names."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

from collaudit.core.config.config_table import ColumnPattern
from collaudit.core.config.schema import CsvConfig
from collaudit.core.errors import LogError
from collaudit.core.logs.signals.joint_naming import listed
from collaudit.core.logs.signals.numbered_names import MARK
from collaudit.core.logs.tables.column_groups import Choice, numbered_groups
from collaudit.core.logs.tables.column_patterns import QUANTITIES, Found, column_index, match_pattern, without_unit
from collaudit.core.logs.tables.column_recognition import recognise
from collaudit.core.logs.tables.column_vocabulary import meaning_of, words_of
from collaudit.core.logs.tables.time_columns import fraction_of, guess_time
from collaudit.core.vendors.column_words import UNIT_WORDS

#: Words that say the numbers are currents.
CURRENT_WORDS = ("current", "i_act")


@dataclass(frozen=True, slots=True)
class Assignment:
    """The columns of one file.

    Attributes:
        time: index of the time column, or None.
        fraction: index of the column of nanoseconds where ``time`` holds whole seconds, or None.
        quantities: quantity to its columns.
        wrench: six column indices, or empty.
        guessed: quantities (and ``time``) recognised by their names.
        passed_over: quantity to groups of columns of it that are not taken, each with its role.
        open: quantity to patterns between which the names do not decide.
    """

    time: int | None
    quantities: Mapping[str, Found]
    wrench: tuple[int, ...]
    guessed: tuple[str, ...] = field(default=())
    passed_over: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    open: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    fraction: int | None = None


def _configured(names: Sequence[str], pattern: ColumnPattern, quantity: str) -> Found | None:
    if isinstance(pattern, str):
        if "{" in pattern:
            found = match_pattern(names, pattern)
            return found if found is None else replace(found, unit=_unit_in(names, found))
        pattern = [pattern]
    indices = [column_index(names, key) for key in pattern]
    if all(index is None for index in indices):
        return None
    missing = [str(key) for key, index in zip(pattern, indices, strict=True) if index is None]
    if missing:
        raise LogError(
            f"[log.csv] {quantity} names columns that the file does not have: {listed(missing)}",
            found=listed(names, 40),
        )
    joints = tuple(f"joint{number + 1}" for number in range(len(indices)))
    return Found(joints, tuple(index for index in indices if index is not None), "")


def _unit_in(names: Sequence[str], found: Found) -> str:
    """The unit that a pattern's own words spell, or degrees where their source documents them; "" for none."""
    groups = numbered_groups([without_unit(name) for name in names])
    meaning = next((group.meaning for group in groups if group.columns == found.columns), None)
    meaning = meaning or meaning_of(re.sub(r"\{\w+\}", MARK, found.pattern))
    if meaning is None or meaning.unit in ("deg", "deg/s"):
        return meaning.unit if meaning is not None else ""
    spelt = any(word in UNIT_WORDS for word in words_of(re.sub(r"\{\w+\}", MARK, found.pattern)))
    return meaning.unit if spelt and meaning.unit in UNIT_WORDS.values() else ""


def assign(names: Sequence[str], settings: CsvConfig, *, header: bool) -> Assignment:
    """Assign a file's columns.

    Args:
        names: column names.
        settings: the configuration's patterns; what it leaves open is recognised by common names.
        header: False for files without names, which are never guessed.

    Raises:
        LogError: the configuration names columns the file does not have.
    """
    stated = {quantity: getattr(settings, quantity) for quantity in QUANTITIES}
    quantities: dict[str, Found] = {}
    guessed: list[str] = []
    for quantity, pattern in stated.items():
        if pattern is not None and (found := _configured(names, pattern, quantity)) is not None:
            quantities[quantity] = found
    choices: dict[str, Choice] = {}
    if header and all(pattern is None for pattern in stated.values()):
        quantities, choices = recognise(names, guess_time(names))
        guessed += list(quantities)
    time = column_index(names, settings.time) if settings.time is not None else None
    if settings.time is None and header:
        time = guess_time(names)
        if time is not None:
            guessed.append("time")
    wrench = [column_index(names, key) for key in settings.wrench or ()]
    six = tuple(index for index in wrench if index is not None)
    passed = {q: tuple(group.said for group in choice.passed) for q, choice in choices.items() if choice.passed}
    undecided = {q: tuple(group.pattern for group in choice.open) for q, choice in choices.items() if choice.open}
    return Assignment(
        time,
        quantities,
        six if len(six) == 6 else (),
        tuple(guessed),
        passed,
        undecided,
        fraction_of(names, time) if time is not None and header else None,
    )
