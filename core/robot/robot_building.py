"""From a configuration to a RobotModel: description, locked joints, tool, rotor inertia, findings.

Also other descriptions that lie beside the configured one and have the log's joints.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Iterator, Mapping, Sequence, Set
from pathlib import Path

import numpy as np

from collaudit.core.config.schema import RobotConfig
from collaudit.core.data.joint_log import JointType
from collaudit.core.errors import CollauditError, RobotError
from collaudit.core.findings import Finding
from collaudit.core.findings.finding_kinds import Severity
from collaudit.core.numeric.arrays import FloatArray, frozen
from collaudit.core.robot.pinocchio_model import PinocchioModel, PointMass, dh_model, rotation_rpy, urdf_model
from collaudit.core.robot.robot_description import Description, describe_robot, dh_names, joint_values, unknown_name
from collaudit.core.robot.robot_model import RobotModel
from collaudit.core.robot.urdf_file import JointFacts
from collaudit.core.vendors.vendor_words import GRIPPER

#: Standard gravity in the world, m/s²; [robot] base_rpy_deg says how the arm stands in it.
GRAVITY_M_S2 = (0.0, 0.0, -9.80665)


def build_robot(config: RobotConfig, base_dir: Path, joints: Sequence[str]) -> RobotModel:
    """Build the rigid-body model for the joints a log has.

    Args:
        config: the ``[robot]`` table.
        base_dir: folder that relative paths start from.
        joints: the log's joints that the model has, in any order; model order is restored. Other movable joints are
            locked at zero, with finding ``model-joint-missing``, and so are a gripper's that the table does not name.

    Returns:
        The model; without any robot description, one that knows the joint names only.

    Raises:
        RobotError: the description, or a name in the configuration, cannot be used.
    """
    description = describe_robot(config, base_dir)
    return _bare_model(config, joints) if description is None else build_described(config, description, joints)


def build_described(config: RobotConfig, description: Description, joints: Sequence[str]) -> RobotModel:
    """:func:`build_robot` of a description that was read; the table's own is not looked at.

    Raises:
        RobotError: a name in the configuration or of the log is not the description's.
    """
    known = description.movable
    movable, logged = frozenset(known), frozenset(joints)
    for where, names in (("robot.joints", config.joints or ()), ("joints of the log", joints)):
        for name in names:
            if name not in movable:
                raise unknown_name("the robot has no such joint", where, name, known)
    if not joints:
        raise RobotError("no joint of the log is a joint of the robot", where=description.where)
    kept = tuple(joint for joint in description.joints if joint.name in logged)
    arm = tuple(joint for joint in kept if not GRIPPER.search(joint.name))
    return _model(config, description, arm if arm and config.joints is None else kept, kept)


def _model(
    config: RobotConfig, description: Description, kept: tuple[JointFacts, ...], logged: tuple[JointFacts, ...]
) -> RobotModel:
    names = tuple(joint.name for joint in kept)
    whole = _whole(description)
    led = frozenset(names)
    follow = [joint for joint in description.joints if joint.leader in led]
    moving = {*names, *(joint.name for joint in follow)}
    _check_parked(config, description, moving)
    at = {**dict.fromkeys((joint.name for joint in description.joints), 0.0), **config.parked}
    still = [joint for joint in description.joints if joint.name not in moving]
    locked = {j.name: at[j.name] if j.leader is None else j.multiplier * at[j.leader] + j.offset for j in still}
    parked = tuple(joint.name for joint in still if {joint.name, joint.leader} & config.parked.keys())
    base_gravity = rotation_rpy(config.base_rpy_deg).T @ np.array(GRAVITY_M_S2)
    model = whole.locked(locked).under_gravity(base_gravity)
    expansion, offset = _expansion(model.joint_names, names, follow)
    given = {} if config.armature_kg_m2 is None else config.armature_kg_m2
    rotors = joint_values(given, "armature_kg_m2", config, names, description.movable, 0.0)
    armature = dict(zip(names, rotors, strict=True))
    spins = np.array([armature.get(name, 0.0) for name in model.joint_names])
    model = model.with_parameters(model.inertial_parameters(), spins)
    has_inertials, findings = _inertial_findings(description, model)
    gripper = [joint.name for joint in logged if joint.name not in names]
    with_it = {*gripper, *(joint.name for joint in description.joints if joint.leader in gripper)}
    absent = {name: at for name, at in locked.items() if name not in with_it}
    if gripper:
        findings = (*findings, _of_a_gripper(gripper, description.where))
    if absent:
        findings = (*findings, *_locked_findings(description, absent, parked, names, whole))
    tool, tool_findings = _add_tool(config, model, kept[-1].link)
    return RobotModel(
        joint_names=names,
        joint_types=tuple(joint.kind for joint in kept),
        effort_limit_nm=frozen(np.array([joint.effort_limit for joint in kept])),
        position_limits=frozen(np.array([[joint.lower, joint.upper] for joint in kept])),
        speed_limits=frozen(np.array([joint.speed_limit for joint in kept])),
        has_inertials=has_inertials,
        sha256=_sha256(config, description.content_sha256),
        findings=(*findings, *tool_findings),
        gravity_base_m_s2=frozen(base_gravity),
        tool=tool,
        bodies=model,
        expansion=frozen(expansion),
        offset=frozen(offset),
        weightless=_weightless(model, names) if has_inertials else {},
        tool_frame=config.tool.frame or kept[-1].link,
    )


def _weightless(model: PinocchioModel, names: Sequence[str]) -> dict[str, tuple[str, ...]]:
    """Links of the log's joints that have no mass, after the tool was added, with the joints that carry them."""
    empty = [name for name, mass, _ in model.bodies() if mass <= 0.0 and name in names]
    return {name: tuple(joint for joint in model.path(name) if joint in names) for name in empty}


