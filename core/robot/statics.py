"""Forces and gravity along a kinematic chain, vectorised over time: J^T F without Jacobians.

A wrench given in a frame of the chain is carried joint by joint to the base. In each joint's own axes (z along the
joint's axis) the component along z is that joint's torque; going on needs one plane rotation by the joint's
position and one constant transform. This equals J(q)^T F with J the frame's Jacobian in its own (local) axes.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from collaudit.core.parallel import ordered_map
from collaudit.core.series import FloatArray

#: Samples at a time: the vectors of one block stay in the cache, one component a row.
_BLOCK = 8192


@dataclass(frozen=True, slots=True, eq=False)
class ChainJoint:
    """One joint of a chain, from the frame towards the base.

    Attributes:
        index: column of the joint in position and torque arrays.
        prismatic: whether it slides.
        rotation, translation: (3, 3), (3,) pose of what was before (the frame, or the aligned axes of the joint
            further out) in this joint's aligned axes at position zero; a vector x goes to ``rotation @ x``.
    """

    index: int
    prismatic: bool
    rotation: FloatArray
    translation: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Chain:
    """The joints between a frame and the base, outermost first.

    Attributes:
        joints: the joints.
        base_rotation: (3, 3) axes of the innermost joint in the base; of the frame when there is no joint.
    """

    joints: tuple[ChainJoint, ...]
    base_rotation: FloatArray


def chain_torque(chain: Chain, position: FloatArray, wrench: FloatArray) -> FloatArray:
    """Joint torques J(q)^T F of a wrench at the chain's frame.

    Args:
        chain: from the frame to the base.
        position: (n, j) rad or m.
        wrench: (n, 6) force in N and torque in N·m, in the frame's axes, at its origin.

    Returns:
        (n, j) N·m or N; zero for joints outside the chain.
    """
    out = np.zeros_like(position)

    def one(block: slice) -> None:
        angles, columns = np.ascontiguousarray(position[block].T), np.ascontiguousarray(wrench[block].T)
        force, moment = columns[:3], columns[3:]
        for joint in chain.joints:
            out[block, joint.index], force, moment = _step(joint, angles[joint.index], force, moment)

    _each_block(one, position.shape[0])
    return out


def _step(
    joint: ChainJoint, position: FloatArray, force: FloatArray, moment: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Carry a wrench (3, m) over one joint: the joint's torque (m,), and the wrench in the joint's unmoved axes."""
    force = joint.rotation @ force
    moment = joint.rotation @ moment + skew(joint.translation) @ force
    if joint.prismatic:
        moved = moment.copy()
        moved[0] -= position * force[1]
        moved[1] += position * force[0]
        return force[2], force, moved
    cos, sin = np.cos(position), np.sin(position)
    return moment[2], _turn_z(force, cos, sin), _turn_z(moment, cos, sin)


def chain_gravity(chain: Chain, position: FloatArray, gravity: FloatArray) -> FloatArray:
    """Gravity in the axes of the chain's frame.

    Args:
        chain: from the frame to the base.
        position: (n, j) rad or m.
        gravity: (3,) in base axes, m/s².

    Returns:
        (n, 3) m/s².
    """
    out = np.empty((position.shape[0], 3))

    def one(block: slice) -> None:
        angles = np.ascontiguousarray(position[block].T)
        vector = np.repeat((gravity @ chain.base_rotation)[:, None], angles.shape[1], axis=1)
        for joint in reversed(chain.joints):
            if not joint.prismatic:
                angle = angles[joint.index]
                vector = _turn_z(vector, np.cos(angle), -np.sin(angle))
            vector = joint.rotation.T @ vector
        out[block] = vector.T

    _each_block(one, position.shape[0])
    return out


def _each_block(work: Callable[[slice], None], count: int) -> None:
    """Do ``work`` for each block of ``count`` samples, in threads."""
    for _ in ordered_map(work, [slice(start, start + _BLOCK) for start in range(0, count, _BLOCK)]):
        pass


def _turn_z(vector: FloatArray, cos: FloatArray, sin: FloatArray) -> FloatArray:
    """Rotate (3, m) vectors about z by angles given as (m,) cosine and sine."""
    out = np.empty_like(vector)
    out[0] = cos * vector[0] - sin * vector[1]
    out[1] = sin * vector[0] + cos * vector[1]
    out[2] = vector[2]
    return out


def skew(arm: FloatArray) -> FloatArray:
    """(3, 3) matrix of ``arm ×`` for a constant (3,) arm."""
    x, y, z = arm
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
