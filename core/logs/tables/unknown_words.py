"""Numbered columns whose names hold one word that the vocabulary lacks: passed over by name, or rivals of the taken."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

from collaudit.core.logs.signals.numbered_names import MARK, families
from collaudit.core.logs.tables.column_groups import Choice, Group
from collaudit.core.logs.tables.column_vocabulary import meaning_of, words_of
from collaudit.core.vendors.column_words import QUANTITY_WORDS, ROLE_OF, USABLE

_WORD = re.compile(r"[A-Za-z]+")
_QUANTITIES = frozenset(word for words in QUANTITY_WORDS.values() for word in words)


def with_unknown(choices: Mapping[str, Choice], names: Sequence[str]) -> dict[str, Choice]:
    """The choices with what they did not know: passed over, or a question where only that word differs.

    Of ``torque_a_#`` and ``torque_b_#`` the vocabulary may know a letter and not the other; that decides nothing.

    Args:
        choices: by quantity.
        names: columns that are no signal; "" for those that are.
    """
    groups = list(_groups(names))
    out = {}
    for quantity, choice in choices.items():
        taken = choice.taken
        own = [g for g in groups if g.meaning.quantity == quantity and taken and len(g.columns) == len(taken.columns)]
        rivals = tuple(group for group in own if taken is not None and _rival(taken.pattern, group.pattern))
        passed = (*choice.passed, *(group for group in own if group not in rivals))
        if rivals and taken is not None:
            out[quantity] = Choice(None, passed, (taken, *rivals))
        else:
            out[quantity] = replace(choice, passed=passed)
    return out


def word_dropped(stem: str) -> Iterator[tuple[str, Group]]:
    """Each word without which a stem is a known measurement, and the group that it would be, without columns."""
    if meaning_of(stem) is not None:
        return
    for hit in _WORD.finditer(stem):
        meaning = meaning_of(stem[: hit.start()] + stem[hit.end() :])
        if meaning is not None and meaning.role in USABLE:
            yield hit.group(), Group(stem, (), replace(meaning, role="unknown word"))


def _groups(names: Sequence[str]) -> Iterator[Group]:
    for family in families(names):
        found = next(word_dropped(family.stem), None)
        if found is not None and family.counts:
            yield replace(found[1], pattern=family.pattern, columns=family.places)


def _rival(taken: str, other: str) -> bool:
    """Whether two patterns differ in one word that says nothing of the taken one."""
    ours, theirs = (words_of(re.sub(r"\{i0?\}", MARK, pattern)) for pattern in (taken, other))
    apart = [k for k, (a, b) in enumerate(zip(ours, theirs, strict=False)) if a != b]
    if len(ours) != len(theirs) or len(apart) != 1:
        return False
    word = ours[apart[0]].replace(MARK, "")
    return word not in ROLE_OF and word not in _QUANTITIES
