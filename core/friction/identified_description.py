"""The description that a fit leads to, for simulators: bodies, rotors, friction, and where they hold; URDF or MJCF.

Of a URDF the document is kept and its bodies are replaced; MuJoCo's MJCF is written anew, with gravity as mounted.
"""

from __future__ import annotations

import json
import xml.etree.ElementTree as ET
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

import msgspec
import numpy as np
from scipy.spatial.transform import Rotation

from collaudit.core.config.schema import Config, ToolConfig
from collaudit.core.data.audit_result import FrictionFile
from collaudit.core.data.friction_result import FrictionFit
from collaudit.core.errors import CollauditError, ConfigError, RobotError
from collaudit.core.friction.friction_model import FrictionModel
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.prepare.calibration import Calibration, calibrated_robot
from collaudit.core.robot.pinocchio_model import about_centre, mjcf_model
from collaudit.core.robot.robot_building import build_described, build_robot
from collaudit.core.robot.robot_description import description_of
from collaudit.core.robot.robot_model import RobotModel
from collaudit.core.robot.urdf_file import expanded
from collaudit.core.small_files import read_small

#: The written model's torque may differ by this, N·m, plus rounding of so many units of the largest torque.
_SAME_NM, _ROUNDING = 1e-9, 1e-12
_POSES = 200
#: Speeds at which the line of ``<dynamics>`` is fitted to a law.
_SPEEDS = 50
#: Namespace of what Drake reads in a transmission.
_DRAKE = "http://drake.mit.edu"


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


def identified_urdf(friction: FrictionFile, config: Config, base_dir: Path) -> bytes:
    """The URDF of the configuration with what was fitted, and with the tool as it is stated now.

    Args:
        friction: of this arm.
        config: its description and tool.
        base_dir: folder that the description's path starts from.

    Raises:
        ConfigError: the robot is not described by a URDF. RobotError: a body cannot be stated.
        CollauditError: what was written does not give the same torque.
    """
    if config.robot.urdf is None:
        raise ConfigError("only a robot that a URDF describes is written as one", expected="--urdf, or [robot] urdf")
    where = str(config.robot.urdf)
    data = expanded(read_small(base_dir / config.robot.urdf), base_dir / config.robot.urdf, where)
    joints = tuple(friction.joints)
    robot = _fitted_robot(friction, config, base_dir)
    bare = msgspec.structs.replace(config.robot, tool=ToolConfig(), armature_kg_m2=None)

    def merged(document: bytes) -> dict[str, FloatArray]:
        return _bodies(build_described(bare, description_of(document, where), joints))

    rotors = dict(zip(robot.inertial_bodies().joint_names, robot.armature.tolist(), strict=True))
    root = _with_bodies(data, _bodies(robot), merged)
    _add_dynamics(root, {name: _drive_dynamics(friction.joints.get(name), rotor) for name, rotor in rotors.items()})
    written = _document(root, _fitted_words(friction, robot, rotors) + _read_again(robot, rotors))
    given = msgspec.structs.replace(bare, armature_kg_m2={name: rotors[name] for name in robot.joint_names})
    _check_torque(robot, build_described(given, description_of(written, where), joints), where)
    return written


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
    robot = _fitted_robot(friction, config, base_dir)
    bodies = robot.inertial_bodies()
    if len(bodies.joint_names) != len(robot.joint_names):
        raise RobotError("an arm with joints that follow others, or are held, is not written as MJCF")
    root = ET.Element("mujoco", model="arm")
    rotors = dict(zip(bodies.joint_names, bodies.armature.tolist(), strict=True))
    root.append(ET.Comment("\n" + _fitted_words(friction, robot, rotors).replace("--", "- -") + "\n"))
    ET.SubElement(root, "compiler", angle="radian")
    ET.SubElement(root, "option", gravity=_numbers(robot.gravity_base_m_s2))
    placed = [ET.SubElement(root, "worldbody")]
    for name, link, ten in zip(bodies.joint_names, bodies.links, bodies.link_inertials(), strict=True):
        turn = Rotation.from_matrix(np.reshape(link.rotation, (3, 3))).as_quat(scalar_first=True)
        pose = {"pos": _numbers(link.translation_m), "quat": _numbers(turn)}
        body = ET.SubElement(placed[link.parent + 1], "body", {"name": f"{name}_body", **pose})
        body.append(_mjcf_inertial(name, ten))
        drive = _drive_dynamics(friction.joints.get(name), rotors[name])
        body.append(_mjcf_joint(name, "slide" if link.prismatic else "hinge", drive))
        placed.append(body)
    ET.indent(root)
    written = ET.tostring(root, encoding="unicode").encode()
    with TemporaryDirectory() as folder:
        path = Path(folder) / "arm.xml"
        path.write_bytes(written)
        again = mjcf_model(path).under_gravity(robot.gravity_base_m_s2)
    _check_torque(robot, replace(robot, bodies=again), str(config.robot.urdf or "[[robot.dh]]"))
    return written


