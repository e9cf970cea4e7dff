"""Why no measured columns of a quantity were recognised, where their names show it: the cause and the line to add."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from collaudit.core.errors import LogError
from collaudit.core.logs.signals.joint_naming import listed
from collaudit.core.logs.signals.numbered_names import MARK, Family, families
from collaudit.core.logs.tables.column_groups import is_measured, numbered_groups, word_dropped
from collaudit.core.logs.tables.column_patterns import stated_line, without_unit
from collaudit.core.logs.tables.column_vocabulary import meaning_of
from collaudit.core.vendors.column_words import USABLE

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
    fault = _broken_numbers(names, bare, quantity, known) or _several_arms(names, quantity)
    fault = fault or _not_measured(names, quantity, known)
    if fault is not None:
        fault.where = where
    return fault


def _broken_numbers(
    names: Sequence[str], bare: Sequence[str], quantity: str, known: Mapping[str, str]
) -> LogError | None:
    """Numbered columns with a number twice, with one missing, or that begin with another than 0 or 1."""
    measured: dict[str, list[Family]] = {}
    for family in families(bare):
        meaning = meaning_of(family.stem)
        if meaning is not None and meaning.role in USABLE and len(family.places) >= _FEWEST:
            measured.setdefault(meaning.quantity, []).append(family)
    broken = next((family for family in measured.get(quantity, ()) if not family.counts), None)
    if broken is None:
        return None
    numbers = broken.numbers
    found = listed([names[place] for place in broken.places], 40)
    twice = next((number for number in numbers if numbers.count(number) > 1), None)
    if twice is not None:
        columns = {key: [place + 1 for place in own[0].places] for key, own in measured.items()}
        name = broken.stem.replace(MARK, str(twice))
        return LogError(
            f"two columns are called {name}, so that the columns of the {quantity} cannot be told apart",
            found=found,
            hint="give them different names in the table; or name the columns by their numbers in the file, from 1: "
            + stated_line({**columns, **known}),
        )
    lacking = [number for number in range(min(numbers[0], 1), numbers[-1] + 1) if number not in numbers]
    gone = listed([broken.stem.replace(MARK, str(number)) for number in lacking])
    named = {key: [names[place] for place in own[0].places] for key, own in measured.items()}
    return LogError(
        f"the {quantity} columns are numbered and {gone} {'is' if len(lacking) == 1 else 'are'} missing",
        found=found,
        expected="numbers that follow each other, from 0 or 1",
        hint="add the missing column; or if these are all joints, name as many of each quantity: "
        f"{stated_line({**named, **known})}, and which of the robot's joints they are by [log] joint_names",
    )


def sides_of(names: Sequence[str], quantity: str = "position") -> dict[str, dict[str, str]]:
    """Numbered columns with a word more than the quantity's, such as an arm's side: word to quantity to pattern."""
    sides: dict[str, dict[str, str]] = {}
    for family in sorted(families([without_unit(name) for name in names]), key=lambda family: family.stem):
        for word, meaning in word_dropped(family.stem):
            sides.setdefault(word, {}).setdefault(meaning.quantity, family.pattern)
    return {word: patterns for word, patterns in sides.items() if quantity in patterns}


def _several_arms(names: Sequence[str], quantity: str) -> LogError | None:
    sides = sides_of(names, quantity)
    if not sides:
        return None
    several = f"the {quantity} columns are of several arms or sides: {', '.join(sides)}"
    one = f"the {quantity} columns have a word in their names that is not known: {next(iter(sides))}"
    return LogError(
        several if len(sides) > 1 else one,
        found=", ".join(patterns[quantity] for patterns in sides.values()),
        hint=("one configuration an arm, " if len(sides) > 1 else "if they are measured, say so, ")
        + ", or ".join(map(stated_line, sides.values())),
    )


def _not_measured(names: Sequence[str], quantity: str, known: Mapping[str, str]) -> LogError | None:
    """Columns of the quantity, all of them desired, commanded, modelled or in a unit that is not converted."""
    groups = [group for group in numbered_groups(names) if not is_measured(group.meaning)]
    own = [group.said for group in groups if group.meaning.quantity == quantity]
    if not own:
        return None
    columns = {group.meaning.quantity: group.pattern for group in reversed(groups)} | dict(known)
    return LogError(
        f"no column of a measured {quantity} was recognised",
        found=", ".join(own),
        expected=f"one column of measured {quantity} per joint",
        hint="record what was measured; or, if these are measured although their names say otherwise: "
        + stated_line(columns),
    )
