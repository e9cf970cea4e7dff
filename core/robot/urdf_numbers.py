"""Numbers of a robot description that no arm can have: refused before a library computes with them."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections.abc import Sequence

from collaudit.core.config.schema import DhRow
from collaudit.core.errors import RobotError

#: No link of an arm is longer, m; heavier, kg; or has a larger moment of inertia, kg·m².
_LONGEST, _HEAVIEST, _LARGEST = (50.0, "m"), (1e5, "kg"), (1e7, "kg·m²")
#: Where joints and links state numbers: the element, its attribute, how many there are, the largest size of them.
_OF_JOINT = (
    ("origin", "xyz", 3, _LONGEST),
    ("origin", "rpy", 3, None),
    ("axis", "xyz", 3, None),
    *(("limit", key, 1, None) for key in ("lower", "upper", "effort", "velocity")),
    *(("mimic", key, 1, None) for key in ("multiplier", "offset")),
)
_OF_LINK = (
    ("inertial/origin", "xyz", 3, _LONGEST),
    ("inertial/origin", "rpy", 3, None),
    ("inertial/mass", "value", 1, _HEAVIEST),
    *(("inertial/inertia", key, 1, _LARGEST) for key in ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")),
)
_OF_ROW = (("d", _LONGEST), ("a", _LONGEST), ("com_m", _LONGEST), ("mass_kg", _HEAVIEST), ("inertia_kg_m2", _LARGEST))


def check_joint(element: ET.Element, place: str) -> None:
    """Refuse a joint whose numbers are none, whose axis has no direction, or whose limits are swapped.

    Args:
        element: ``<joint>``.
        place: what messages call it.

    Raises:
        RobotError: naming the attribute.
    """
    fixed = element.get("type") == "fixed"  # fixed joints often come with the axis 0 0 0, and no library reads it
    stated = _checked(element, [one for one in _OF_JOINT if one[0] != "axis" or not fixed], place)
    axis = stated.get("axis xyz")
    if axis is not None and not math.hypot(*axis) > 1e-6:
        raise RobotError("the axis has no direction", where=place, found=" ".join(f"{x:g}" for x in axis))
    (lower,), (upper,) = (stated.get(f"limit {key}", [0.0]) for key in ("lower", "upper"))
    if element.get("type") in ("revolute", "prismatic") and lower > upper:
        raise RobotError(
            "the limits are swapped",
            where=place,
            found=f"lower {lower:g}, upper {upper:g}",
            expected="lower no larger than upper",
        )


def check_link(element: ET.Element, place: str) -> None:
    """Refuse a link whose mass, inertia or centre of mass no body of an arm has.

    Args:
        element: ``<link>``.
        place: what messages call it.

    Raises:
        RobotError: naming the attribute.
    """
    (mass_kg,) = _checked(element, _OF_LINK, place).get("mass value", [0.0])
    if mass_kg < 0.0:
        raise RobotError("the mass is negative", where=place, found=f"{mass_kg:g}")


def check_rows(rows: Sequence[DhRow]) -> None:
    """Refuse Denavit-Hartenberg rows that no arm can have.

    Raises:
        RobotError: naming row and key.
    """
    for number, row in enumerate(rows, 1):
        for key, largest in _OF_ROW:
            stated = getattr(row, key) or 0.0
            for value in stated if isinstance(stated, tuple) else (stated,):
                _check_size(key, value, largest, f"robot.dh, row {number}")


def _checked(
    element: ET.Element, wanted: Sequence[tuple[str, str, int, tuple[float, str] | None]], place: str
) -> dict[str, list[float]]:
    """The numbers that are there, by element and attribute."""
    stated = {}
    for path, key, count, largest in wanted:
        part = element.find(path)
        if part is not None and key in part.attrib:
            name = f"{part.tag} {key}"
            stated[name] = _numbers(part.get(key, ""), count, name, place)
            if largest is not None:
                _check_size(name, math.hypot(*stated[name]), largest, place)
    return stated


def _numbers(text: str, count: int, name: str, place: str) -> list[float]:
    try:
        values = [float(word) for word in text.split()]
    except ValueError:
        values = []
    if len(values) != count or not all(map(math.isfinite, values)):
        what = "a finite number" if count == 1 else f"{count} finite numbers"
        raise RobotError(f"{name} is not {what}", where=place, found=text[:60], expected=what)
    return values


def _check_size(what: str, value: float, largest: tuple[float, str], place: str) -> None:
    most, unit = largest
    if abs(value) > most:
        raise RobotError(
            f"{what} is beyond what an arm can have",
            where=place,
            found=f"{value:g} {unit}",
            expected=f"at most {most:g} {unit}",
            hint="check the unit: lengths are in m, masses in kg, moments of inertia in kg·m²",
        )
