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
    work = model.workspace()
    return lambda x: np.array(work.inverse_dynamics(*np.split(x, 3)))


def momentum(model: PinocchioModel) -> Sample:
    """From q, v to M(q) v, then C(q, v)^T v - G(q)."""
    work = model.workspace()

    def sample(x: FloatArray) -> FloatArray:
        q, v = np.split(x, 2)
        mass = work.mass_matrix(q)
        rest = work.coriolis_matrix(q, v).T @ v - work.gravity_torque(q)
        return np.concatenate([mass @ v, rest])

    return sample


def only_point_mass(model: PinocchioModel, frame: str, mass_kg: float, com_m: FloatArray) -> PinocchioModel:
    """The arm under no gravity, without rotors and without any mass but a point at ``com_m`` (3,) of a frame."""
    alone = model.without_gravity()
    alone.set_armature(np.zeros(model.joint_count))
    for k in range(len(alone._model.inertias)):
        alone._model.inertias[k] = pin.Inertia.Zero()
    alone.add_point_mass(frame, mass_kg, com_m)
    return alone


def force(model: PinocchioModel, frame: str, carried: tuple[str, float, FloatArray] | None) -> Sample:
    """From q (with ``carried`` also v and a) and a wrench in a frame to J^T F, less what the body carried takes."""
    count, number, work = model.joint_count, model.frame_number(frame), model.workspace()
    if carried is None:
        return lambda x: np.array(work.frame_jacobian(x[:count], number).T @ x[count:])
    alone = only_point_mass(model, *carried).workspace()

    def sample(x: FloatArray) -> FloatArray:
        q, v, a, wrench = np.split(x, [count, 2 * count, 3 * count])
        return np.array(work.frame_jacobian(q, number).T @ wrench - alone.inverse_dynamics(q, v, a))

    return sample


def weight(model: PinocchioModel, frame: str, mass_kg: float, com_m: FloatArray, gravity_m_s2: FloatArray) -> Sample:
    """From q to the weight (6,) of a point mass at ``com_m`` of a frame, there."""
    number, work = model.frame_number(frame), model.workspace()

    def sample(q: FloatArray) -> FloatArray:
        weight_n = work.frame_rotation(q, number).T @ (mass_kg * np.asarray(gravity_m_s2))
        return np.concatenate([weight_n, np.cross(com_m, weight_n)])

    return sample
