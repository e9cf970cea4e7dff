"""Dynamics one sample at a time through Pinocchio: what the recursions are tested against."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

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


def force(model: PinocchioModel, frame: str, carried: tuple[str, float, FloatArray] | None) -> Sample:
    """From q (with ``carried`` also v and a) and a wrench in a frame to J^T F, less what the body carried takes."""
    count, number, work = model.joint_count, model.frame_number(frame), model.workspace()
    if carried is None:
        return lambda x: np.array(work.frame_jacobian(x[:count], number).T @ x[count:])
    alone = model.only_point_mass(*carried, gravity_m_s2=np.zeros(3)).workspace()

    def sample(x: FloatArray) -> FloatArray:
        q, v, a, wrench = np.split(x, [count, 2 * count, 3 * count])
        return np.array(work.frame_jacobian(q, number).T @ wrench - alone.inverse_dynamics(q, v, a))

    return sample


def torques(model: PinocchioModel, frame: str, carried: tuple[str, float, FloatArray] | None) -> Sample:
    """From q, v, a and a reading in a frame to inverse dynamics, the reading at the joints, and its force squared."""
    count, number, work = model.joint_count, model.frame_number(frame), model.workspace()
    body = carried or (frame, 0.0, np.zeros(3))
    alone = model.only_point_mass(*body, gravity_m_s2=model.gravity_m_s2).workspace()
    weight_n = body[1] * model.gravity_m_s2

    def sample(x: FloatArray) -> FloatArray:
        q, v, a, wrench = np.split(x, [count, 2 * count, 3 * count])
        contact = work.frame_jacobian(q, number).T @ wrench - alone.inverse_dynamics(q, v, a)
        force_n = wrench[:3] + work.frame_rotation(q, number).T @ weight_n
        return np.concatenate([work.inverse_dynamics(q, v, a), contact, [force_n @ force_n]])

    return sample


def weight(model: PinocchioModel, frame: str, mass_kg: float, com_m: FloatArray, gravity_m_s2: FloatArray) -> Sample:
    """From q to the weight (6,) of a point mass at ``com_m`` of a frame, there."""
    number, work = model.frame_number(frame), model.workspace()

    def sample(q: FloatArray) -> FloatArray:
        weight_n = work.frame_rotation(q, number).T @ (mass_kg * np.asarray(gravity_m_s2))
        return np.concatenate([weight_n, np.cross(com_m, weight_n)])

    return sample
