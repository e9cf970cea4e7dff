"""Six columns that may be those of a wrist force/torque sensor, by their names. They are offered, never taken."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from collaudit.core.logs.signals.signal_roles import MARK, families

_AXES = "xyz"
_KINDS = dict.fromkeys(("f", "force", "forces", "kraft"), "force")
_KINDS |= dict.fromkeys(("m", "t", "torque", "torques", "moment", "moments", "tau"), "torque")
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
    """The six columns whose names say force and torque along x, y and z; measured ones before estimated ones."""
    found = [*_by_axes(names), *_by_number(names)]
    return min(found, key=lambda each: each.estimated, default=None)


def _by_axes(names: Sequence[str]) -> Iterator[WrenchColumns]:
    places: dict[str, dict[tuple[str, str], str]] = {}
    for name in names:
        hit = _kind_and_axis(name)
        if hit is not None:
            rest, kind, axis = hit
            places.setdefault(rest, {}).setdefault((kind, axis), name)
    for rest, columns in places.items():
        six = [columns.get((kind, axis)) for kind in ("force", "torque") for axis in _AXES]
        if None not in six:
            yield WrenchColumns(tuple(name for name in six if name is not None), bool(_ESTIMATED.search(rest)))


def _kind_and_axis(name: str) -> tuple[str, str, str] | None:
    """What remains of a name without its kind and axis, the kind, the axis."""
    text = re.sub(r"[\[(].*$", "", re.sub(r"(?<=[a-z])(?=[A-Z])", "_", name)).lower()
    text = re.sub(rf"(?<![a-z])({'|'.join(_KINDS)})([{_AXES}])(?![a-z])", r"\1_\2", text)  # fx is the force along x
    words = re.findall(r"[a-z]+|\d+", text)
    axes = [place for place, word in enumerate(words) if word in _AXES]
    kinds = [place for place, word in enumerate(words) if word in _KINDS]
    if len(axes) != 1 or not kinds:
        return None
    left = [word for place, word in enumerate(words) if place not in (axes[0], kinds[-1])]
    return "/".join(left), _KINDS[words[kinds[-1]]], words[axes[0]]


def _by_number(names: Sequence[str]) -> Iterator[WrenchColumns]:
    for family in families(names):
        front, _, behind = family.stem.partition(MARK)
        stem = re.sub(r"[^a-z]", "", front.lower())
        if _NUMBERED.search(stem) and not re.search(r"\d", behind) and family.counts and len(family.places) == 6:
            yield WrenchColumns(tuple(names[place] for place in family.places), bool(_ESTIMATED.search(stem)))
