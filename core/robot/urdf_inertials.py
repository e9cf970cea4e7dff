"""A URDF with other inertials, friction and rotor inertia: the document of a description, its bodies replaced."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from collaudit.core.errors import RobotError
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.robot.pinocchio_model import about_centre

#: Namespace of what Drake reads in a transmission.
DRAKE = "http://drake.mit.edu"


@dataclass(frozen=True, slots=True)
class JointDynamics:
    """What a joint adds to its rigid bodies.

    Attributes:
        friction_nm: for ``<dynamics friction>``, N·m (N if prismatic); None leaves the description's.
        damping: for ``<dynamics damping>``, N·m·s/rad (N·s/m).
        rotor_kg_m2: reflected rotor inertia, kg·m² (kg).
    """

    friction_nm: float | None
    damping: float
    rotor_kg_m2: float


def with_bodies(
    data: bytes, bodies: Mapping[str, FloatArray], merged: Callable[[bytes], Mapping[str, FloatArray]]
) -> ET.Element:
    """A URDF in which each joint moves another body.

    The link of a joint takes the whole body, those fixed to it lose theirs. Links behind a joint that is held keep
    theirs, which are a part of the body: the link has the rest.

    Args:
        data: the URDF.
        bodies: joint to (10,) mass, first moments, inertia about the joint's origin (xx, xy, yy, xz, yz, zz).
        merged: the bodies that the model of another URDF has, in the same form.

    Raises:
        RobotError: a body has moments and no mass, which no link states.
    """
    builder = ET.TreeBuilder(insert_comments=True)
    root = ET.fromstring(data, ET.XMLParser(target=builder))
    links = {link.get("name", ""): link for link in root.findall("link")}
    joints = root.findall("joint")
    fixed = [(_link(joint, "parent"), _link(joint, "child")) for joint in joints if joint.get("type") == "fixed"]
    moved = {joint.get("name", ""): _link(joint, "child") for joint in joints if joint.get("name") in bodies}
    for link in moved.values():
        rigid = [link]
        for one in rigid:  # grows while it is gone through
            rigid += [child for parent, child in fixed if parent == one]
        for name in rigid:
            for stated in links[name].findall("inertial"):
                links[name].remove(stated)
    rest = merged(ET.tostring(root))
    for joint, link in moved.items():
        own = np.asarray(bodies[joint]) - rest[joint]
        if own[0] > 0.0:
            links[link].append(_inertial(own))
        elif np.abs(own).max() > 0.0:
            raise RobotError(
                "the identified body of the link has no mass that a URDF could state",
                where=link,
                found=f"{own[0]:.3g} kg",
                hint='fit with [fit] estimate = ["friction"], which leaves the description as it is',
            )
    return root


def add_dynamics(root: ET.Element, joints: Mapping[str, JointDynamics]) -> None:
    """State friction in ``<dynamics>``, and rotors as Drake reads them: ``<transmission>``, gear ratio 1."""
    ET.register_namespace("drake", DRAKE)
    transmissions = {name: one for one in root.findall("transmission") if (name := _driven(one)) is not None}
    for element in root.findall("joint"):
        joint = joints.get(name := element.get("name", ""))
        if joint is None:
            continue
        if joint.friction_nm is not None:
            dynamics = element.find("dynamics")
            dynamics = ET.SubElement(element, "dynamics") if dynamics is None else dynamics
            dynamics.set("friction", repr(joint.friction_nm))
            dynamics.set("damping", repr(joint.damping))
        if joint.rotor_kg_m2 > 0.0:
            drive = transmissions.get(name)
            if drive is None:
                drive = ET.SubElement(root, "transmission", name=f"{name}_transmission")
                ET.SubElement(drive, "type").text = "transmission_interface/SimpleTransmission"
                ET.SubElement(drive, "joint", name=name)
            actuator = drive.find("actuator")
            actuator = ET.SubElement(drive, "actuator", name=f"{name}_motor") if actuator is None else actuator
            for key, value in (("gear_ratio", 1.0), ("rotor_inertia", joint.rotor_kg_m2)):
                tag = f"{{{DRAKE}}}{key}"
                stated = actuator.find(tag)
                stated = ET.SubElement(actuator, tag) if stated is None else stated
                stated.set("value", repr(value))


def document(root: ET.Element, comment: str) -> bytes:
    """The URDF as a file, with a comment at its head."""
    ET.indent(root)
    text = comment.replace("--", "- -")
    head = f'<?xml version="1.0"?>\n<!--\n{text}\n-->\n'
    return f"{head}{ET.tostring(root, encoding='unicode')}\n".encode()


def _inertial(ten: FloatArray) -> ET.Element:
    """``<inertial>`` of a body."""
    mass, centre, inertia = about_centre(ten)
    element = ET.Element("inertial")
    ET.SubElement(element, "origin", xyz=" ".join(repr(float(x)) for x in centre), rpy="0 0 0")
    ET.SubElement(element, "mass", value=repr(mass))
    six = {f"i{'xyz'[a]}{'xyz'[b]}": repr(float(inertia[a, b])) for a in range(3) for b in range(a, 3)}
    ET.SubElement(element, "inertia", six)
    return element


def _link(joint: ET.Element, which: str) -> str:
    found = joint.find(which)
    return "" if found is None else found.get("link", "")


def _driven(transmission: ET.Element) -> str | None:
    """The joint of a transmission of one."""
    joints = transmission.findall("joint")
    return joints[0].get("name") if len(joints) == 1 else None
