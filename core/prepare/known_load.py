"""A load that a log's arm carries, known before a fit or told by a judged log, and the torque that it adds."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from collaudit.core.config.schema import Config
from collaudit.core.errors import ConfigError, NotJudgedError
from collaudit.core.findings import Finding
from collaudit.core.numeric.arrays import FloatArray, frozen
from collaudit.core.prepare.preparation import modelled
from collaudit.core.prepare.prepared import Prepared
from collaudit.core.robot.pinocchio_model import PointMass, point_mass_parameters
from collaudit.core.robot.robot_model import RobotModel


@dataclass(frozen=True, slots=True)
class KnownLoad:
    """A point mass that a log's arm carries beyond the configured tool.

    Attributes:
        mass_kg: 0 for none; below 0 the arm carries less than it was identified with.
        com_m: (3,) where, in the tool's frame.
    """

    mass_kg: float
    com_m: tuple[float, float, float] = (0.0, 0.0, 0.0)


def loaded(prepared: Prepared, load: KnownLoad, config: Config) -> Prepared:
    """The log with its load in the model's torque.

    Raises:
        NotJudgedError: the robot has no inertials. ConfigError: a detector that has no place for the load.
    """
    if not prepared.robot.has_inertials:
        raise NotJudgedError("a known load needs a robot with inertials", hint="give a URDF with <inertial> elements")
    if config.detect.detector != "direct":
        raise ConfigError(
            "known loads go with the direct detector only: the others have the torque of one arm",
            where="[detect] detector",
            found=config.detect.detector,
            expected="direct",
        )
    start = replace(prepared.start, load_nm=frozen(_load_torque(prepared, load)))
    return modelled(start, config, prepared.calibration)


def carrying(prepared: Prepared, load: KnownLoad, finding: Finding, config: Config) -> Prepared:
    """The log of an arm that carries the load, whatever the detector; the finding says so."""
    start = prepared.start
    robot = _carrying(start.robot, load)
    return modelled(replace(start, robot=robot, findings=(*start.findings, finding)), config, prepared.calibration)


def _load_torque(prepared: Prepared, load: KnownLoad) -> FloatArray:
    """(n, j) N·m that the load adds."""
    robot = prepared.robot
    body = PointMass(robot.tool_frame, load.mass_kg, load.com_m)
    return robot.load_torque(*prepared.series.motion, body)


def _carrying(robot: RobotModel, load: KnownLoad) -> RobotModel:
    """The arm with the load at its tool."""
    turn, place, body = robot.in_joint(None)
    parameters, size = robot.inertial_parameters, abs(load.mass_kg)
    added = point_mass_parameters(size, size * (turn @ np.array(load.com_m) + place))
    parameters[10 * body : 10 * body + 10] += np.copysign(1.0, load.mass_kg) * added
    return robot.with_inertials(parameters, robot.armature)
