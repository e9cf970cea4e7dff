"""The description that a fit leads to, as MuJoCo's MJCF: bodies, rotors, friction, gravity as mounted."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from collaudit.core.config.schema import Config
from collaudit.core.data.audit_result import FrictionFile
from collaudit.core.errors import RobotError
from collaudit.core.friction.identified_urdf import check_torque, drive_dynamics, fitted_robot, fitted_words
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.robot.pinocchio_model import about_centre, mjcf_model
from collaudit.core.robot.urdf_inertials import JointDynamics


def identified_mjcf(friction: FrictionFile, config: Config, base_dir: Path) -> bytes:
    """The arm as it was fitted, with the tool as it is stated now; it has no shapes.

    Args:
        friction: of this arm.
        config: its description and tool.
        base_dir: folder that the description's path starts from.

    Raises:
        RobotError: a joint follows another, or a body has no mass: MJCF does not state these alike.
        CollauditError: what was written does not give the same torque.
    """
    robot = fitted_robot(friction, config, base_dir)
    bodies = robot.inertial_bodies()
    if len(bodies.joint_names) != len(robot.joint_names):
        raise RobotError("an arm with joints that follow others, or are held, is not written as MJCF")
    root = ET.Element("mujoco", model="arm")
    rotors = dict(zip(bodies.joint_names, bodies.armature.tolist(), strict=True))
    root.append(ET.Comment("\n" + fitted_words(friction, robot, rotors).replace("--", "- -") + "\n"))
    ET.SubElement(root, "compiler", angle="radian")
    ET.SubElement(root, "option", gravity=_numbers(robot.gravity_base_m_s2))
    placed = [ET.SubElement(root, "worldbody")]
    for name, link, ten in zip(bodies.joint_names, bodies.links, bodies.link_inertials(), strict=True):
        pose = {"pos": _numbers(link.translation_m), "quat": _numbers(_quaternion(link.rotation))}
        body = ET.SubElement(placed[link.parent + 1], "body", {"name": f"{name}_body", **pose})
        body.append(_inertial(name, ten))
        drive = drive_dynamics(friction.joints.get(name), rotors[name])
        body.append(_joint(name, "slide" if link.prismatic else "hinge", drive))
        placed.append(body)
    ET.indent(root)
    written = ET.tostring(root, encoding="unicode").encode()
    with TemporaryDirectory() as folder:
        path = Path(folder) / "arm.xml"
        path.write_bytes(written)
        again = mjcf_model(path).under_gravity(robot.gravity_base_m_s2)
    check_torque(robot, replace(robot, bodies=again), str(config.robot.urdf or "[[robot.dh]]"))
    return written


def _joint(name: str, kind: str, drive: JointDynamics) -> ET.Element:
    values = {"armature": drive.rotor_kg_m2, "damping": drive.damping, "frictionloss": drive.friction_nm or 0.0}
    numbers = {key: repr(value) for key, value in values.items()}
    return ET.Element("joint", {"name": name, "type": kind, "axis": "0 0 1", **numbers})


def _inertial(name: str, ten: FloatArray) -> ET.Element:
    """Of ten parameters about the joint's origin; MJCF states the inertia about the centre of mass."""
    if ten[0] <= 0.0:
        raise RobotError("MJCF states no body without mass", where=name, found=f"{ten[0]:g} kg")
    mass, centre, about = about_centre(ten)
    full = about[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
    return ET.Element("inertial", mass=repr(mass), pos=_numbers(centre), fullinertia=_numbers(full))


def _quaternion(rotation: Sequence[float]) -> FloatArray:
    """(4,) w, x, y, z of a rotation matrix, row by row."""
    from scipy.spatial.transform import Rotation

    return np.asarray(Rotation.from_matrix(np.reshape(rotation, (3, 3))).as_quat(scalar_first=True))


def _numbers(values: FloatArray | Sequence[float]) -> str:
    return " ".join(repr(float(value)) for value in values)