def _check_parked(config: RobotConfig, description: Description, moving: Set[str]) -> None:
    for name in config.parked:
        if name not in description.movable:
            raise unknown_name("the robot has no such joint", "robot.parked", name, description.movable)
        if name in moving:
            raise RobotError("a parked joint is in the log", where="robot.parked", found=name)


def _whole(description: Description) -> PinocchioModel:
    if description.urdf_xml is not None:
        return urdf_model(description.urdf_xml, description.where)
    return dh_model(description.rows, dh_names(description.rows), description.convention or "standard")


def _expansion(
    model_names: Sequence[str], names: Sequence[str], follow: Sequence[JointFacts]
) -> tuple[FloatArray, FloatArray]:
    """Model joints from the log's joints: order restored, mimicking joints following their leaders."""
    expansion, offset = np.zeros((len(model_names), len(names))), np.zeros(len(model_names))
    rows = {name: row for row, name in enumerate(model_names)}
    columns = {name: column for column, name in enumerate(names)}
    for name, column in columns.items():
        expansion[rows[name], column] = 1.0
    for joint in follow:
        row = rows[joint.name]
        expansion[row, columns[joint.leader or ""]] = joint.multiplier
        offset[row] = joint.offset
    return expansion, offset


def _add_tool(
    config: RobotConfig, model: PinocchioModel, last_link: str
) -> tuple[PointMass | None, tuple[Finding, ...]]:
    settings = config.tool
    frame = settings.frame or last_link
    if frame not in model.frame_names:
        raise unknown_name("the robot has no such frame", "robot.tool.frame", frame, model.frame_names)
    if settings.mass_kg == "estimate":
        text = (
            "The tool's mass is to be estimated: collaudit fit puts it into the friction file, and a judged log adds "
            "what it tells of a load; what tells none is judged without."
        )
        return None, (Finding("model-approximate", "warning", text, where="robot.tool.mass_kg"),)
    if not settings.mass_kg:
        return None, ()
    if 0.0 < model.mass_kg < settings.mass_kg:
        raise RobotError(
            "the tool is heavier than the whole robot",
            where="robot.tool.mass_kg",
            found=f"{settings.mass_kg:g} kg",
            expected=f"less than the {model.mass_kg:.3g} kg of the robot's description",
            hint="state the mass in kg, not in g; or correct the masses of the description",
        )
    tool = PointMass(frame, settings.mass_kg, settings.com_m)
    model.add_point_mass(tool)
    return tool, ()


def _bare_model(config: RobotConfig, joints: Sequence[str]) -> RobotModel:
    text = (
        "No robot description is configured: no model torque can be computed, and nothing is judged. Give --urdf "
        "arm.urdf, or state [robot] in the configuration. Friction can be fitted from pairs of directions only."
    )
    names, nothing = tuple(joints), np.full(len(joints), math.nan)
    kinds: tuple[JointType, ...] = tuple("revolute" for _ in names)
    return RobotModel(
        joint_names=names,
        joint_types=kinds,
        effort_limit_nm=frozen(nothing),
        position_limits=frozen(np.column_stack([nothing, nothing])),
        speed_limits=frozen(nothing),
        has_inertials=False,
        sha256=_sha256(config, None),
        findings=(Finding("model-approximate", "warning", text, where="robot"),),
        gravity_base_m_s2=frozen(rotation_rpy(config.base_rpy_deg).T @ np.array(GRAVITY_M_S2)),
        tool=None,
        bodies=None,
        expansion=frozen(np.eye(len(names))),
        offset=frozen(np.zeros(len(names))),
    )


