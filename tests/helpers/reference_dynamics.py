"""Dynamics one sample at a time through Pinocchio: what the recursions are tested against."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pinocchio as pin

from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.robot.pinocchio_model import PinocchioModel

#: From the numbers of a sample to those of its result.
Sample = Callable[[FloatArray], FloatArray]


def inverse_dynamics(model: PinocchioModel) -> Sample:
    """From q, v, a to joint torques."""
    own = model.library_model()
    data = own.createData()
    return lambda x: np.array(pin.rnea(own, data, *np.split(x, 3)))


def momentum(model: PinocchioModel) -> Sample:
    """From q, v to M(q) v, then C(q, v)^T v - G(q)."""
    own = model.library_model()
    data = own.createData()

    def sample(x: FloatArray) -> FloatArray:
        q, v = np.split(x, 2)
        upper = np.triu(pin.crba(own, data, q))
        mass = upper + np.triu(upper, 1).T
        rest = pin.computeCoriolisMatrix(own, data, q, v).T @ v - pin.computeGeneralizedGravity(own, data, q)
        return np.concatenate([mass @ v, rest])

    return sample


def force(model: PinocchioModel, frame: str) -> Sample:
    """From q and a wrench in a frame to J^T F."""
    count, number, own = len(model.joint_names), model.frame_number(frame), model.library_model()
    data = own.createData()
    return lambda x: np.array(pin.computeFrameJacobian(own, data, x[:count], number, pin.LOCAL).T @ x[count:])


def weight(model: PinocchioModel, frame: str, mass_kg: float, com_m: FloatArray, gravity_m_s2: FloatArray) -> Sample:
    """From q to the weight (6,) of a point mass at ``com_m`` of a frame, there."""
    number, work = model.frame_number(frame), model.forward()

    def sample(q: FloatArray) -> FloatArray:
        weight_n = work.at(number, q, np.asarray(com_m))[0].T @ (mass_kg * np.asarray(gravity_m_s2))
        return np.concatenate([weight_n, np.cross(com_m, weight_n)])

    return sample
