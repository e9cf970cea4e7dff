"""What columns are by their words, which belong together, and which of several are the measured ones."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

from collaudit.core.logs.signals.signal_names import (
    MARK,
    Found,
    bare,
    families,
    is_usable,
    strongest,
    without_unit,
    words_of,
)
from collaudit.core.vendors.vendor_words import (
    BY_DOT,
    CONVERTED,
    CURRENTS,
    DEGREES_BELOW,
    DOOSAN,
    DOOSAN_ONLY,
    ELSEWHERE,
    FILLERS,
    JOINT_WORDS,
    KNOWN,
    LABEL_WORDS,
    MOTOR,
    MOTOR_WORDS,
    OF_DRIVES,
    QUANTITY_WORDS,
    ROLE_OF,
    UNIT_WORDS,
    UNITS_OF,
    USABLE,
    Meaning,
    SignalRole,
)

#: A joint that is itself called by a letter and a number is named, not numbered.
_NAMED_AXIS = re.compile("joint_?a\0", re.IGNORECASE)


def is_label(name: str) -> bool:
    """Whether a column is named as a mark of true events."""
    return re.sub(r"[^a-z]", "", name.lower()) in LABEL_WORDS and not re.search(r"\d", name)


@lru_cache(maxsize=65536)
def meaning_of(stem: str) -> Meaning | None:
    """What the columns of a stem are; None where a word is unknown.

    Args:
        stem: a name whose joint number is replaced by :data:`MARK`.
    """
    if _NAMED_AXIS.search(stem):
        return None
    segments = [part for part in re.split(r"[/.]", stem) if part.strip(MARK + "[]()_ ")]
    words = [word for part in segments for word in words_of(part)]
    plain = [word.replace(MARK, "") for word in words]
    letters = "".join(word for word, whole in zip(plain, words, strict=True)
                      if MARK not in whole or word not in ("a", "j", "joint", "axis"))  # fmt: skip
    if (known := KNOWN.get(letters.removeprefix("field").removeprefix("state"))) is not None:
        return known
    last = set(words_of(segments[-1])) if segments else set()
    if last and all(word.replace(MARK, "") in JOINT_WORDS or word == "a" + MARK for word in last):
        last = set(words_of(segments[-2])) if len(segments) > 1 else last
    return _by_words(words, last, degrees=not DEGREES_BELOW.isdisjoint(plain))


def _by_words(words: list[str], last: set[str], *, degrees: bool) -> Meaning | None:
    found: tuple[str, str] | None = None
    roles: set[SignalRole] = set()
    units: list[str] = []
    for whole in words:
        word = whole.replace(MARK, "")
        attached = MARK in whole
        quantity = next((q for q, known in QUANTITY_WORDS.items() if word in known), None)
        if word in ELSEWHERE:
            return None
        if not word or word in JOINT_WORDS or (word == "a" and (attached or found is None or found[1] not in CURRENTS)):
            continue
        if found and word == "dot" and found[1] in BY_DOT:
            found = ("velocity", BY_DOT[found[1]])
        elif found and word in ("s", "sec", "per") and (not units or units[-1][:3] in ("deg", "rad")):
            units = [unit.removesuffix("/s") + "/s" for unit in units]
        elif quantity is not None and (found is None or whole in last or attached):
            if found is not None and found[0] != quantity and whole in last and found[1] in last:
                return None
            found = (quantity, word)
        elif word in UNIT_WORDS and found:
            units.append(UNIT_WORDS[word])
        elif word in ROLE_OF:
            if len(word) > 1 or whole in last:
                roles.add(ROLE_OF[word])
        elif whole in last and word not in FILLERS:
            return None
    motor = not MOTOR.isdisjoint(word.replace(MARK, "") for word in words)
    return _meaning(found, roles, units, degrees=degrees, motor=motor) if found else None


def _meaning(
    found: tuple[str, str], roles: set[SignalRole], units: list[str], *, degrees: bool, motor: bool
) -> Meaning | None:
    quantity, word = found
    if quantity == "temperature" or word in CURRENTS:
        roles.discard("side")  # the motor is where these are measured
    if word in MOTOR_WORDS:
        roles.add("side")
    role = strongest(roles)
    unit = units[-1] if units else ""
    if unit and unit not in UNITS_OF[quantity]:
        return None
    if quantity == "velocity" and unit in ("deg", "rad"):
        unit += "/s"
    if not unit and degrees:
        unit = {"position": "deg", "velocity": "deg/s"}.get(quantity, "")
    if not unit and word in CURRENTS:
        unit = "current"
    return Meaning(quantity, role, word, unit, motor)


_WORD = re.compile(r"[A-Za-z]+")
_QUANTITIES = frozenset(word for words in QUANTITY_WORDS.values() for word in words)


@dataclass(frozen=True, slots=True)
class Choice:
    """The group taken for a quantity, or those between which the names do not decide.

    Attributes:
        taken: None where there is none, or several.
        passed: further groups of the quantity, not taken.
        open: two or more groups that are equally likely, or positions of the motors' side alone, which may lie before
            the gear; empty when decided.
    """

    taken: Found | None
    passed: tuple[Found, ...]
    open: tuple[Found, ...] = ()


def groups_of(names: Sequence[str], joints: Sequence[str] = ()) -> list[Found]:
    """Groups of columns that the vocabulary knows, measured or not.

    Args:
        names: column names; "" for columns that are taken.
        joints: what joints are called in the names; numbers count others.
    """
    known = [(group, meaning_of(group.stem)) for group in _alike(names, joints)]
    return _as_doosan([replace(group, meaning=meaning) for group, meaning in known if meaning is not None])


def _alike(names: Sequence[str], joints: Sequence[str]) -> list[Found]:
    """Columns that differ in a joint's name, and others that differ in a number that counts; what they are is open."""
    named = _of_joints(names, joints) if joints else []
    taken = {column for group in named for column in group.columns}
    rest = ["" if column in taken else without_unit(name) for column, name in enumerate(names)]
    return [*named, *(Found.numbered(each.places, each.pattern) for each in families(rest) if each.counts)]


