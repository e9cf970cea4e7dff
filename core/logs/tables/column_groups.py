"""Numbered columns: which belong together, what they are, and which of several are the measured ones."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

from collaudit.core.logs.signals.numbered_names import families
from collaudit.core.logs.tables.column_vocabulary import meaning_of
from collaudit.core.vendors.column_words import (
    CONVERTED,
    CURRENTS,
    DOOSAN,
    DOOSAN_ONLY,
    QUANTITY_WORDS,
    USABLE,
    Meaning,
)


@dataclass(frozen=True, slots=True)
class Group:
    """Columns that differ in one number, which counts from 0 or 1.

    Attributes:
        pattern: the name with ``{i}`` or ``{i0}`` for the number.
        columns: their indices, in the order of the number.
        meaning: what they are.
    """

    pattern: str
    columns: tuple[int, ...]
    meaning: Meaning

    @property
    def said(self) -> str:
        """The pattern with what speaks against it, or for it."""
        unit = f" in {self.meaning.unit}" if self.meaning.unit not in CONVERTED else ""
        return f"{self.pattern} ({self.meaning.role}{unit})"


@dataclass(frozen=True, slots=True)
class Choice:
    """The group taken for a quantity, or those between which the names do not decide.

    Attributes:
        taken: None where there is none, or several.
        passed: further groups of the quantity, not taken.
        open: two or more groups that are equally likely, or positions of the motors' side alone, which may lie before
            the gear; empty when decided.
    """

    taken: Group | None
    passed: tuple[Group, ...]
    open: tuple[Group, ...] = ()


def numbered_groups(names: Sequence[str]) -> list[Group]:
    """Groups of numbered columns that the vocabulary knows, measured or not.

    Args:
        names: column names without units in brackets; "" for columns that are taken.
    """
    known = [(family, meaning_of(family.stem)) for family in families(names) if family.counts]
    return _as_doosan([Group(each.pattern, each.places, meaning) for each, meaning in known if meaning is not None])


def _as_doosan(groups: list[Group]) -> list[Group]:
    """Doosan's real-time state, told by columns that only it has beside ``actual_joint_position``."""
    letters = [re.sub(r"\{\w+\}|[^a-z{}]", "", group.pattern.lower()) for group in groups]
    if "actualjointposition" not in letters or not DOOSAN_ONLY.intersection(letters):
        return groups
    pairs = zip(letters, groups, strict=True)
    return [replace(group, meaning=replace(group.meaning, **DOOSAN.get(name, {}))) for name, group in pairs]


def choose(groups: Sequence[Group], quantity: str, joints: int | None = None) -> Choice:
    """The measured columns among those of one quantity.

    Args:
        groups: of :func:`numbered_groups`.
        quantity: which.
        joints: how many columns the positions have; groups with as many are preferred.
    """
    own = [group for group in groups if group.meaning.quantity == quantity]
    usable = [group for group in own if group.meaning.role in USABLE and group.meaning.unit in CONVERTED]
    if joints is not None and any(len(group.columns) == joints for group in usable):
        usable = [group for group in usable if len(group.columns) == joints]
    if not usable:
        return Choice(None, tuple(own))
    rank = min(USABLE.index(group.meaning.role) for group in usable)
    best = [group for group in usable if USABLE.index(group.meaning.role) == rank]
    torques = [group for group in best if group.meaning.word not in CURRENTS]
    best = torques or best
    most = max(len(group.columns) for group in best)
    best = [group for group in best if len(group.columns) == most]
    first = min(best, key=lambda group: _order(group.meaning))
    doubtful = [group for group in best if quantity == "effort" or group.meaning.word == first.meaning.word]
    if len(doubtful) > 1:
        return Choice(None, tuple(group for group in own if group not in doubtful), tuple(doubtful))
    rest = tuple(group for group in own if group is not first)
    asked = quantity == "position" and first.meaning.motor
    return Choice(None, rest, (first,)) if asked else Choice(first, rest)


def _order(meaning: Meaning) -> int:
    words = QUANTITY_WORDS[meaning.quantity]
    return words.index(meaning.word) if meaning.word in words else -1
