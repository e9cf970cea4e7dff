"""What it takes to accelerate the tool: the wrist sensor feels it, and it is no force on the environment."""

from __future__ import annotations

import numpy as np

from collaudit.core.robot.robot import RobotModel
from collaudit.core.series import FloatArray, UniformSeries

_NO_MASS_KG = 1e-12  # the centre of a body of no mass at all is not a number


def point_mass(mass_kg: float, first_kg_m: FloatArray) -> FloatArray:
    """(10,) inertial parameters of a point mass: mass, first moments (3,), inertia about the origin."""
    out = np.zeros(10)
    if mass_kg > 0:
        out[0], out[1:4] = mass_kg, first_kg_m
        inertia = (float(first_kg_m @ first_kg_m) * np.eye(3) - np.outer(first_kg_m, first_kg_m)) / mass_kg
        out[4:] = inertia[[0, 0, 1, 0, 1, 2], [0, 1, 1, 2, 2, 2]]
    return out


def tool_inertia_torque(
    series: UniformSeries, robot: RobotModel, frame: str, mass_kg: float, com_m: FloatArray
) -> FloatArray:
    """(n, j) N·m: joint torque J^T m·a of accelerating a point mass at ``com_m`` (3,) of a frame, without its weight.

    The inverse dynamics of an arm whose only mass is the tool, without gravity.

    Args:
        series: the motion; NaN where it is unknown.
        robot: with inertials.
        frame: of the model, where the tool is.
        mass_kg: of the tool, above 0.
        com_m: its centre in the frame.
    """
    assert robot.bodies is not None
    turn, place, body = robot.bodies.frame_in_joint(frame)
    parameters = np.zeros_like(robot.inertial_parameters)
    parameters[::10] = _NO_MASS_KG
    if body < 0:  # on the base, which does not move
        return np.zeros_like(series.position_rad)
    parameters[10 * body : 10 * body + 10] = point_mass(mass_kg, mass_kg * (turn @ com_m + place))
    only = robot.with_inertials(parameters, np.zeros_like(robot.armature)).weightless()
    return only.inverse_dynamics(series.position_rad, series.velocity_rad_s, series.acceleration_rad_s2)
