"""Dynamics one sample at a time through Pinocchio: what recorded programs are checked against, and replaced by."""

from __future__ import annotations

from typing import Any

import numpy as np
import pinocchio as pin

from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.robot.sample_batches import OneByOne, Sample


def inverse_dynamics(model: Any) -> OneByOne:
    """From q, v, a to joint torques."""

    def sampler() -> Sample:
        data = model.createData()
        return lambda x: np.array(pin.rnea(model, data, *np.split(x, 3)))

    return OneByOne(3 * model.nv, model.nv, sampler)


def momentum(model: Any) -> OneByOne:
    """From q, v to M(q) v, then C(q, v)^T v - G(q)."""

    def sampler() -> Sample:
        data = model.createData()

        def sample(x: FloatArray) -> FloatArray:
            q, v = np.split(x, 2)
            upper = np.triu(pin.crba(model, data, q))
            mass = upper + np.triu(upper, 1).T
            rest = pin.computeCoriolisMatrix(model, data, q, v).T @ v - pin.computeGeneralizedGravity(model, data, q)
            return np.concatenate([mass @ v, rest])

        return sample

    return OneByOne(2 * model.nv, 2 * model.nv, sampler)


def force(model: Any, frame: str, carried: tuple[str, float, FloatArray] | None) -> OneByOne:
    """From q (with ``carried`` also v and a) and a wrench in a frame to J^T F, less what the body carried takes."""
    count, number = model.nv, model.getFrameId(frame)
    if carried is None:

        def sampler() -> Sample:
            data = model.createData()
            return lambda x: np.array(pin.computeFrameJacobian(model, data, x[:count], number, pin.LOCAL).T @ x[count:])

        return OneByOne(count + 6, count, sampler)
    alone = _alone(model, *carried)

    def with_body() -> Sample:
        data, alone_data = model.createData(), alone.createData()

        def sample(x: FloatArray) -> FloatArray:
            q, v, a, wrench = np.split(x, [count, 2 * count, 3 * count])
            jacobian = pin.computeFrameJacobian(model, data, q, number, pin.LOCAL)
            return np.array(jacobian.T @ wrench - pin.rnea(alone, alone_data, q, v, a))

        return sample

    return OneByOne(3 * count + 6, count, with_body)


def torques(model: Any, frame: str, carried: tuple[str, float, FloatArray] | None) -> OneByOne:
    """From q, v, a and a reading in a frame to inverse dynamics, the reading at the joints, and its force squared."""
    count, number = model.nv, model.getFrameId(frame)
    alone = _alone(model, *(carried or (frame, 0.0, np.zeros(3))), model.gravity.linear)
    weight_n = 0.0 if carried is None else carried[1] * np.array(model.gravity.linear)

    def sampler() -> Sample:
        data, alone_data = model.createData(), alone.createData()

        def sample(x: FloatArray) -> FloatArray:
            q, v, a, wrench = np.split(x, [count, 2 * count, 3 * count])
            jacobian = pin.computeFrameJacobian(model, data, q, number, pin.LOCAL)
            contact = jacobian.T @ wrench - pin.rnea(alone, alone_data, q, v, a)
            force = wrench[:3] + rotation(model, data, q, frame).T @ np.broadcast_to(weight_n, 3)
            return np.concatenate([pin.rnea(model, data, q, v, a), contact, [force @ force]])

        return sample

    return OneByOne(3 * count + 6, 2 * count + 1, sampler)


def _alone(
    model: Any, frame: str, mass_kg: float, com_m: FloatArray, gravity_m_s2: FloatArray | tuple[float, ...] = (0, 0, 0)
) -> Any:
    """The arm without rotors and any mass but a point at ``com_m`` of a frame; weightless unless gravity is given."""
    alone = model.copy()
    alone.gravity.linear, alone.armature = np.array(gravity_m_s2, dtype=np.float64), np.zeros(model.nv)
    for k in range(len(alone.inertias)):
        alone.inertias[k] = pin.Inertia.Zero()
    at = alone.frames[alone.getFrameId(frame)]
    alone.appendBodyToJoint(at.parentJoint, pin.Inertia(mass_kg, np.array(com_m), np.zeros((3, 3))), at.placement)
    return alone


def weight(model: Any, frame: str, mass_kg: float, com_m: FloatArray, gravity_m_s2: FloatArray) -> OneByOne:
    """From q to the weight (6,) of a point mass at ``com_m`` of a frame, there."""

    def sampler() -> Sample:
        data = model.createData()

        def sample(q: FloatArray) -> FloatArray:
            its = rotation(model, data, q, frame).T @ (mass_kg * np.asarray(gravity_m_s2))
            return np.concatenate([its, np.cross(com_m, its)])

        return sample

    return OneByOne(model.nv, 6, sampler)


def rotation(model: Any, data: Any, q: FloatArray, frame: str) -> FloatArray:
    """(3, 3) axes of a frame in the base."""
    pin.forwardKinematics(model, data, q)
    return np.array(pin.updateFramePlacement(model, data, model.getFrameId(frame)).rotation)
