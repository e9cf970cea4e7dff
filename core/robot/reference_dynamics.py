"""Dynamics one sample at a time through Pinocchio: what recorded programs are checked against, and replaced by."""

from __future__ import annotations

import numpy as np

from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.robot.pinocchio_model import PinocchioModel
from collaudit.core.robot.sample_batches import OneByOne, Sample


def inverse_dynamics(model: PinocchioModel) -> OneByOne:
    """From q, v, a to joint torques."""

    def sampler() -> Sample:
        work = model.workspace()
        return lambda x: np.array(work.inverse_dynamics(*np.split(x, 3)))

    return OneByOne(3 * model.joint_count, model.joint_count, sampler)


def momentum(model: PinocchioModel) -> OneByOne:
    """From q, v to M(q) v, then C(q, v)^T v - G(q)."""

    def sampler() -> Sample:
        work = model.workspace()

        def sample(x: FloatArray) -> FloatArray:
            q, v = np.split(x, 2)
            mass = work.mass_matrix(q)
            rest = work.coriolis_matrix(q, v).T @ v - work.gravity_torque(q)
            return np.concatenate([mass @ v, rest])

        return sample

    return OneByOne(2 * model.joint_count, 2 * model.joint_count, sampler)


def force(model: PinocchioModel, frame: str, carried: tuple[str, float, FloatArray] | None) -> OneByOne:
    """From q (with ``carried`` also v and a) and a wrench in a frame to J^T F, less what the body carried takes."""
    count, number = model.joint_count, model.frame_number(frame)
    if carried is None:

        def sampler() -> Sample:
            work = model.workspace()
            return lambda x: np.array(work.frame_jacobian(x[:count], number).T @ x[count:])

        return OneByOne(count + 6, count, sampler)
    alone = model.only_point_mass(*carried, gravity_m_s2=np.zeros(3))

    def with_body() -> Sample:
        work, alone_work = model.workspace(), alone.workspace()

        def sample(x: FloatArray) -> FloatArray:
            q, v, a, wrench = np.split(x, [count, 2 * count, 3 * count])
            return np.array(work.frame_jacobian(q, number).T @ wrench - alone_work.inverse_dynamics(q, v, a))

        return sample

    return OneByOne(3 * count + 6, count, with_body)


def torques(model: PinocchioModel, frame: str, carried: tuple[str, float, FloatArray] | None) -> OneByOne:
    """From q, v, a and a reading in a frame to inverse dynamics, the reading at the joints, and its force squared."""
    count, number = model.joint_count, model.frame_number(frame)
    alone = model.only_point_mass(*(carried or (frame, 0.0, np.zeros(3))), gravity_m_s2=model.gravity_m_s2)
    weight_n = np.zeros(3) if carried is None else carried[1] * model.gravity_m_s2

    def sampler() -> Sample:
        work, alone_work = model.workspace(), alone.workspace()

        def sample(x: FloatArray) -> FloatArray:
            q, v, a, wrench = np.split(x, [count, 2 * count, 3 * count])
            contact = work.frame_jacobian(q, number).T @ wrench - alone_work.inverse_dynamics(q, v, a)
            force_n = wrench[:3] + work.frame_rotation(q, number).T @ weight_n
            return np.concatenate([work.inverse_dynamics(q, v, a), contact, [force_n @ force_n]])

        return sample

    return OneByOne(3 * count + 6, 2 * count + 1, sampler)


def weight(model: PinocchioModel, frame: str, mass_kg: float, com_m: FloatArray, gravity_m_s2: FloatArray) -> OneByOne:
    """From q to the weight (6,) of a point mass at ``com_m`` of a frame, there."""
    number = model.frame_number(frame)

    def sampler() -> Sample:
        work = model.workspace()

        def sample(q: FloatArray) -> FloatArray:
            weight_n = work.frame_rotation(q, number).T @ (mass_kg * np.asarray(gravity_m_s2))
            return np.concatenate([weight_n, np.cross(com_m, weight_n)])

        return sample

    return OneByOne(model.joint_count, 6, sampler)
