"""The tool that a calibrated wrist sensor feels, carried by the arm's model too."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from collaudit.core.config.schema import Config
from collaudit.core.data.identification_result import SensorFacts
from collaudit.core.findings import Finding
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.prepare.prepared import Prepared
from collaudit.core.prepare.with_model import with_model
from collaudit.core.robot.robot_model import RobotModel


def with_calibrated_tool(prepared: Prepared, sensor: SensorFacts, config: Config) -> Prepared:
    """The same log with the calibrated tool in place of what the description hangs on the sensor.

    Args:
        prepared: the log; unchanged without a model.
        sensor: the calibration in use.
        config: says the described tool.
    """
    if prepared.rigid_nm is None:
        return prepared
    robot, mass, before = carrying(prepared.robot, sensor, config)
    text = (
        f"The model carries the tool that the wrist sensor was calibrated with, {mass:.3g} kg, in place of "
        f"{before:.3g} kg on file."
    )
    said = Finding("identified-used", "info", text, where="friction file")
    return with_model(replace(prepared, findings=(*prepared.findings, said)), robot, prepared.series)


def carrying(robot: RobotModel, sensor: SensorFacts, config: Config) -> tuple[RobotModel, float, float]:
    """The arm with the calibrated tool; its mass and the mass on file beyond the sensor, kg.

    Both are moved as point masses at their centres: a body of the right mass on file keeps its inertia.
    """
    assert robot.bodies is not None
    turn, place, body = robot.bodies.frame_in_joint(sensor.frame)
    centre = np.zeros(3) if sensor.com_m is None else np.array(sensor.com_m)
    mass, first = robot.bodies.beyond(sensor.frame)
    tool = config.robot.tool
    if not isinstance(tool.mass_kg, str) and tool.mass_kg > 0:
        own_turn, own_place, _ = robot.bodies.frame_in_joint(tool.frame or robot.bodies.frame_names[-1])
        mass += tool.mass_kg
        first = first + tool.mass_kg * (own_turn @ np.array(tool.com_m) + own_place)
    parameters = robot.inertial_parameters.copy()
    ten = parameters[10 * body : 10 * body + 10]
    ten += _point_mass(sensor.mass_kg, sensor.mass_kg * (turn @ centre + place)) - _point_mass(mass, first)
    return robot.with_inertials(parameters, robot.armature), sensor.mass_kg, mass


def _point_mass(mass_kg: float, first_kg_m: FloatArray) -> FloatArray:
    """(10,) inertial parameters of a point mass: mass, first moments (3,), inertia about the origin."""
    out = np.zeros(10)
    if mass_kg > 0:
        out[0], out[1:4] = mass_kg, first_kg_m
        inertia = (float(first_kg_m @ first_kg_m) * np.eye(3) - np.outer(first_kg_m, first_kg_m)) / mass_kg
        out[4:] = inertia[[0, 0, 1, 0, 1, 2], [0, 1, 1, 2, 2, 2]]
    return out
