"""Names of signals: those that differ in one number, the patterns that match them, and what their words say they are.

In patterns ``{joint}`` is a joint's name, ``{i}`` a number from 1, ``{i0}`` one from 0. By their words signals are
measured, or desired, commanded, of a model.
"""

from __future__ import annotations

import json
import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

from collaudit.core.errors import LogError
from collaudit.core.vendors.vendor_words import (
    CONVERTED,
    NO_NAMESPACE,
    NO_TOPIC,
    ROLE_OF,
    STRONGEST,
    USABLE,
    Meaning,
    SignalRole,
)

#: Stands for the number in a stem.
MARK = "\0"
_NUMBER = re.compile(r"\d+")
_CAMEL = re.compile(r"(?<=[a-z])(?=[A-Z])(?!(?<=\bm)A\b|(?<=_m)A(?![A-Za-z])|(?<=_m)Nm)")
#: What is expected of efforts.
NO_CONTACT = "efforts that were measured: no contact shows in what a controller commands or computes"
MOTION = ("position", "velocity", "effort")
QUANTITIES = (*MOTION, "temperature", "joint_torque")
_UNIT = re.compile(r"\s*[\[(]\s*([^\])]*?)\s*[\])]\s*$")
#: A quantity of a message with a number: as paths, or as MATLAB and R rename them.
_OF_MESSAGE = re.compile(r"([/.]|\b(x_)?(field|joint_states?)_)(position|velocity|effort)[\[._]?\{i", re.IGNORECASE)
#: Of columns whose names say nothing.
NO_MEANING = Meaning("", "plain", "")


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


def words_of(text: str) -> list[str]:
    """Words of a name in lower case; the number's mark stays with the word it touches.

    An ``x`` in front of a path is no word: MATLAB puts it before names that begin with no letter.
    """
    words = [word for word in re.split(rf"[^A-Za-z0-9{MARK}]+", _CAMEL.sub("_", text).lower()) if word]
    return words[1:] if words[:2] == ["x", "joint"] else words


def strongest(roles: Collection[SignalRole]) -> SignalRole:
    """The role of a signal whose words have several; plain without any."""
    return next((role for role in STRONGEST if role in roles), "plain")


def is_usable(role: SignalRole) -> bool:
    """Whether a signal of this role may be taken for a measurement where nothing states it."""
    return role in USABLE


def role_of_path(path: str) -> SignalRole:
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


@dataclass(frozen=True, slots=True)
class Found:
    """Columns of one quantity.

    Attributes:
        joints: joint name of each column; "" where the configuration gives columns without names.
        columns: their indices.
        pattern: the pattern that found them, or "" for names and numbers.
        meaning: what their names say of them.
    """

    joints: tuple[str, ...]
    columns: tuple[int, ...]
    pattern: str
    meaning: Meaning = NO_MEANING

    @classmethod
    def numbered(cls, columns: Sequence[int], pattern: str, meaning: Meaning = NO_MEANING) -> Found:
        """Columns whose joints have no other names than their numbers."""
        return cls(tuple(f"joint{k + 1}" for k in range(len(columns))), tuple(columns), pattern, meaning)

    @property
    def is_numbered(self) -> bool:
        """Whether the joints are the numbers of columns, and no names."""
        return self.joints == Found.numbered(self.columns, "").joints

    @property
    def stem(self) -> str:
        """The pattern with :data:`MARK` for the number or the joint's name, as the vocabulary takes it."""
        return re.sub(r"\{\w+\}", MARK, self.pattern)

    @property
    def said(self) -> str:
        """The pattern with what speaks against it, or for it."""
        unit = f" in {self.meaning.unit}" if self.meaning.unit not in CONVERTED else ""
        return f"{self.pattern} ({self.meaning.role}{unit})"


@lru_cache(maxsize=4096)
def bare(name: str) -> str:
    """A column name without a list mark in front and a unit behind."""
    return without_unit(name).lstrip("/")


@lru_cache(maxsize=4096)
def unit_of(name: str) -> str | None:
    """The unit in a column name such as ``q1 [deg]``, or None."""
    match = _UNIT.search(name.strip())
    return match.group(1) if match and not match.group(1).isdigit() else None


@lru_cache(maxsize=4096)
def _regex(pattern: str) -> re.Pattern[str]:
    number = re.escape("{i}" if "{i}" in pattern else "{i0}")
    text = re.escape(pattern).replace(number, r"(?P<i>\d+)", 1)
    return re.compile(text.replace(re.escape("{joint}"), "(?P<joint>.+?)", 1), re.IGNORECASE)


def match_pattern(names: Sequence[str], pattern: str) -> Found | None:
    """Columns that match a pattern, in the order of their numbers or of the file.

    Raises:
        LogError: the pattern counts from 1 and the columns from 0.
    """
    regex = _regex(pattern)
    matches = (
        (index, regex.fullmatch(name.strip()) or regex.fullmatch(bare(name))) for index, name in enumerate(names)
    )
    hits = [(index, match) for index, match in matches if match is not None]
    if "{i" not in pattern:
        joints = tuple(bare(match["joint"]) if "{joint}" in pattern else "" for _, match in hits)
        return Found(joints, tuple(index for index, _ in hits), pattern) if hits else None
    first = 0 if "{i0}" in pattern else 1
    numbered = sorted((int(match["i"]), index) for index, match in hits)
    if numbered and numbered[0][0] < first:
        zero = pattern.replace("{i}", "{i0}")
        found = names[numbered[0][1]].strip()
        raise LogError(f"the columns of {pattern!r} count from 0", found=found, hint=json.dumps(zero))
    follow = all(number == place for place, (number, _) in enumerate(numbered, first))
    return Found.numbered([index for _, index in numbered], pattern) if numbered and follow else None


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


@lru_cache(maxsize=4096)
def without_unit(name: str) -> str:
    """A column name without a list mark in front and a unit behind, with its path and a number in brackets."""
    text = name.strip().lstrip("-* ")
    return text if unit_of(text) is None else _UNIT.sub("", text)


def stated_line(columns: Mapping[str, object]) -> str:
    """The line of the configuration that states columns, by quantity."""
    stated = (f"{name} = {json.dumps(columns[name], ensure_ascii=False)}" for name in QUANTITIES if name in columns)
    return "[log.csv] " + "; ".join(stated)


def counts_message(pattern: str) -> bool:
    """Whether a pattern's numbers count the joints of a JointState, as exports of ROS messages do."""
    return _OF_MESSAGE.search(pattern) is not None
