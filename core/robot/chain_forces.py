"""A wrench carried down a chain of links to the joints that hold it; a direction carried up. All samples at once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from collaudit.core.data.signals import ArmLink
from collaudit.core.numeric.arrays import FloatArray


@dataclass(frozen=True, slots=True)
class LinkPlace:
    """A frame on a link.

    Attributes:
        link: number of the joint that moves it; -1 for the base.
        rotation: (3, 3) the frame's axes in the link's.
        origin_m: (3,) its origin there.
    """

    link: int
    rotation: FloatArray
    origin_m: FloatArray


def torque_of_wrench(links: Sequence[ArmLink], at: LinkPlace, q: FloatArray, wrench: FloatArray) -> FloatArray:
    """(k, m) torque J(q)^T F of each joint, N·m (N where it slides); eq. (2).

    From the frame to the base, each link passes the force f on, and the moment t + p × f about its own origin.

    Args:
        links: all k joints, parents before children.
        at: the frame of the wrench.
        q: (k, m) positions, rad or m.
        wrench: (6, m) force N and moment N·m at the frame's origin, in its axes.
    """
    torque = np.zeros_like(q)
    force, moment = _in_parent(at.rotation, at.origin_m, wrench[:3], wrench[3:])
    number = at.link
    while number >= 0:
        link = links[number]
        torque[number] = force[2] if link.prismatic else moment[2]
        if link.prismatic:  # its origin has moved along z
            moment = np.stack([moment[0] - q[number] * force[1], moment[1] + q[number] * force[0], moment[2]])
        else:
            c, s = np.cos(q[number]), np.sin(q[number])
            force, moment = _turned(c, s, force), _turned(c, s, moment)
        force, moment = _in_parent(np.reshape(link.rotation, (3, 3)), np.array(link.translation_m), force, moment)
        number = link.parent
    return torque


def base_direction(links: Sequence[ArmLink], at: LinkPlace, q: FloatArray, vector: FloatArray) -> FloatArray:
    """(3, m) a vector (3,) of the base in the axes of a frame; links and q as of :func:`torque_of_wrench`."""
    chain, number = [], at.link
    while number >= 0:
        chain.append(number)
        number = links[number].parent
    out = np.repeat(np.reshape(vector, (3, 1)), q.shape[1], axis=1)
    for number in reversed(chain):
        out = np.reshape(links[number].rotation, (3, 3)).T @ out
        if not links[number].prismatic:
            out = _turned(np.cos(q[number]), -np.sin(q[number]), out)
    return at.rotation.T @ out


def _in_parent(
    rotation: FloatArray, origin: FloatArray, force: FloatArray, moment: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Force and moment (3, m) in the axes that a rotation and an origin are given in, about the origin of those."""
    force = rotation @ force
    x, y, z = origin
    across = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return force, rotation @ moment + across @ force


def _turned(c: FloatArray, s: FloatArray, vector: FloatArray) -> FloatArray:
    """(3, m) turned about z by angles with cosine c and sine s (m,)."""
    return np.stack([c * vector[0] - s * vector[1], s * vector[0] + c * vector[1], vector[2]])
