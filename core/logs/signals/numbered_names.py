"""Names that differ in one number: which belong together, and whether their numbers follow each other."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

#: Stands for the number in a stem.
MARK = "\0"
_NUMBER = re.compile(r"\d+")


@dataclass(frozen=True, slots=True)
class Family:
    """Names that differ in one number, in its order.

    Attributes:
        stem: the name with :data:`MARK` for the number.
        numbers: as the names have them.
        places: index of each name.
    """

    stem: str
    numbers: tuple[int, ...]
    places: tuple[int, ...]

    @property
    def counts(self) -> bool:
        """Whether the numbers follow each other, from 0 or 1."""
        first = self.numbers[0]
        return first in (0, 1) and self.numbers == tuple(range(first, first + len(self.numbers)))

    @property
    def pattern(self) -> str:
        """The pattern of the configuration that the names match."""
        return self.stem.replace(MARK, "{i0}" if self.numbers[0] == 0 else "{i}")


def families(names: Sequence[str]) -> list[Family]:
    """Every family of some names, one for each number in them; a name with two numbers is of two."""
    stems: dict[str, list[tuple[int, int]]] = {}
    for place, name in enumerate(names):
        for hit in _NUMBER.finditer(name):
            stems.setdefault(name[: hit.start()] + MARK + name[hit.end() :], []).append((int(hit.group()), place))
    found = []
    for stem, hits in stems.items():
        numbers, places = zip(*sorted(hits), strict=True)
        found.append(Family(stem, numbers, places))
    return found
