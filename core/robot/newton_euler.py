"""Recursions over a robot's links, recorded for many samples at once (:mod:`recorded_program`).

Each link's quantities are vectors in its joint's axes, about its joint's origin: the recursive Newton-Euler algorithm
(Luh, Walker, Paul 1980) in the form of Khalil and Kleinfinger (1987), where U = [α×] + [ω×][ω×] serves both the
next joint's origin and the body's first moments. With the momentum (P, L) of everything a joint moves,
M(q) v is its component along the joint, and C(q, v)^T v, the derivative of the kinetic energy by the joint's
position, is L·(ω × z) + P·(v × z).
"""

from __future__ import annotations

from collections.abc import Sequence

from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.robot.link_constants import FramePlacement, Link
from collaudit.core.robot.link_motions import Joint, Motion, into_link, motions_of, recording
from collaudit.core.robot.recorded_program import Program, Scalar, Value
from collaudit.core.robot.recorded_vectors import (
    ZERO,
    Vector,
    about_z,
    add_z,
    cross,
    matrix_times,
    plus,
    scaled,
    vector_of,
)


def inverse_dynamics_program(links: Sequence[Link], gravity_m_s2: FloatArray) -> Program:
    """Inputs q, v, a of each joint; outputs: the torques M(q) a + C(q, v) v + G(q), rotor inertia included."""
    recorder, joints, (speeds, rates) = recording(links, 2)
    return recorder.program(_inverse_dynamics(joints, speeds, rates, gravity_m_s2)[0])


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
    recorder, joints, (speeds, rates) = recording(links, 2, more=6)
    torque, motions = _inverse_dynamics(joints, speeds, rates, gravity_m_s2)
    wrenches: list[tuple[Vector, Vector]] = [(ZERO, ZERO) for _ in links]
    reading = _wrench_in_link(place, recorder.inputs()[-6:])
    force, link = reading[0], place.link
    if carried is not None:
        where, mass_kg, centre = carried
        point = vector_of(where.rotation @ centre + where.translation)
        force = plus(force, into_link(joints, link, vector_of(mass_kg * gravity_m_s2)))
        if link >= 0:
            reading = _less_point_mass(
                reading, motions[link], mass_kg, point
            )  # on a base that gravity accelerates: weight too
    if link >= 0:
        wrenches[link] = reading
    contact = [_along_joint(j.link, w) for j, w in zip(joints, _subtree_totals(joints, wrenches), strict=True)]
    x, y, z = force
    return recorder.program([*torque, *contact, x * x + y * y + z * z])


def _inverse_dynamics(
    joints: Sequence[Joint], speeds: Sequence[Value], rates: Sequence[Value], gravity_m_s2: FloatArray
) -> tuple[list[Scalar], list[Motion]]:
    """Torques, and the motion of each link. Each link's wrench is recorded with its motion: fewer results wait."""
    wrenches, motions = [], []
    for joint, at in zip(joints, motions_of(joints, speeds, rates, vector_of(-gravity_m_s2)), strict=True):
        motions.append(at)
        link, h = joint.link, vector_of(joint.link.first_kg_m)
        force = plus(scaled(link.mass_kg, at.acceleration), matrix_times(at.spin_matrix, h))
        wrenches.append((force, plus(_euler_moment(link.inertia, at), cross(h, at.acceleration))))
    torque = [_along_joint(j.link, w) for j, w in zip(joints, _subtree_totals(joints, wrenches), strict=True)]
    return [t + j.link.armature * r for t, j, r in zip(torque, joints, rates, strict=True)], motions


def momentum_program(links: Sequence[Link], gravity_m_s2: FloatArray) -> Program:
    """Inputs q, v of each joint; outputs: momenta p = M(q) v, then C(q, v)^T v - G(q)."""
    recorder, joints, (speeds,) = recording(links, 1)
    moving: list[tuple[Vector, Vector]] = []
    momenta = []
    for joint, speed in zip(joints, speeds, strict=True):
        link, h = joint.link, vector_of(joint.link.first_kg_m)
        turn, velocity = moving[link.parent] if link.parent >= 0 else (ZERO, ZERO)
        velocity = joint.into(plus(velocity, cross(turn, joint.offset)))
        turn = joint.into(turn)
        velocity, turn = (add_z(velocity, speed), turn) if link.prismatic else (velocity, add_z(turn, speed))
        moving.append((turn, velocity))
        linear = plus(scaled(link.mass_kg, velocity), cross(turn, h))
        momenta.append((linear, plus(matrix_times(link.inertia.tolist(), turn), cross(h, velocity))))
    weights = _gravity_torques(joints, gravity_m_s2)
    momentum: list[Scalar] = []
    rest: list[Scalar] = []
    for joint, (linear, angular), (turn, velocity), speed, weight in zip(
        joints, _subtree_totals(joints, momenta), moving, speeds, weights, strict=True
    ):
        momentum.append(_along_joint(joint.link, (linear, angular)) + joint.link.armature * speed)
        change = about_z(linear, turn)
        if not joint.link.prismatic:
            change = about_z(angular, turn) + about_z(linear, velocity)
        rest.append(change - weight)
    return recorder.program([*momentum, *rest])


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
    recorder, joints, motion = recording(links, 0 if carried is None else 2, more=6)
    wrenches: list[tuple[Vector, Vector]] = [(ZERO, ZERO) for _ in links]
    if place.link >= 0:
        wrenches[place.link] = _wrench_in_link(place, recorder.inputs()[-6:])
    if carried is not None and carried[0].link >= 0:
        where, mass_kg, centre = carried
        point = vector_of(where.rotation @ centre + where.translation)
        at = list(motions_of(joints, motion[0], motion[1], ZERO))[where.link]
        wrenches[where.link] = _less_point_mass(wrenches[where.link], at, mass_kg, point)
    return recorder.program(
        [_along_joint(j.link, w) for j, w in zip(joints, _subtree_totals(joints, wrenches), strict=True)]
    )


