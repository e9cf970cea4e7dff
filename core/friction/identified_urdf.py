"""The description that a fit leads to, as a URDF for simulators: bodies, rotors, friction, and where they hold."""

from __future__ import annotations

import json
from pathlib import Path

import msgspec
import numpy as np

from collaudit.core.config.schema import Config, ToolConfig
from collaudit.core.data.audit_result import FrictionFile
from collaudit.core.data.friction_result import FrictionFit
from collaudit.core.errors import CollauditError, ConfigError
from collaudit.core.friction.friction_model import FrictionModel
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.prepare.calibration import Calibration, calibrated_robot
from collaudit.core.robot.robot_building import build_described, build_robot
from collaudit.core.robot.robot_description import description_of
from collaudit.core.robot.robot_model import RobotModel
from collaudit.core.robot.urdf_file import expanded
from collaudit.core.robot.urdf_inertials import JointDynamics, add_dynamics, document, with_bodies
from collaudit.core.small_files import read_small

#: The written model's torque may differ by this, N·m, plus rounding of so many units of the largest torque.
_SAME_NM, _ROUNDING = 1e-9, 1e-12
_POSES = 200
#: Speeds at which the line of ``<dynamics>`` is fitted to a law.
_SPEEDS = 50


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
    robot = fitted_robot(friction, config, base_dir)
    bare = msgspec.structs.replace(config.robot, tool=ToolConfig(), armature_kg_m2=None)

    def merged(document: bytes) -> dict[str, FloatArray]:
        return _bodies(build_described(bare, description_of(document, where), joints))

    rotors = dict(zip(robot.inertial_bodies().joint_names, robot.armature.tolist(), strict=True))
    root = with_bodies(data, _bodies(robot), merged)
    add_dynamics(root, {name: drive_dynamics(friction.joints.get(name), rotor) for name, rotor in rotors.items()})
    written = document(root, fitted_words(friction, robot, rotors) + _read_again(robot, rotors))
    given = msgspec.structs.replace(bare, armature_kg_m2={name: rotors[name] for name in robot.joint_names})
    check_torque(robot, build_described(given, description_of(written, where), joints), where)
    return written


def fitted_robot(friction: FrictionFile, config: Config, base_dir: Path) -> RobotModel:
    """The arm as described, with what was fitted and the tool as it is stated now."""
    described = build_robot(config.robot, base_dir, tuple(friction.joints))
    return calibrated_robot(described, Calibration.of(friction, config), config, with_wrench=False)[0]


def _bodies(robot: RobotModel) -> dict[str, FloatArray]:
    """Joint to the ten inertial parameters of what it moves."""
    bodies = robot.bodies
    assert bodies is not None  # of a URDF there are
    return dict(zip(bodies.joint_names, bodies.inertial_parameters().reshape(-1, 10), strict=True))


def drive_dynamics(fit: FrictionFit | None, rotor_kg_m2: float) -> JointDynamics:
    """Coulomb and viscous friction nearest to a law between its slowest and fastest speed; neither is negative."""
    law = None if fit is None or fit.effort_unit == "raw" else FrictionModel.of(fit)
    if law is None:
        return JointDynamics(None, 0.0, rotor_kg_m2)
    speed = np.linspace(*law.speed_range, _SPEEDS)
    torque = law.torque(speed)
    slope = max(0.0, float(np.polynomial.polynomial.polyfit(speed, torque, 1)[1])) if np.ptp(speed) > 0 else 0.0
    return JointDynamics(max(0.0, float(np.mean(torque - slope * speed))), slope, rotor_kg_m2)


def check_torque(robot: RobotModel, written: RobotModel, where: str) -> None:
    """Raise CollauditError where the model as written does not give the fitted torque."""
    random = np.random.default_rng(0)
    motion = random.uniform(-2.0, 2.0, (3, _POSES, len(robot.joint_names)))
    wanted = robot.inverse_dynamics(*motion)
    apart = float(np.abs(written.inverse_dynamics(*motion) - wanted).max())
    if not apart <= _SAME_NM + _ROUNDING * float(np.abs(wanted).max()):
        raise CollauditError(
            "the description as written does not give the fitted torque", where=where, found=f"{apart:g} N·m"
        )


def fitted_words(friction: FrictionFile, robot: RobotModel, rotors: dict[str, float]) -> str:
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