def _fitted_robot(friction: FrictionFile, config: Config, base_dir: Path) -> RobotModel:
    """The arm as described, with what was fitted and the tool as it is stated now."""
    described = build_robot(config.robot, base_dir, tuple(friction.joints))
    return calibrated_robot(described, Calibration.of(friction, config), config, with_wrench=False)[0]


def _bodies(robot: RobotModel) -> dict[str, FloatArray]:
    """Joint to the ten inertial parameters of what it moves."""
    bodies = robot.bodies
    assert bodies is not None  # of a URDF there are
    return dict(zip(bodies.joint_names, bodies.inertial_parameters().reshape(-1, 10), strict=True))


def _drive_dynamics(fit: FrictionFit | None, rotor_kg_m2: float) -> JointDynamics:
    """Coulomb and viscous friction nearest to a law between its slowest and fastest speed; neither is negative."""
    law = None if fit is None or fit.effort_unit == "raw" else FrictionModel.of(fit)
    if law is None:
        return JointDynamics(None, 0.0, rotor_kg_m2)
    speed = np.linspace(*law.speed_range, _SPEEDS)
    torque = law.torque(speed)
    slope = max(0.0, float(np.polynomial.polynomial.polyfit(speed, torque, 1)[1])) if np.ptp(speed) > 0 else 0.0
    return JointDynamics(max(0.0, float(np.mean(torque - slope * speed))), slope, rotor_kg_m2)


def _check_torque(robot: RobotModel, written: RobotModel, where: str) -> None:
    """Raise CollauditError where the model as written does not give the fitted torque."""
    random = np.random.default_rng(0)
    motion = random.uniform(-2.0, 2.0, (3, _POSES, len(robot.joint_names)))
    wanted = robot.inverse_dynamics(*motion)
    apart = float(np.abs(written.inverse_dynamics(*motion) - wanted).max())
    if not apart <= _SAME_NM + _ROUNDING * float(np.abs(wanted).max()):
        raise CollauditError(
            "the description as written does not give the fitted torque", where=where, found=f"{apart:g} N·m"
        )


def _fitted_words(friction: FrictionFile, robot: RobotModel, rotors: dict[str, float]) -> str:
    """What it was fitted on, where it holds, and what a description does not hold."""
    logs = [f"  {name} (sha256 {digest})" for name, digest in friction.provenance.logs.items()]
    known = {} if friction.identified is None else friction.identified.joints
    lines = [f"Written by collaudit {friction.provenance.collaudit} fit, from:", *logs, ""]
    for name in robot.joint_names:
        fit = friction.joints.get(name)
        speed, inertia = ("m/s", "kg") if name in robot.sliding else ("rad/s", "kg m2")
        rotor = f"rotor {rotors[name]:.6g} {inertia}" + _interval(known[name].armature_ci95 if name in known else None)
        if fit is None or fit.model is None or fit.speed_range_rad_s is None:
            lines.append(f"{name}: no friction fitted; {rotor}")
            continue
        values = (f"{key} {value:.6g}{_interval(fit.ci95.get(key))}" for key, value in fit.parameters.items())
        slow, fast = fit.speed_range_rad_s
        lines.append(f"{name}: {fit.model}, {slow:.3g} to {fast:.3g} {speed}: {', '.join(values)}; {rotor}")
    bodies = {} if friction.identified is None else friction.identified.bodies
    strange = [name for name, body in bodies.items() if not body.consistent]
    return "\n".join(
        [
            *lines,
            "",
            "In brackets: 95 % intervals. Friction here is the straight line nearest to each law over these speeds,",
            "and holds there only. Not in it: gains, constant offsets and springs that the fit found.",
            *([f"No rigid body has the inertials of: {', '.join(strange)}"] if strange else []),
        ]
    )


