"""Why no measured columns of a quantity were recognised, where their names show it: the cause and the line to add."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence

from collaudit.core.errors import LogError
from collaudit.core.logs.signals.joint_naming import listed
from collaudit.core.logs.signals.numbered_names import MARK, Family, families
from collaudit.core.logs.tables.column_groups import Group, numbered_groups
from collaudit.core.logs.tables.column_patterns import without_unit
from collaudit.core.logs.tables.column_vocabulary import meaning_of
from collaudit.core.logs.tables.unknown_words import word_dropped
from collaudit.core.vendors.column_words import CONVERTED, QUANTITY_WORDS, USABLE

_FEWEST = 2


def column_fault(names: Sequence[str], quantity: str, where: str, known: Mapping[str, str]) -> LogError | None:
    """The error that says why a quantity has no columns; None where the names show no reason.

    Args:
        names: the columns; "" for those that are taken.
        quantity: position or effort.
        where: the file, for the message.
        known: quantity to pattern of what was recognised, which a stated line switches off and must be stated, too.
    """
    bare = [without_unit(name) for name in names]
    return (
        _broken_numbers(names, bare, quantity, where, known)
        or _several_arms(names, quantity, where)
        or _not_measured(bare, quantity, where, known)
    )


def not_measured(names: Sequence[str]) -> list[Group]:
    """Numbered columns that the vocabulary knows and that are not measured, or in units that are not converted."""
    groups = numbered_groups([without_unit(name) for name in names])
    return [g for g in groups if g.meaning.role not in USABLE or g.meaning.unit not in CONVERTED]


def _broken_numbers(
    names: Sequence[str], bare: Sequence[str], quantity: str, where: str, known: Mapping[str, str]
) -> LogError | None:
    """Numbered columns with a number twice, with one missing, or that begin with another than 0 or 1."""
    several = [family for family in families(bare) if len(family.places) >= _FEWEST]
    measured = [(family, meaning) for family in several if (meaning := meaning_of(family.stem)) is not None]
    measured = [(family, meaning.quantity) for family, meaning in measured if meaning.role in USABLE]
    for family, measures in measured:
        if measures != quantity or family.counts:
            continue
        numbers = family.numbers
        own = listed([names[place] for place in family.places], 40)
        twice = sorted({number for number in numbers if numbers.count(number) > 1})
        if twice:
            name = family.stem.replace(MARK, str(twice[0]))
            return LogError(
                f"two columns are called {name}, so that the columns of the {quantity} cannot be told apart",
                where=where,
                found=own,
                hint="give them different names in the table; or name the columns by their numbers in the file, from "
                f"1: [log.csv] {_lines(measured, lambda place: place + 1, known)}",
            )
        lacking = [number for number in range(min(numbers[0], 1), numbers[-1] + 1) if number not in numbers]
        gone = listed([family.stem.replace(MARK, str(number)) for number in lacking])
        return LogError(
            f"the {quantity} columns are numbered and {gone} {'is' if len(lacking) == 1 else 'are'} missing",
            where=where,
            found=own,
            expected="numbers that follow each other, from 0 or 1",
            hint="add the missing column; or if these are all joints, name as many of each quantity: [log.csv] "
            f"{_lines(measured, lambda place: names[place], known)}, and which of the robot's joints they are by "
            "[log] joint_names",
        )
    return None


def _lines(measured: Sequence[tuple[Family, str]], value: Callable[[int], str | int], known: Mapping[str, str]) -> str:
    """Lines that name every column, and those of the quantities that were recognised."""
    lines = {quantity: f'{quantity} = "{pattern}"' for quantity, pattern in known.items()}
    for family, quantity in measured:
        columns = json.dumps([value(place) for place in family.places], ensure_ascii=False)
        lines.setdefault(quantity, f"{quantity} = {columns}")
    return "; ".join(lines[quantity] for quantity in QUANTITY_WORDS if quantity in lines)


def sides_of(names: Sequence[str], quantity: str = "position") -> dict[str, dict[str, str]]:
    """Numbered columns with a word more than the quantity's, such as an arm's side: word to quantity to pattern."""
    bare = [without_unit(name) for name in names]
    sides: dict[str, dict[str, str]] = {}
    for family in sorted(families(bare), key=lambda family: family.stem):
        for word, group in word_dropped(family.stem):
            sides.setdefault(word, {}).setdefault(group.meaning.quantity, family.pattern)
    return {word: patterns for word, patterns in sides.items() if quantity in patterns}


def _several_arms(names: Sequence[str], quantity: str, where: str) -> LogError | None:
    sides = sides_of(names, quantity)
    if not sides:
        return None
    lines = ["; ".join(f'{key} = "{each[key]}"' for key in QUANTITY_WORDS if key in each) for each in sides.values()]
    several = len(sides) > 1
    return LogError(
        f"the {quantity} columns are of several arms or sides: {', '.join(sides)}"
        if several
        else f"the {quantity} columns have a word in their names that is not known: {next(iter(sides))}",
        where=where,
        found=", ".join(patterns[quantity] for patterns in sides.values()),
        hint=("one configuration an arm, " if several else "if they are measured, say so, ")
        + ", or ".join(f"[log.csv] {line}" for line in lines),
    )


def _not_measured(bare: Sequence[str], quantity: str, where: str, known: Mapping[str, str]) -> LogError | None:
    """Columns of the quantity, all of them desired, commanded, modelled or in a unit that is not converted."""
    groups = not_measured(bare)
    own = [group for group in groups if group.meaning.quantity == quantity]
    if not own:
        return None
    lines = {group.meaning.quantity: group.pattern for group in reversed(groups)} | dict(known)
    stated = "; ".join(f'{key} = "{lines[key]}"' for key in QUANTITY_WORDS if key in lines)
    return LogError(
        f"no column of a measured {quantity} was recognised",
        where=where,
        found=", ".join(group.said for group in own),
        expected=f"one column of measured {quantity} per joint",
        hint="record what was measured; or, if these are measured although their names say otherwise: [log.csv] "
        f"{stated}",
    )