def _wrench_in_link(place: FramePlacement, wrench: Sequence[Value]) -> tuple[Vector, Vector]:
    """A force and a moment at a frame's origin, about the origin of its link and in its axes."""
    force = matrix_times(place.rotation.tolist(), wrench[:3])
    moment = matrix_times(place.rotation.tolist(), wrench[3:])
    return force, plus(moment, cross(vector_of(place.translation), force))


def _less_point_mass(wrench: tuple[Vector, Vector], at: Motion, mass_kg: float, point: Vector) -> tuple[Vector, Vector]:
    """A wrench on a link, less what it takes to move a point mass along with it."""
    inertial = scaled(-mass_kg, plus(at.acceleration, matrix_times(at.spin_matrix, point)))
    return plus(wrench[0], inertial), plus(wrench[1], cross(point, inertial))


def weight_program(
    links: Sequence[Link], place: FramePlacement, mass_kg: float, com_m: FloatArray, gravity_m_s2: FloatArray
) -> Program:
    """Weight of a point mass at ``com_m`` (3,) of a frame. Inputs: q of each joint; outputs: force and moment there."""
    recorder, joints, _ = recording(links, 0)
    force = matrix_times(place.rotation.T.tolist(), into_link(joints, place.link, vector_of(mass_kg * gravity_m_s2)))
    return recorder.program([*force, *cross(vector_of(com_m), force)])


def _euler_moment(inertia: FloatArray, at: Motion) -> Vector:
    """I α + ω × I ω, by the entries of U."""
    (x, y, z), (ax, ay, az), u = at.angular_velocity, at.angular_acceleration, at.spin_matrix
    (xx, xy, xz), (_, yy, yz), (_, _, zz) = inertia.tolist()
    return (
        xx * ax + (zz - yy) * (y * z) + yz * (y * y - z * z) + xz * u[1][0] - xy * u[2][0],
        yy * ay + (xx - zz) * (x * z) + xz * (z * z - x * x) + xy * u[2][1] - yz * u[0][1],
        zz * az + (yy - xx) * (x * y) + xy * (x * x - y * y) + yz * u[0][2] - xz * u[1][2],
    )


def _subtree_totals(joints: Sequence[Joint], own: Sequence[tuple[Vector, Vector]]) -> list[tuple[Vector, Vector]]:
    """Forces and moments (or momenta) of each joint's whole subtree, from those of each link."""
    total = list(own)
    for k in range(len(joints) - 1, -1, -1):
        joint, parent = joints[k], joints[k].link.parent
        if parent >= 0 and total[k] != (ZERO, ZERO):
            force, moment = (joint.out_of(x) for x in total[k])
            before = total[parent]
            total[parent] = (plus(before[0], force), plus(before[1], plus(moment, cross(joint.offset, force))))
    return total


def _gravity_torques(joints: Sequence[Joint], gravity_m_s2: FloatArray) -> list[Scalar]:
    """G(q): by the mass and the first moments of each joint's whole subtree."""
    masses = [j.link.mass_kg for j in joints]
    first = [vector_of(j.link.first_kg_m) for j in joints]
    for k in range(len(joints) - 1, -1, -1):
        parent = joints[k].link.parent
        if parent >= 0:
            masses[parent] += masses[k]
            own = plus(joints[k].out_of(first[k]), scaled(masses[k], joints[k].offset))
            first[parent] = plus(first[parent], own)
    down: list[Vector] = []
    for joint in joints:
        before = down[joint.link.parent] if joint.link.parent >= 0 else vector_of(gravity_m_s2)
        down.append(joint.into(before))
    return [
        -mass * g[2] if joint.link.prismatic else h[1] * g[0] - h[0] * g[1]
        for joint, mass, h, g in zip(joints, masses, first, down, strict=True)
    ]


def _along_joint(link: Link, wrench: tuple[Vector, Vector]) -> Scalar:
    """What a joint feels of a force and a moment."""
    return wrench[0][2] if link.prismatic else wrench[1][2]
