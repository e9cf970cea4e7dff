"""What the words of a column's name say of it."""

from __future__ import annotations

import re
from functools import lru_cache

from collaudit.core.logs.signals.signal_roles import MARK, strongest, words_of
from collaudit.core.vendors.column_words import (
    BY_DOT,
    CURRENTS,
    DEGREES_BELOW,
    ELSEWHERE,
    FILLERS,
    JOINT_WORDS,
    KNOWN,
    LABEL_WORDS,
    MOTOR,
    MOTOR_WORDS,
    QUANTITY_WORDS,
    ROLE_OF,
    UNIT_WORDS,
    UNITS_OF,
    Meaning,
    Role,
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
    letters = "".join(word for word, whole in zip(plain, words, strict=True) if not _axis(word, whole))
    if (known := KNOWN.get(letters.removeprefix("field").removeprefix("state"))) is not None:
        return known
    last = set(words_of(segments[-1])) if segments else set()
    if last and all(word.replace(MARK, "") in JOINT_WORDS or word == "a" + MARK for word in last):
        last = set(words_of(segments[-2])) if len(segments) > 1 else last
    return _by_words(words, last, degrees=not DEGREES_BELOW.isdisjoint(plain))


def _axis(word: str, whole: str) -> bool:
    return not word or (MARK in whole and word in ("a", "j", "joint", "axis"))


def _by_words(words: list[str], last: set[str], *, degrees: bool) -> Meaning | None:
    found: tuple[str, str] | None = None
    roles: set[Role] = set()
    units: list[str] = []
    for whole in words:
        word = whole.replace(MARK, "")
        attached = MARK in whole
        quantity = next((q for q, known in QUANTITY_WORDS.items() if word in known), None)
        if word in ELSEWHERE:
            return None
        if not word or word in JOINT_WORDS or (word == "a" and (attached or not _is_current(found))):
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


def _is_current(found: tuple[str, str] | None) -> bool:
    return found is not None and found[1] in CURRENTS


def _meaning(
    found: tuple[str, str], roles: set[Role], units: list[str], *, degrees: bool, motor: bool
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
