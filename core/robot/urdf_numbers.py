"""Numbers of a robot description that no arm can have: refused before a library computes with them."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections.abc import Sequence

from collaudit.core.config.schema import DhRow
from collaudit.core.errors import RobotError

#: No link of an arm is longer, m; heavier, kg; or has a larger moment of inertia, kg·m².
LONGEST_M, HEAVIEST_KG, LARGEST_KG_M2 = 50.0, 1e5, 1e7
_MOMENTS = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")


def check_joint(element: ET.Element, place: str) -> None:
    """Refuse a joint whose numbers are none, whose axis has no direction, or whose limits are swapped.

    Args:
        element: ``<joint>``.
        place: what messages call it.

    Raises:
        RobotError: naming the attribute.
    """
    _check_origin(element, place)
    axis = element.find("axis")
    moves = element.get("type") != "fixed"  # fixed joints often come with the axis 0 0 0, and no library reads it
    if moves and axis is not None and axis.get("xyz") is not None:
        direction = _numbers(axis, "xyz", place, 3)
        if not math.hypot(*direction) > 1e-6:
            raise RobotError("the axis has no direction", where=place, found=axis.get("xyz"))
    limit = element.find("limit")
    if limit is None:
        return
    bounds = {
        key: _numbers(limit, key, place, 1)[0]
        for key in ("lower", "upper", "effort", "velocity")
        if key in limit.attrib
    }
    if element.get("type") in ("revolute", "prismatic") and bounds.get("lower", 0.0) > bounds.get("upper", 0.0):
        raise RobotError(
            "the limits are swapped",
            where=place,
            found=f"lower {bounds.get('lower', 0.0):g}, upper {bounds.get('upper', 0.0):g}",
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
    inertial = element.find("inertial")
    if inertial is None:
        return
    _check_origin(inertial, place)
    mass, inertia = inertial.find("mass"), inertial.find("inertia")
    if mass is not None and mass.get("value") is not None:
        _check_size("mass", _numbers(mass, "value", place, 1)[0], HEAVIEST_KG, "kg", place)
        if _numbers(mass, "value", place, 1)[0] < 0.0:
            raise RobotError("the mass is negative", where=place, found=mass.get("value"))
    for key in _MOMENTS if inertia is not None else ():
        if inertia is not None and key in inertia.attrib:
            _check_size(key, _numbers(inertia, key, place, 1)[0], LARGEST_KG_M2, "kg·m²", place)


def check_rows(rows: Sequence[DhRow]) -> None:
    """Refuse Denavit-Hartenberg rows that no arm can have.

    Raises:
        RobotError: naming row and key.
    """
    for number, row in enumerate(rows, 1):
        place = f"robot.dh, row {number}"
        for key in ("d", "a"):
            _check_size(key, getattr(row, key), LONGEST_M, "m", place)
        for value in row.com_m or ():
            _check_size("com_m", value, LONGEST_M, "m", place)
        _check_size("mass_kg", row.mass_kg or 0.0, HEAVIEST_KG, "kg", place)
        for value in row.inertia_kg_m2 or ():
            _check_size("inertia_kg_m2", value, LARGEST_KG_M2, "kg·m²", place)


def _check_origin(element: ET.Element, place: str) -> None:
    origin = element.find("origin")
    if origin is None:
        return
    for key in ("xyz", "rpy"):
        if origin.get(key) is not None:
            values = _numbers(origin, key, place, 3)
            if key == "xyz":
                _check_size("origin xyz", math.hypot(*values), LONGEST_M, "m", place)


def _numbers(element: ET.Element, key: str, place: str, count: int) -> list[float]:
    text = element.get(key, "")
    try:
        values = [float(word) for word in text.split()]
    except ValueError:
        values = []
    if len(values) != count or not all(map(math.isfinite, values)):
        what = "a finite number" if count == 1 else f"{count} finite numbers"
        raise RobotError(f"{element.tag} {key} is not {what}", where=place, found=text[:60], expected=what)
    return values


def _check_size(what: str, value: float, largest: float, unit: str, place: str) -> None:
    if abs(value) > largest:
        raise RobotError(
            f"{what} is beyond what an arm can have",
            where=place,
            found=f"{value:g} {unit}",
            expected=f"at most {largest:g} {unit}",
            hint="check the unit: lengths are in m, masses in kg, moments of inertia in kg·m²",
        )
