"""Recursions over a robot's links, recorded for many samples at once (:mod:`tape`).

Each link's quantities are vectors in its joint's axes, about its joint's origin: the recursive Newton-Euler algorithm
(Luh, Walker, Paul 1980) in the form of Khalil and Kleinfinger (1987), where U = [α×] + [ω×][ω×] serves both the
next joint's origin and the body's first moments. With the momentum (P, L) of everything a joint moves,
M(q) v is its component along the joint, and C(q, v)^T v, the derivative of the kinetic energy by the joint's
position, is L·(ω × z) + P·(v × z).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TypeAlias

import numpy as np

from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.robot.link_constants import FramePlacement, Link
from collaudit.core.robot.recorded_program import Program, Scalar, Tape, Value

Vector: TypeAlias = tuple[Scalar, Scalar, Scalar]
_ZERO: Vector = (0.0, 0.0, 0.0)
#: Rotations' entries this near to 0, 1 or -1 are meant to be it.
_EXACT = 1e-15


def inverse_dynamics_program(links: Sequence[Link], gravity_m_s2: FloatArray) -> Program:
    """Inputs q, v, a of each joint; outputs: the torques M(q) a + C(q, v) v + G(q), rotor inertia included."""
    tape, joints, (speeds, rates) = _start(links, 2)
    return tape.program(_inverse_dynamics(joints, speeds, rates, gravity_m_s2)[0])


def torques_program(
    links: Sequence[Link],
    gravity_m_s2: FloatArray,
    place: FramePlacement,
    carried: tuple[FramePlacement, float, FloatArray] | None,
) -> Program:
    """Inverse dynamics, and what a wrist sensor's reading is at the joints, with the motion of the links in common.

    Inputs: q, v, a of each joint, then the force and moment that the sensor reads at its frame's origin.
    Outputs: torques as of :func:`inverse_dynamics_program`; those of :func:`force_program` with the weight of what is
    carried added to the reading; and the square of the force so added up.

    Args:
        links: the robot.
        gravity_m_s2: (3,) in the base.
        place: the sensor's frame.
        carried: place on the same link, mass in kg and (3,) centre there of a point mass; None for none.
    """
    tape, joints, (speeds, rates) = _start(links, 2, more=6)
    torque, motions = _inverse_dynamics(joints, speeds, rates, gravity_m_s2)
    wrenches: list[tuple[Vector, Vector]] = [(_ZERO, _ZERO) for _ in links]
    reading = _in_link(place, tape.inputs()[-6:])
    force, link = reading[0], place.link
    if carried is not None:
        where, mass_kg, centre = carried
        point = _vector(where.rotation @ centre + where.translation)
        force = _plus(force, _turned_into(joints, link, _vector(mass_kg * gravity_m_s2)))
        if link >= 0:
            reading = _and_body(
                reading, motions[link], mass_kg, point
            )  # on a base that gravity accelerates: weight too
    if link >= 0:
        wrenches[link] = reading
    contact = [_along(j.link, w) for j, w in zip(joints, _carried(joints, wrenches), strict=True)]
    x, y, z = force
    return tape.program([*torque, *contact, x * x + y * y + z * z])


def _inverse_dynamics(
    joints: Sequence[_Joint], speeds: Sequence[Value], rates: Sequence[Value], gravity_m_s2: FloatArray
) -> tuple[list[Scalar], list[_Motion]]:
    """Torques, and the motion of each link. Each link's wrench is recorded with its motion: fewer results wait."""
    wrenches, motions = [], []
    for joint, at in zip(joints, _motions(joints, speeds, rates, _vector(-gravity_m_s2)), strict=True):
        motions.append(at)
        link, h = joint.link, _vector(joint.link.first_kg_m)
        force = _plus(_scaled(link.mass_kg, at.acceleration), _times(at.spin, h))
        wrenches.append((force, _plus(_turning(link.inertia, at), _cross(h, at.acceleration))))
    torque = [_along(j.link, w) for j, w in zip(joints, _carried(joints, wrenches), strict=True)]
    return [t + j.link.armature * r for t, j, r in zip(torque, joints, rates, strict=True)], motions


