"""Columns that are no joint's: a controller's modes, and six that may be a wrist force/torque sensor's."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from collaudit.core.data.joint_log import Annotation
from collaudit.core.logs.signals.annotation_spans import spans_of
from collaudit.core.logs.signals.signal_names import MARK, families
from collaudit.core.numeric.arrays import FloatArray, IntArray
from collaudit.core.vendors.vendor_words import (
    FRANKA_MODE,
    MODE_WORDS,
    ROBOT_COLUMNS,
    SAFETY_COLUMNS,
    UR_ROBOT_MODE,
    UR_RUNNING,
    UR_SAFETY_MODE,
)


def mode_columns(names: Sequence[str]) -> tuple[str, ...]:
    """The columns of a table that hold a mode, by their names."""
    return tuple(name for name in names if _letters(name).endswith((*SAFETY_COLUMNS, *ROBOT_COLUMNS)))


def mode_annotations(
    texts: Mapping[str, Sequence[str]], rows: IntArray, stamps: FloatArray, where: str
) -> list[Annotation]:
    """The states that mode columns tell, one annotation each.

    Args:
        texts: column name to the text of each row.
        rows: (k,) rows with a stamp, in time order.
        stamps: (k,) s.
        where: the file.
    """
    out = []
    for name in mode_columns(list(texts)):
        # whole numbers without their decimals
        values = np.array([texts[name][row].strip().removesuffix(".0") for row in rows.tolist()], dtype=object)
        meaning = _meaning(name, set(values.tolist()))
        for state in dict.fromkeys(meaning.values()):
            holds = np.array([meaning.get(value) == state for value in values.tolist()], dtype=np.bool_)
            if holds.any():
                out.append(Annotation(state, f"{where}, column {name.strip()}", tuple(spans_of(stamps, holds))))
    return out


def _meaning(name: str, values: set[str]) -> dict[str, str]:
    """Value to state. A robot_mode that is ever 7, running, is UR's; libfranka's stays below."""
    of_robot = UR_ROBOT_MODE if str(UR_RUNNING) in values else FRANKA_MODE
    states = UR_SAFETY_MODE if _letters(name).endswith(SAFETY_COLUMNS) else of_robot
    bare = {value: _letters(value).removeprefix("robotmode").removeprefix("k") for value in values}
    words = {value: MODE_WORDS[word] for value, word in bare.items() if word in MODE_WORDS}
    return {**{str(number): state for number, state in states.items()}, **words}


def _letters(text: str) -> str:
    return re.sub(r"[^a-z]", "", text.lower())


_KINDS = dict.fromkeys(("f", "force", "forces", "kraft"), "force")
_KINDS |= dict.fromkeys(("m", "t", "torque", "torques", "moment", "moments", "tau"), "torque")
_SIX = tuple(f"{kind} {axis}" for kind in ("force", "torque") for axis in "xyz")
#: Words before six numbered columns that hold a wrench.
_NUMBERED = re.compile(r"(wrench|ft|fts|forcetorque|tcpforce|tcpwrench|ftsensor|ftraw|fext|fexthatk)$")
#: A wrench that was computed from joint torques or currents, so that it says nothing that they do not.
_ESTIMATED = re.compile(r"ext|est|hat|virtual|model|desired|target|cmd|command")


@dataclass(frozen=True, slots=True)
class WrenchColumns:
    """Six columns: forces, then torques.

    Attributes:
        names: as the file has them.
        estimated: the names say that no sensor measured them.
    """

    names: tuple[str, ...]
    estimated: bool


def find_wrench(names: Sequence[str]) -> WrenchColumns | None:
    """The six columns whose names say force and torque along x, y and z; measured ones before estimated ones.

    They are offered, never taken.
    """
    found: dict[str, dict[str, str]] = {}
    for name in names:
        rest, place = _kind_and_axis(name)
        found.setdefault(rest, {}).setdefault(place, name)
    for family in families(names):
        front, _, behind = family.stem.partition(MARK)
        stem = re.sub(r"[^a-z]", "", front.lower())
        if _NUMBERED.search(stem) and not re.search(r"\d", behind) and family.counts and len(family.places) == 6:
            found[stem] = {place: names[index] for place, index in zip(_SIX, family.places, strict=True)}
    whole = [
        (rest, tuple(columns[place] for place in _SIX)) for rest, columns in found.items() if {*_SIX} <= {*columns}
    ]
    wrenches = (WrenchColumns(six, bool(_ESTIMATED.search(rest))) for rest, six in whole)
    return min(wrenches, key=lambda each: each.estimated, default=None)


def _kind_and_axis(name: str) -> tuple[str, str]:
    """What remains of a name without its kind and axis, and these; empty where it has none."""
    text = re.sub(r"[\[(].*$", "", re.sub(r"(?<=[a-z])(?=[A-Z])", "_", name)).lower()
    text = re.sub(rf"(?<![a-z])({'|'.join(_KINDS)})([xyz])(?![a-z])", r"\1_\2", text)  # fx is the force along x
    words = re.findall(r"[a-z]+|\d+", text)
    axes = [place for place, word in enumerate(words) if word in ("x", "y", "z")]
    kinds = [place for place, word in enumerate(words) if word in _KINDS]
    if len(axes) != 1 or not kinds:
        return "", ""
    left = [word for place, word in enumerate(words) if place not in (axes[0], kinds[-1])]
    return "/".join(left), f"{_KINDS[words[kinds[-1]]]} {words[axes[0]]}"
