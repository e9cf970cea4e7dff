"""A robot's joints at many positions, and the motion of its links there.

Each link's quantities are vectors in its joint's axes, about its joint's origin.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.robot.link_constants import Link
from collaudit.core.robot.vectors import ZERO, Scalar, Vector, add_z, matrix_times, plus, vector_of

#: Rotations' entries this near to 0, 1 or -1 are meant to be it.
_EXACT = 1e-15


@dataclass(frozen=True, eq=False)
class Joint:
    """A joint at its positions (m,): ways into and out of its axes."""

    link: Link
    position: FloatArray

    @cached_property
    def rotation(self) -> list[list[float]]:
        """(3, 3) with entries that rounding kept from 0 or 1 put right."""
        near = np.round(self.link.rotation)
        return [[float(x) for x in row] for row in np.where(np.abs(self.link.rotation - near) < _EXACT, near,
                                                            self.link.rotation)]  # fmt: skip

    @cached_property
    def _cos_sin(self) -> tuple[Scalar, Scalar]:
        return np.cos(self.position), np.sin(self.position)

    @cached_property
    def offset(self) -> Vector:
        """(3,) of its origin in its parent's axes."""
        place = vector_of(self.link.translation)
        if not self.link.prismatic:
            return place
        return plus(place, matrix_times(self.rotation, (0.0, 0.0, self.position)))

    def into(self, vector: Vector) -> Vector:
        """From its parent's axes into its own."""
        x, y, z = matrix_times(list(zip(*self.rotation, strict=True)), vector)
        if self.link.prismatic:
            return x, y, z
        cos, sin = self._cos_sin
        return cos * x + sin * y, cos * y - sin * x, z

    def out_of(self, vector: Vector) -> Vector:
        """From its own axes into its parent's."""
        x, y, z = vector
        if not self.link.prismatic:
            cos, sin = self._cos_sin
            x, y = cos * x - sin * y, sin * x + cos * y
        return matrix_times(self.rotation, (x, y, z))


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """A link's angular velocity ω and acceleration α, acceleration of its origin, and U = [α×] + [ω×][ω×]."""

    angular_velocity: Vector
    angular_acceleration: Vector
    acceleration: Vector
    spin_matrix: list[Vector]


def joints_at(links: Sequence[Link], q: FloatArray) -> list[Joint]:
    """The joints at positions (j, m)."""
    return [Joint(link, position) for link, position in zip(links, q, strict=True)]


def motions_of(
    joints: Sequence[Joint], speeds: Iterable[FloatArray], rates: Iterable[FloatArray], base: Vector
) -> Iterator[Motion]:
    """Of each link in turn, on a base that accelerates by ``base``."""
    out: list[Motion] = []
    rest = Motion(ZERO, ZERO, base, [ZERO] * 3)
    for joint, speed, rate in zip(joints, speeds, rates, strict=True):
        before = out[joint.link.parent] if joint.link.parent >= 0 else rest
        turn, turning = joint.into(before.angular_velocity), joint.into(before.angular_acceleration)
        at = joint.into(plus(before.acceleration, matrix_times(before.spin_matrix, joint.offset)))
        if joint.link.prismatic:
            at = plus(at, (2.0 * turn[1] * speed, -2.0 * turn[0] * speed, rate))
        else:
            turning = (turning[0] + turn[1] * speed, turning[1] - turn[0] * speed, turning[2] + rate)
            turn = add_z(turn, speed)
        out.append(Motion(turn, turning, at, _spin_matrix(turn, turning)))
        yield out[-1]


def _spin_matrix(turn: Vector, turning: Vector) -> list[Vector]:
    """U = [α×] + [ω×][ω×]."""
    (x, y, z), (ax, ay, az) = turn, turning
    xx, yy, zz, xy, xz, yz = x * x, y * y, z * z, x * y, x * z, y * z
    return [(-(yy + zz), xy - az, xz + ay), (xy + az, -(xx + zz), yz - ax), (xz - ay, yz + ax, -(xx + yy))]


def into_link(joints: Sequence[Joint], link: int, vector: Vector) -> Vector:
    """A vector of the base in the axes of a link."""
    for joint in reversed(_chain_to_base(joints, link)):
        vector = joint.into(vector)
    return vector


def _chain_to_base(joints: Sequence[Joint], link: int) -> list[Joint]:
    """The joints from a link to the base."""
    out = []
    while link >= 0:
        out.append(joints[link])
        link = joints[link].link.parent
    return out