def momentum_program(links: Sequence[Link], gravity_m_s2: FloatArray) -> Program:
    """Inputs q, v of each joint; outputs: momenta p = M(q) v, then C(q, v)^T v - G(q)."""
    tape, joints, (speeds,) = _start(links, 1)
    moving: list[tuple[Vector, Vector]] = []
    momenta = []
    for joint, speed in zip(joints, speeds, strict=True):
        link, h = joint.link, _vector(joint.link.first_kg_m)
        turn, velocity = moving[link.parent] if link.parent >= 0 else (_ZERO, _ZERO)
        velocity = joint.into(_plus(velocity, _cross(turn, joint.offset)))
        turn = joint.into(turn)
        velocity, turn = (_add_z(velocity, speed), turn) if link.prismatic else (velocity, _add_z(turn, speed))
        moving.append((turn, velocity))
        linear = _plus(_scaled(link.mass_kg, velocity), _cross(turn, h))
        momenta.append((linear, _plus(_times(link.inertia.tolist(), turn), _cross(h, velocity))))
    weights = _gravity_torques(joints, gravity_m_s2)
    momentum: list[Scalar] = []
    rest: list[Scalar] = []
    for joint, (linear, angular), (turn, velocity), speed, weight in zip(
        joints, _carried(joints, momenta), moving, speeds, weights, strict=True
    ):
        momentum.append(_along(joint.link, (linear, angular)) + joint.link.armature * speed)
        change = _about_z(linear, turn)
        if not joint.link.prismatic:
            change = _about_z(angular, turn) + _about_z(linear, velocity)
        rest.append(change - weight)
    return tape.program([*momentum, *rest])


def force_program(
    links: Sequence[Link], place: FramePlacement, carried: tuple[FramePlacement, float, FloatArray] | None
) -> Program:
    """J(q)^T F of a wrench in a frame, less what accelerating a point mass takes.

    Inputs: q of each joint, with ``carried`` also v and a, then force and moment at the frame's origin in its axes.
    Outputs: joint torques.

    Args:
        links: the robot.
        place: the frame.
        carried: frame, mass in kg and (3,) centre in that frame of the point mass, without weight; None for none.
    """
    tape, joints, motion = _start(links, 0 if carried is None else 2, more=6)
    wrenches: list[tuple[Vector, Vector]] = [(_ZERO, _ZERO) for _ in links]
    if place.link >= 0:
        wrenches[place.link] = _in_link(place, tape.inputs()[-6:])
    if carried is not None and carried[0].link >= 0:
        where, mass_kg, centre = carried
        point = _vector(where.rotation @ centre + where.translation)
        at = list(_motions(joints, motion[0], motion[1], _ZERO))[where.link]
        wrenches[where.link] = _and_body(wrenches[where.link], at, mass_kg, point)
    return tape.program([_along(j.link, w) for j, w in zip(joints, _carried(joints, wrenches), strict=True)])


def _in_link(place: FramePlacement, wrench: Sequence[Value]) -> tuple[Vector, Vector]:
    """A force and a moment at a frame's origin, about the origin of its link and in its axes."""
    force = _times(place.rotation.tolist(), wrench[:3])
    moment = _times(place.rotation.tolist(), wrench[3:])
    return force, _plus(moment, _cross(_vector(place.translation), force))


def _and_body(wrench: tuple[Vector, Vector], at: _Motion, mass_kg: float, point: Vector) -> tuple[Vector, Vector]:
    """A wrench on a link, less what it takes to move a point mass along with it."""
    inertial = _scaled(-mass_kg, _plus(at.acceleration, _times(at.spin, point)))
    return _plus(wrench[0], inertial), _plus(wrench[1], _cross(point, inertial))


def _turned_into(joints: Sequence[_Joint], link: int, vector: Vector) -> Vector:
    """A vector of the base in the axes of a link."""
    for joint in reversed(_way_in(joints, link)):
        vector = joint.into(vector)
    return vector