def _sha256(config: RobotConfig, content: str | None) -> str:
    """Hash of everything that changes the model and of nothing else: no paths."""
    # what brings a log to the joints is no part of the model; it counts where it is stated, as another arm's would
    log_side = {"reduction", "joint_offset_rad", "motor_side"}
    left_out = {"urdf", "dh", "dh_convention", *(log_side - config.given)}
    settings = {name: value for name, value in config.plain().items() if name not in left_out}
    settings["gravity_m_s2"] = GRAVITY_M_S2  # was a setting; hashes in friction files stay what they are
    text = json.dumps([content, settings], sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()


def _inertial_findings(description: Description, model: PinocchioModel) -> tuple[bool, tuple[Finding, ...]]:
    """Whether torques can be computed at all, and what limits them. To be called before a tool is added."""
    where = description.where
    parts = model.bodies()
    links = {joint.name: joint.link for joint in description.joints}
    if all(mass <= 0.0 for _, mass, _ in parts):
        text = (
            "No link of the robot has a mass: no model torque can be computed, and nothing is judged. Friction can be "
            "fitted from pairs of directions only."
        )
        return False, (Finding("model-approximate", "warning", text, where=where),)
    odd = [links[name] for name, mass, inertia in parts if mass > 0.0 and not _possible(inertia)]
    points = [f"link{i}" for i, row in enumerate(description.rows, 1) if row.mass_kg and not row.inertia_kg_m2]
    limits: list[tuple[list[str], Severity, str]] = [
        (odd, "warning", f"No rigid body has the inertia given for: {', '.join(odd)}; it is used as it stands."),
        (points, "info", f"Links without inertia_kg_m2 are taken as point masses: {', '.join(points)}."),
    ]
    return True, tuple(Finding("model-approximate", how, text, where=where) for some, how, text in limits if some)


def _of_a_gripper(joints: Sequence[str], where: str) -> Finding:
    text = (
        f"Not judged, and held at zero, as their names are those of a gripper: {', '.join(joints)}. If they are the "
        "arm's, name all of its joints in [robot] joints."
    )
    return Finding("model-joint-missing", "warning", text, where=where)


#: A locked joint that moves less than this (a gripper's finger) changes no torque worth a warning, kg.
_LIGHT_KG = 0.2


def _locked_findings(
    description: Description,
    locked: Mapping[str, float],
    parked: Sequence[str],
    names: Sequence[str],
    whole: PinocchioModel,
) -> list[Finding]:
    """Which joints are held, and how much that matters.

    A joint between the base and a judged joint changes every torque after it; one beside or beyond them changes
    where its mass is. With one between judged joints, whose position is not known, no torque of theirs is known.

    Args:
        description: the robot's.
        locked: joints that are held, and where.
        parked: those of them whose place was stated, by themselves or by the joint that they follow.
        names: joints of the log.
        whole: the model with all joints free.
    """
    unstated = [name for name in locked if name not in parked]
    heavy = {name for name, mass, _ in whole.bodies() if mass >= _LIGHT_KG}
    sides = {name: whole.sides(name, names) for name in unstated}
    below = any(further_out for _, further_out in sides.values())
    stated = ", ".join(f"{name} at {locked[name]:.6g}" for name in locked if name in parked)
    text = f"Not in the log and held at zero: {', '.join(unstated)}." if unstated else ""
    text += f" Not in the log and parked as configured: {stated}." if stated else ""
    if below:
        text += " Torques are wrong if such a joint lies below the others and was not at zero."
    severe = below or any(name in heavy and any(sides[name]) for name in unstated)
    out = [Finding("model-joint-missing", "warning" if severe else "info", text.strip(), where=description.where)]
    for name in (name for name in unstated if all(sides[name])):
        text = (
            f"Joint '{name}' lies between joints of the log and is not in it: where it stood is not known, so no model "
            f"torque is, and nothing is judged. If it stood still: [robot.parked] {name} = its position."
        )
        out.append(Finding("model-joint-missing", "error", text, where=description.where, joint=name))
    return out


def _possible(inertia: FloatArray) -> bool:
    """Principal moments are not negative and obey the triangle inequality (to rounding in the file)."""
    moments = np.linalg.eigvalsh(inertia)
    slack = 1e-6 + 1e-3 * float(moments[2])
    return bool(moments[0] >= -slack and moments[0] + moments[1] >= moments[2] - slack)


#: A folder of a family has no more; each is a tenth of a second.
_MOST = 20


def sibling_robots(config: RobotConfig, base_dir: Path, joints: Sequence[str]) -> Iterator[tuple[str, RobotModel]]:
    """Name of the file and model, with the tool and the mounting that are stated, of each such description.

    Args:
        config: the ``[robot]`` table.
        base_dir: folder that relative paths start from.
        joints: of the log.
    """
    if config.urdf is None:
        return
    own = base_dir / config.urdf
    for path in sorted(own.parent.glob(f"*{own.suffix}"))[:_MOST]:
        if path.name == own.name:
            continue
        try:
            robot = build_robot(config.changed({"urdf": path}), base_dir, joints)
        except CollauditError:  # of other joints, or no description: nothing to try
            continue
        if robot.has_inertials and robot.joint_names == tuple(joints):
            yield path.name, robot