def _of_joints(names: Sequence[str], joints: Sequence[str]) -> list[Found]:
    order = {joint.lower(): place for place, joint in enumerate(joints)}
    longest = sorted(map(re.escape, joints), key=len, reverse=True)
    whole = re.compile(rf"(?<![^\W_])({'|'.join(longest)})(?![^\W_])", re.IGNORECASE)
    patterns: dict[str, list[tuple[int, int]]] = {}
    for column, name in enumerate(names):
        text = bare(name) if whole.search(bare(name)) else name.strip()  # a joint in brackets is no unit
        for hit in whole.finditer(text):
            pattern = text[: hit.start()] + "{joint}" + text[hit.end() :]
            patterns.setdefault(pattern, []).append((order[hit[0].lower()], column))
    out = []
    for pattern, hits in patterns.items():
        places, columns = zip(*sorted(hits), strict=True)
        out.append(Found(tuple(joints[place] for place in places), columns, pattern))
    return out


def word_dropped(stem: str) -> Iterator[tuple[str, Meaning]]:
    """Each word without which a stem that is not known is that of a measurement, and what it then is."""
    if meaning_of(stem) is not None:
        return
    for hit in _WORD.finditer(stem):
        meaning = meaning_of(stem[: hit.start()] + stem[hit.end() :])
        if meaning is not None and is_usable(meaning.role):
            yield hit.group(), replace(meaning, role="unknown word")