def weight_program(
    links: Sequence[Link], place: FramePlacement, mass_kg: float, com_m: FloatArray, gravity_m_s2: FloatArray
) -> Program:
    """Weight of a point mass at ``com_m`` (3,) of a frame. Inputs: q of each joint; outputs: force and moment there."""
    tape, joints, _ = _start(links, 0)
    force = _times(place.rotation.T.tolist(), _turned_into(joints, place.link, _vector(mass_kg * gravity_m_s2)))
    return tape.program([*force, *_cross(_vector(com_m), force)])


def _way_in(joints: Sequence[_Joint], link: int) -> list[_Joint]:
    """The joints from a link to the base."""
    out = []
    while link >= 0:
        out.append(joints[link])
        link = joints[link].link.parent
    return out


@dataclass(frozen=True, eq=False)
class _Joint:
    """A joint at a position: ways into and out of its axes."""

    link: Link
    position: Value
    tape: Tape

    @cached_property
    def rotation(self) -> list[list[float]]:
        """(3, 3) with entries that rounding kept from 0 or 1 put right."""
        near = np.round(self.link.rotation)
        return [[float(x) for x in row] for row in np.where(np.abs(self.link.rotation - near) < _EXACT, near,
                                                            self.link.rotation)]  # fmt: skip

    @cached_property
    def _turned(self) -> tuple[Scalar, Scalar]:
        return self.tape.cosine(self.position), self.tape.sine(self.position)

    @cached_property
    def offset(self) -> Vector:
        """(3,) of its origin in its parent's axes."""
        place = _vector(self.link.translation)
        if not self.link.prismatic:
            return place
        return _plus(place, _times(self.rotation, (0.0, 0.0, self.position)))

    def into(self, vector: Vector) -> Vector:
        """From its parent's axes into its own."""
        x, y, z = _times(list(zip(*self.rotation, strict=True)), vector)
        if self.link.prismatic:
            return x, y, z
        cos, sin = self._turned
        return cos * x + sin * y, cos * y - sin * x, z

    def out_of(self, vector: Vector) -> Vector:
        """From its own axes into its parent's."""
        x, y, z = vector
        if not self.link.prismatic:
            cos, sin = self._turned
            x, y = cos * x - sin * y, sin * x + cos * y
        return _times(self.rotation, (x, y, z))


@dataclass(frozen=True, slots=True, eq=False)
class _Motion:
    """A link's angular velocity ω and acceleration α, acceleration of its origin, and U = [α×] + [ω×][ω×]."""

    turn: Vector
    turning: Vector
    acceleration: Vector
    spin: list[Vector]


def _start(links: Sequence[Link], derivatives: int, more: int = 0) -> tuple[Tape, list[_Joint], list[list[Value]]]:
    """A tape, the joints at their positions, and for each derivative its value of each joint."""
    count = len(links)
    tape = Tape((1 + derivatives) * count + more)
    inputs = tape.inputs()
    joints = [_Joint(link, inputs[k], tape) for k, link in enumerate(links)]
    return tape, joints, [inputs[(d + 1) * count : (d + 2) * count] for d in range(derivatives)]


def _motions(
    joints: Sequence[_Joint], speeds: Sequence[Value], rates: Sequence[Value], base: Vector
) -> Iterator[_Motion]:
    """Of each link in turn, on a base that accelerates by ``base``."""
    out: list[_Motion] = []
    rest = _Motion(_ZERO, _ZERO, base, [_ZERO] * 3)
    for joint, speed, rate in zip(joints, speeds, rates, strict=True):
        before = out[joint.link.parent] if joint.link.parent >= 0 else rest
        turn, turning = joint.into(before.turn), joint.into(before.turning)
        at = joint.into(_plus(before.acceleration, _times(before.spin, joint.offset)))
        if joint.link.prismatic:
            at = _plus(at, (2.0 * turn[1] * speed, -2.0 * turn[0] * speed, rate))
        else:
            turning = (turning[0] + turn[1] * speed, turning[1] - turn[0] * speed, turning[2] + rate)
            turn = _add_z(turn, speed)
        out.append(_Motion(turn, turning, at, _spin(turn, turning)))
        yield out[-1]