def _read_again(robot: RobotModel, rotors: dict[str, float]) -> str:
    armature = ", ".join(f"{json.dumps(name)} = {rotors[name]!r}" for name in robot.joint_names)
    return (
        "\nRotors stand in <transmission> as Drake reads them; others take them as armature.\n"
        "To read this file again: [robot] urdf = this file, without [robot.tool], which is part of it, and\n"
        f"armature_kg_m2 = {{ {armature} }}"
    )


def _interval(ends: tuple[float | None, float | None] | None) -> str:
    if ends is None:
        return ""
    low, high = ("open" if end is None else f"{end:.6g}" for end in ends)
    return f" [{low}, {high}]"


def _with_bodies(
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
            links[link].append(_urdf_inertial(own))
        elif np.abs(own).max() > 0.0:
            raise RobotError(
                "the identified body of the link has no mass that a URDF could state",
                where=link,
                found=f"{own[0]:.3g} kg",
                hint='fit with [fit] estimate = ["friction"], which leaves the description as it is',
            )
    return root


def _add_dynamics(root: ET.Element, joints: Mapping[str, JointDynamics]) -> None:
    """State friction in ``<dynamics>``, and rotors as Drake reads them: ``<transmission>``, gear ratio 1."""
    ET.register_namespace("drake", _DRAKE)
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
                tag = f"{{{_DRAKE}}}{key}"
                stated = actuator.find(tag)
                stated = ET.SubElement(actuator, tag) if stated is None else stated
                stated.set("value", repr(value))


def _document(root: ET.Element, comment: str) -> bytes:
    """The URDF as a file, with a comment at its head."""
    ET.indent(root)
    text = comment.replace("--", "- -")
    head = f'<?xml version="1.0"?>\n<!--\n{text}\n-->\n'
    return f"{head}{ET.tostring(root, encoding='unicode')}\n".encode()


def _urdf_inertial(ten: FloatArray) -> ET.Element:
    """``<inertial>`` of a body."""
    mass, centre, inertia = about_centre(ten)
    element = ET.Element("inertial")
    ET.SubElement(element, "origin", xyz=_numbers(centre), rpy="0 0 0")
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


def _mjcf_joint(name: str, kind: str, drive: JointDynamics) -> ET.Element:
    values = {"armature": drive.rotor_kg_m2, "damping": drive.damping, "frictionloss": drive.friction_nm or 0.0}
    numbers = {key: repr(value) for key, value in values.items()}
    return ET.Element("joint", {"name": name, "type": kind, "axis": "0 0 1", **numbers})


def _mjcf_inertial(name: str, ten: FloatArray) -> ET.Element:
    """Of ten parameters about the joint's origin; MJCF states the inertia about the centre of mass."""
    if ten[0] <= 0.0:
        raise RobotError("MJCF states no body without mass", where=name, found=f"{ten[0]:g} kg")
    mass, centre, about = about_centre(ten)
    full = about[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
    return ET.Element("inertial", mass=repr(mass), pos=_numbers(centre), fullinertia=_numbers(full))


def _numbers(values: FloatArray | Sequence[float]) -> str:
    return " ".join(repr(float(value)) for value in values)
