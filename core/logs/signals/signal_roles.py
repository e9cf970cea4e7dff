"""Names of signals: those that differ in one number, and what their words say they are.

Measured, or desired, commanded, of a model.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass

from collaudit.core.vendors.vendor_words import NO_NAMESPACE, NO_TOPIC, ROLE_OF, STRONGEST, USABLE, Role

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


_CAMEL = re.compile(r"(?<=[a-z])(?=[A-Z])(?!(?<=\bm)A\b|(?<=_m)A(?![A-Za-z])|(?<=_m)Nm)")

#: What is expected of efforts.
NO_CONTACT = "efforts that were measured: no contact shows in what a controller commands or computes"


def words_of(text: str) -> list[str]:
    """Words of a name in lower case; the number's mark stays with the word it touches.

    An ``x`` in front of a path is no word: MATLAB puts it before names that begin with no letter.
    """
    words = [word for word in re.split(rf"[^A-Za-z0-9{MARK}]+", _CAMEL.sub("_", text).lower()) if word]
    return words[1:] if words[:2] == ["x", "joint"] else words


def strongest(roles: Collection[Role]) -> Role:
    """The role of a signal whose words have several; plain without any."""
    return next((role for role in STRONGEST if role in roles), "plain")


def is_usable(role: Role) -> bool:
    """Whether a signal of this role may be taken for a measurement where nothing states it."""
    return role in USABLE


def role_of_path(path: str) -> Role:
    """The role of a topic, or of a field by its dotted path.

    The last part has the words of columns; a single letter counts at its end only. The parts before it name robots and
    nodes, too: there only words for commands count.
    """
    parts = [words_of(part) for part in re.split(r"[/.]", path) if part.strip()]
    if not parts:
        return "plain"
    *front, last = parts
    roles = {ROLE_OF[word] for place, word in enumerate(last, 1)
             if word in ROLE_OF and word not in NO_TOPIC and (len(word) > 1 or 1 < place == len(last))}  # fmt: skip
    above = {ROLE_OF[word] for part in front for word in part if word in ROLE_OF and word not in NO_NAMESPACE}
    return strongest(roles | {role for role in above if role in ("desired", "commanded")})


def refusal_hint(lines: str) -> str:
    """What to do about efforts that are no measurement by their names.

    Args:
        lines: of the configuration that choose them.
    """
    return (
        "record what was measured; or, if these are measured although their names say otherwise, state so: "
        f'{lines}; [log] effort_kind = "motor-torque" (or "joint-torque" or "motor-current")'
    )