def _spin(turn: Vector, turning: Vector) -> list[Vector]:
    """U = [α×] + [ω×][ω×]."""
    (x, y, z), (ax, ay, az) = turn, turning
    return [(-(y * y + z * z), x * y - az, x * z + ay), (x * y + az, -(x * x + z * z), y * z - ax),
            (x * z - ay, y * z + ax, -(x * x + y * y))]  # fmt: skip


def _turning(inertia: FloatArray, at: _Motion) -> Vector:
    """I α + ω × I ω, by the entries of U."""
    (x, y, z), (ax, ay, az), u = at.turn, at.turning, at.spin
    (xx, xy, xz), (_, yy, yz), (_, _, zz) = inertia.tolist()
    return (
        xx * ax + (zz - yy) * (y * z) + yz * (y * y - z * z) + xz * u[1][0] - xy * u[2][0],
        yy * ay + (xx - zz) * (x * z) + xz * (z * z - x * x) + xy * u[2][1] - yz * u[0][1],
        zz * az + (yy - xx) * (x * y) + xy * (x * x - y * y) + yz * u[0][2] - xz * u[1][2],
    )


def _carried(joints: Sequence[_Joint], own: Sequence[tuple[Vector, Vector]]) -> list[tuple[Vector, Vector]]:
    """Forces and moments (or momenta) of each joint's whole subtree, from those of each link."""
    total = list(own)
    for k in range(len(joints) - 1, -1, -1):
        joint, parent = joints[k], joints[k].link.parent
        if parent >= 0 and total[k] != (_ZERO, _ZERO):
            force, moment = (joint.out_of(x) for x in total[k])
            before = total[parent]
            total[parent] = (_plus(before[0], force), _plus(before[1], _plus(moment, _cross(joint.offset, force))))
    return total


def _gravity_torques(joints: Sequence[_Joint], gravity_m_s2: FloatArray) -> list[Scalar]:
    """G(q): by the mass and the first moments of each joint's whole subtree."""
    masses = [j.link.mass_kg for j in joints]
    first = [_vector(j.link.first_kg_m) for j in joints]
    for k in range(len(joints) - 1, -1, -1):
        parent = joints[k].link.parent
        if parent >= 0:
            masses[parent] += masses[k]
            own = _plus(joints[k].out_of(first[k]), _scaled(masses[k], joints[k].offset))
            first[parent] = _plus(first[parent], own)
    down: list[Vector] = []
    for joint in joints:
        before = down[joint.link.parent] if joint.link.parent >= 0 else _vector(gravity_m_s2)
        down.append(joint.into(before))
    return [
        -mass * g[2] if joint.link.prismatic else h[1] * g[0] - h[0] * g[1]
        for joint, mass, h, g in zip(joints, masses, first, down, strict=True)
    ]


def _along(link: Link, wrench: tuple[Vector, Vector]) -> Scalar:
    """What a joint feels of a force and a moment."""
    return wrench[0][2] if link.prismatic else wrench[1][2]


def _about_z(x: Vector, y: Vector) -> Scalar:
    """x · (y × z)."""
    return x[0] * y[1] - x[1] * y[0]


def _add_z(vector: Vector, z: Scalar) -> Vector:
    return vector[0], vector[1], vector[2] + z


def _vector(x: FloatArray) -> Vector:
    return float(x[0]), float(x[1]), float(x[2])


def _plus(x: Vector, y: Vector) -> Vector:
    return x[0] + y[0], x[1] + y[1], x[2] + y[2]


def _scaled(factor: float, x: Vector) -> Vector:
    return factor * x[0], factor * x[1], factor * x[2]


def _cross(x: Vector, y: Vector) -> Vector:
    return x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2], x[0] * y[1] - x[1] * y[0]


def _times(matrix: Sequence[Sequence[Scalar]], x: Sequence[Scalar]) -> Vector:
    a, b, c = (row[0] * x[0] + row[1] * x[1] + row[2] * x[2] for row in matrix)
    return a, b, c