def with_unknown(choices: Mapping[str, Choice], names: Sequence[str], joints: Sequence[str]) -> dict[str, Choice]:
    """The choices with groups whose names hold one unknown word: passed over, or rivals of the taken ones.

    Of ``torque_a_#`` and ``torque_b_#`` the vocabulary may know a letter and not the other; that decides nothing.

    Args:
        choices: by quantity.
        names: columns that are no signal; "" for those that are.
        joints: as of :func:`groups_of`.
    """
    known = [(group, next(word_dropped(group.stem), None)) for group in _alike(names, joints)]
    groups = [replace(group, meaning=word[1]) for group, word in known if word is not None]
    out = dict(choices)
    for quantity, choice in choices.items():
        if (taken := choice.taken) is None:
            continue
        own = [g for g in groups if g.meaning.quantity == quantity and len(g.columns) == len(taken.columns)]
        rivals = tuple(group for group in own if _rival(taken.stem, group.stem))
        passed = (*choice.passed, *(group for group in own if group not in rivals))
        out[quantity] = Choice(None, passed, (taken, *rivals)) if rivals else Choice(taken, passed)
    return out


def _rival(taken: str, other: str) -> bool:
    """Whether two stems differ in one word that says nothing of the taken one."""
    ours, theirs = words_of(taken), words_of(other)
    apart = [word.replace(MARK, "") for word, another in zip(ours, theirs, strict=False) if word != another]
    return len(ours) == len(theirs) and len(apart) == 1 and apart[0] not in {*ROLE_OF, *_QUANTITIES}


def _as_doosan(groups: list[Found]) -> list[Found]:
    """Doosan's real-time state, told by columns that only it has beside ``actual_joint_position``."""
    letters = [re.sub(r"\{\w+\}|[^a-z{}]", "", group.pattern.lower()) for group in groups]
    if "actualjointposition" not in letters or not DOOSAN_ONLY.intersection(letters):
        return groups
    pairs = zip(letters, groups, strict=True)
    return [replace(group, meaning=replace(group.meaning, **DOOSAN.get(name, {}))) for name, group in pairs]


def choose(groups: Sequence[Found], quantity: str, joints: int | None = None) -> Choice:
    """The measured columns among those of one quantity.

    Args:
        groups: of :func:`groups_of`.
        quantity: which.
        joints: how many columns the positions have; groups with as many are preferred.
    """
    own = [group for group in groups if group.meaning.quantity == quantity]
    usable = [group for group in own if is_measured(group.meaning)]
    if joints is not None and any(len(group.columns) == joints for group in usable):
        usable = [group for group in usable if len(group.columns) == joints]
    if not usable:
        return Choice(None, tuple(own))
    least = min(map(_rank, usable))
    best = [group for group in usable if _rank(group) == least]
    first = min(best, key=lambda group: preference(group.meaning))
    doubtful = [group for group in best if quantity == "effort" or group.meaning.word == first.meaning.word]
    if len(doubtful) > 1:
        return Choice(None, tuple(group for group in own if group not in doubtful), tuple(doubtful))
    rest = tuple(group for group in own if group is not first)
    asked = quantity == "position" and first.meaning.motor
    return Choice(None, rest, (first,)) if asked else Choice(first, rest)


def _rank(group: Found) -> tuple[int, bool, int]:
    """Measured before filtered, torques before what drives count in, the largest group first."""
    return USABLE.index(group.meaning.role), _of_drives(group.meaning), -len(group.columns)


def _of_drives(meaning: Meaning) -> bool:
    """Whether efforts are in a unit of drives, of which constants make torques."""
    return meaning.word in CURRENTS or meaning.unit in OF_DRIVES


def is_measured(meaning: Meaning) -> bool:
    """Whether a guess may take columns with these words for a measurement."""
    return is_usable(meaning.role) and meaning.unit in CONVERTED


def preference(meaning: Meaning) -> tuple[bool, int, int]:
    """Torques before what drives count in, measured before filtered, and the usual word of a quantity first."""
    words = QUANTITY_WORDS[meaning.quantity]
    rank = words.index(meaning.word) if meaning.word in words else -1
    return _of_drives(meaning), USABLE.index(meaning.role), rank
