"""Reading a URDF: checked with messages that name the line, then normalised for the rigid-body library.

Normalising drops what only drawing needs (visual, collision), turns continuous joints into revolute ones without
limits (so that every joint has one position number), and states limits where a file has none. Numbers that no
arm can have are refused before a library computes with them.
"""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from collaudit.core.config.schema import DhRow
from collaudit.core.data.joint_log import JointType
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


def checked_joint(element: ET.Element, place: str) -> dict[str, list[float]]:
    """The numbers of a joint; refused where they are none, its axis has no direction, or its limits are swapped.

    Args:
        element: ``<joint>``.
        place: what messages call it.

    Returns:
        Those that are stated, by element and attribute: ``limit lower``.

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
    return stated


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


_KINDS = ("revolute", "continuous", "prismatic", "fixed")
_NO_LIMIT = "1e9"


@dataclass(frozen=True, slots=True)
class JointFacts:
    """One joint as described.

    Attributes:
        name: joint name.
        kind: revolute (also for URDF's continuous) or prismatic.
        link: the link it moves.
        lower, upper: position limits, rad or m; NaN where there are none.
        effort_limit: N·m or N; NaN where there is none.
        leader: the joint it mimics, or None.
        multiplier, offset: position = multiplier · leader + offset.
        speed_limit: rad/s or m/s; NaN where there is none.
        parent: the link it hangs on, of a URDF.
    """

    name: str
    kind: JointType
    link: str
    lower: float = math.nan
    upper: float = math.nan
    effort_limit: float = math.nan
    leader: str | None = None
    multiplier: float = 1.0
    offset: float = 0.0
    speed_limit: float = math.nan
    parent: str = ""


def read_urdf(data: bytes, where: str) -> tuple[tuple[JointFacts, ...], str]:
    """Parse and normalise a URDF.

    Args:
        data: the file's bytes.
        where: what messages call the file.

    Returns:
        The joints that move, depth first from the root in file order, and the normalised document.

    Raises:
        RobotError: not XML, not a URDF, an unexpanded xacro, or a joint that cannot be used.
    """
    root = _parse(data, where)
    links = [element.get("name", "") for element in root.findall("link")]
    joints = [_joint(element, where) for element in root.findall("joint")]
    fixed = {element.get("name") for element in root.findall("joint") if element.get("type") == "fixed"}
    if not links:
        raise RobotError("the URDF has no links", where=where)
    for element in root.findall("link"):
        check_link(element, f"{where}: link {element.get('name', '')!r}")
    base = _base(joints, set(links), where)
    for element in root.findall("joint"):
        _normalise_joint(element)
    for link in root.findall("link"):
        for drawing in [*link.findall("visual"), *link.findall("collision")]:
            link.remove(drawing)
    moving = tuple(joint for joint in _depth_first(joints, base) if joint.name not in fixed)
    return moving, ET.tostring(root, encoding="unicode")


def _parse(data: bytes, where: str) -> ET.Element:
    try:
        root = ET.fromstring(data)
    except ET.ParseError as error:
        line, column = error.position
        raise RobotError(
            "the robot description is not well-formed XML",
            where=f"{where}:{line}:{column + 1}",
            found=str(error).split(":")[0],
            expected="a URDF",
        ) from error
    if root.tag != "robot":
        raise RobotError("the file is XML, but not a URDF", where=where, found=f"<{root.tag}>", expected="<robot>")
    if any("xacro" in element.tag for element in root.iter()):
        raise RobotError(
            "the file is an unexpanded xacro",
            where=where,
            hint="expand it first: xacro arm.urdf.xacro > arm.urdf",
        )
    return root


def _joint(element: ET.Element, where: str) -> JointFacts:
    name, kind = element.get("name", ""), element.get("type", "")
    place = f"{where}: joint {name!r}"
    if kind not in _KINDS:
        raise RobotError("this kind of joint is not supported", where=place, found=kind, expected=", ".join(_KINDS))
    ends = [element.find(tag) for tag in ("parent", "child")]
    parent, child = (end.get("link") if end is not None else None for end in ends)
    if not name or parent is None or child is None:
        raise RobotError("a joint needs a name, a parent link and a child link", where=place)
    stated, mimic = checked_joint(element, place), element.find("mimic")
    (effort,), (speed,) = (stated.get(f"limit {key}", [math.nan]) for key in ("effort", "velocity"))
    bounds = [stated.get(f"limit {key}", [math.nan])[0] for key in ("lower", "upper")]
    lower, upper = bounds if kind in ("revolute", "prismatic") else (math.nan, math.nan)
    return JointFacts(
        name=name,
        kind="prismatic" if kind == "prismatic" else "revolute",
        parent=parent,
        link=child,
        lower=lower,
        upper=upper,
        effort_limit=effort if effort > 0 else math.nan,
        speed_limit=speed if speed > 0 else math.nan,
        leader=None if mimic is None else mimic.get("joint"),
        multiplier=stated.get("mimic multiplier", [1.0])[0],
        offset=stated.get("mimic offset", [0.0])[0],
    )


def _base(joints: list[JointFacts], links: set[str], where: str) -> str:
    """The link that all others hang on; RobotError where they do not form one tree."""
    names = Counter(joint.name for joint in joints)
    children = Counter(joint.link for joint in joints)
    for joint in joints:
        place = f"{where}: joint {joint.name!r}"
        for link in (joint.parent, joint.link):
            if link not in links:
                raise RobotError("a joint names a link that is not there", where=place, found=link)
        if names[joint.name] > 1:
            raise RobotError("two joints have the same name", where=place)
        if children[joint.link] > 1:
            raise RobotError("a link has two parents", where=place, found=joint.link)
        if joint.leader is not None and joint.leader not in names:
            raise RobotError("a joint mimics one that is not there", where=place, found=joint.leader)
    roots = links - set(children)
    if len(roots) != 1:
        found = ", ".join(sorted(roots)) or "none (the joints form a loop)"
        raise RobotError("the links do not form one tree", where=where, found=f"root links: {found}")
    return roots.pop()


def _depth_first(joints: Sequence[JointFacts], link: str) -> Iterator[JointFacts]:
    """The joints from a link outwards, those of one branch together."""
    for joint in joints:
        if joint.parent == link:
            yield joint
            yield from _depth_first(joints, joint.link)


def _normalise_joint(element: ET.Element) -> None:
    for mimic in element.findall("mimic"):
        element.remove(mimic)
    if element.get("type") == "continuous":
        element.set("type", "revolute")
        for limit in element.findall("limit"):
            element.remove(limit)
    if element.get("type") in ("revolute", "prismatic"):
        found = element.find("limit")
        limit = ET.SubElement(element, "limit") if found is None else found
        for key, default in (("lower", f"-{_NO_LIMIT}"), ("upper", _NO_LIMIT), ("effort", "0"), ("velocity", "0")):
            limit.set(key, limit.get(key, default))


#: How a tag of xacro begins; its namespace alone is left in many expanded files.
_TAG = b"<xacro:"


def expanded(data: bytes, path: Path, where: str) -> bytes:
    """The URDF of a description; unchanged where it is no xacro.

    Files that it includes are looked for beside it, and in packages among the folders above.

    Args:
        data: the file's bytes.
        path: the file.
        where: what messages call it.

    Raises:
        RobotError: xacrodoc is not installed, or the file cannot be expanded.
    """
    if _TAG not in data:
        return data
    try:
        from xacrodoc import XacroDoc, packages
    except ImportError as error:
        raise RobotError(
            "the file is an unexpanded xacro",
            where=where,
            hint="install what expands it: pip install 'collaudit[xacro]'; or run: xacro arm.urdf.xacro > arm.urdf",
        ) from error
    try:
        packages.walk_up_from(str(path))
        # included, not read: what it includes itself is then looked for beside it
        whole = XacroDoc.from_includes([str(path.resolve())], resolve_packages=False)
        return bytes(whole.to_urdf_string(), "utf-8")
    except Exception as error:  # xacro raises what the fault happens to cause
        raise RobotError(
            "the xacro cannot be expanded", where=where, found=f"{type(error).__name__}: {str(error)[:200]}"
        ) from error
