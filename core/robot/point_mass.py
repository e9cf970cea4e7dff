"""A point mass among a body's inertial parameters."""

from __future__ import annotations

import numpy as np

from collaudit.core.numeric.arrays import FloatArray


def point_mass_parameters(mass_kg: float, first_kg_m: FloatArray) -> FloatArray:
    """(10,) inertial parameters of a point mass, in the order of ``RobotModel.torque_regressor``.

    Mass m, first moments h = m c, and the inertia about the origin (h·h 1 - h h^T) / m as xx, xy, yy, xz, yz, zz.

    Args:
        mass_kg: zero or less stands for no mass, all parameters zero.
        first_kg_m: (3,) mass times position.
    """
    out = np.zeros(10)
    if mass_kg > 0:
        out[0], out[1:4] = mass_kg, first_kg_m
        inertia = (float(first_kg_m @ first_kg_m) * np.eye(3) - np.outer(first_kg_m, first_kg_m)) / mass_kg
        out[4:] = inertia[[0, 0, 1, 0, 1, 2], [0, 1, 1, 2, 2, 2]]
    return out
