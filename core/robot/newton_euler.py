"""Recursions over a robot's links, for many samples at once: every number of a vector is an array (m,).

Each link's quantities are vectors in its joint's axes, about its joint's origin: the recursive Newton-Euler algorithm
(Luh, Walker, Paul 1980) in the form of Khalil and Kleinfinger (1987), where U = [α×] + [ω×][ω×] serves both the
next joint's origin and the body's first moments. With the momentum (P, L) of everything a joint moves,
M(q) v is its component along the joint, and C(q, v)^T v, the derivative of the kinetic energy by the joint's
position, is L·(ω × z) + P·(v × z).

Positions, velocities and accelerations are (j, m), forces and moments (3, m). Results are a list of arrays (m,), or of
numbers where they are the same at every sample.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.robot.link_constants import FramePlacement, Link
from collaudit.core.robot.link_motions import Joint, Motion, into_link, joints_at, motions_of
from collaudit.core.robot.vectors import (
    ZERO,
    Scalar,
    Vector,
    about_z,
    add_z,
    cross,
    matrix_times,
    plus,
    scaled,
    vector_of,
)


def inverse_dynamics(
    links: Sequence[Link], gravity_m_s2: FloatArray, q: FloatArray, v: FloatArray, a: FloatArray
) -> list[Scalar]:
    """The torque of each joint, M(q) a + C(q, v) v + G(q), rotor inertia included."""
    return _inverse_dynamics(joints_at(links, q), gravity_m_s2, v, a)[0]


def torques(
    links: Sequence[Link],
    gravity_m_s2: FloatArray,
    place: FramePlacement,
    carried: tuple[FramePlacement, float, FloatArray] | None,
    q: FloatArray,
    v: FloatArray,
    a: FloatArray,
    wrench: FloatArray,
) -> list[Scalar]:
    """Inverse dynamics, and what a wrist sensor's reading is at the joints, with the motion of the links in common.

    Args:
        links: the robot.
        gravity_m_s2: (3,) in the base.
        place: the sensor's frame.
        carried: place on the same link, mass in kg and (3,) centre there of a point mass; None for none.
        q, v, a: motion.
        wrench: (6, m) force and moment that the sensor reads at its frame's origin.

    Returns:
        The torques of :func:`inverse_dynamics`; those of :func:`force` with the weight of what is carried added to the
        reading; and the square of the force so added up.
    """
    joints = joints_at(links, q)
    torque, motions = _inverse_dynamics(joints, gravity_m_s2, v, a)
    reading = _wrench_in_link(place, wrench)
    total, link = reading[0], place.link
    if carried is not None:
        where, mass_kg, centre = carried
        point = vector_of(where.rotation @ centre + where.translation)
        total = plus(total, into_link(joints, link, vector_of(mass_kg * gravity_m_s2)))
        if link >= 0:  # on a base that gravity accelerates: weight too
            reading = _less_point_mass(reading, motions[link], mass_kg, point)
    x, y, z = total
    return [*torque, *_at_joints(joints, {link: reading}), x * x + y * y + z * z]


def _inverse_dynamics(
    joints: Sequence[Joint], gravity_m_s2: FloatArray, v: FloatArray, a: FloatArray
) -> tuple[list[Scalar], list[Motion]]:
    """Torques, and the motion of each link."""
    motions = list(motions_of(joints, v, a, vector_of(-gravity_m_s2)))
    wrenches = {}
    for number, (joint, at) in enumerate(zip(joints, motions, strict=True)):
        link, h = joint.link, vector_of(joint.link.first_kg_m)
        force = plus(scaled(link.mass_kg, at.acceleration), matrix_times(at.spin_matrix, h))
        wrenches[number] = (force, plus(_euler_moment(link.inertia, at), cross(h, at.acceleration)))
    torque = _at_joints(joints, wrenches)
    return [t + j.link.armature * rate for t, j, rate in zip(torque, joints, a, strict=True)], motions


def momentum(links: Sequence[Link], gravity_m_s2: FloatArray, q: FloatArray, v: FloatArray) -> list[Scalar]:
    """Momenta p = M(q) v, then C(q, v)^T v - G(q)."""
    joints = joints_at(links, q)
    moving: list[tuple[Vector, Vector]] = []
    momenta = {}
    for number, (joint, speed) in enumerate(zip(joints, v, strict=True)):
        link, h = joint.link, vector_of(joint.link.first_kg_m)
        turn, velocity = moving[link.parent] if link.parent >= 0 else (ZERO, ZERO)
        velocity = joint.into(plus(velocity, cross(turn, joint.offset)))
        turn = joint.into(turn)
        velocity, turn = (add_z(velocity, speed), turn) if link.prismatic else (velocity, add_z(turn, speed))
        moving.append((turn, velocity))
        linear = plus(scaled(link.mass_kg, velocity), cross(turn, h))
        momenta[number] = (linear, plus(matrix_times(link.inertia.tolist(), turn), cross(h, velocity)))
    momentum: list[Scalar] = []
    rest: list[Scalar] = []
    for joint, (linear, angular), (turn, velocity), speed, weight in zip(
        joints, _subtree_totals(joints, momenta), moving, v, _gravity_torques(joints, gravity_m_s2), strict=True
    ):
        momentum.append(_along_joint(joint.link, (linear, angular)) + joint.link.armature * speed)
        change = about_z(linear, turn)
        if not joint.link.prismatic:
            change = about_z(angular, turn) + about_z(linear, velocity)
        rest.append(change - weight)
    return [*momentum, *rest]


def force(links: Sequence[Link], place: FramePlacement, q: FloatArray, wrench: FloatArray) -> list[Scalar]:
    """J(q)^T F of a wrench (6, m) at the origin of a frame in its axes: joint torques."""
    return _at_joints(joints_at(links, q), {place.link: _wrench_in_link(place, wrench)})


def force_less_body(
    links: Sequence[Link],
    place: FramePlacement,
    carried: tuple[FramePlacement, float, FloatArray],
    q: FloatArray,
    v: FloatArray,
    a: FloatArray,
    wrench: FloatArray,
) -> list[Scalar]:
    """:func:`force`, less what accelerating a point mass takes.

    ``carried``: frame, mass in kg and (3,) centre in that frame of the point mass, without weight.
    """
    joints = joints_at(links, q)
    where, mass_kg, centre = carried
    wrenches = {place.link: _wrench_in_link(place, wrench)}
    if where.link >= 0:
        point = vector_of(where.rotation @ centre + where.translation)
        at = list(motions_of(joints, v, a, ZERO))[where.link]
        wrenches[where.link] = _less_point_mass(wrenches.get(where.link, (ZERO, ZERO)), at, mass_kg, point)
    return _at_joints(joints, wrenches)


def _wrench_in_link(place: FramePlacement, wrench: FloatArray) -> tuple[Vector, Vector]:
    """A force and a moment (6, m) at a frame's origin, about the origin of its link and in its axes."""
    force = matrix_times(place.rotation.tolist(), wrench[:3])
    moment = matrix_times(place.rotation.tolist(), wrench[3:])
    return force, plus(moment, cross(vector_of(place.translation), force))


def _less_point_mass(wrench: tuple[Vector, Vector], at: Motion, mass_kg: float, point: Vector) -> tuple[Vector, Vector]:
    """A wrench on a link, less what it takes to move a point mass along with it."""
    inertial = scaled(-mass_kg, plus(at.acceleration, matrix_times(at.spin_matrix, point)))
    return plus(wrench[0], inertial), plus(wrench[1], cross(point, inertial))


def weight(
    links: Sequence[Link],
    place: FramePlacement,
    mass_kg: float,
    com_m: FloatArray,
    gravity_m_s2: FloatArray,
    q: FloatArray,
) -> list[Scalar]:
    """Force and moment, in a frame's axes at its origin, of the weight of a point mass at ``com_m`` (3,) in it."""
    weight_n = into_link(joints_at(links, q), place.link, vector_of(mass_kg * gravity_m_s2))
    force = matrix_times(place.rotation.T.tolist(), weight_n)
    return [*force, *cross(vector_of(com_m), force)]


def _euler_moment(inertia: FloatArray, at: Motion) -> Vector:
    """I α + ω × I ω, by the entries of U."""
    (x, y, z), (ax, ay, az), u = at.angular_velocity, at.angular_acceleration, at.spin_matrix
    (xx, xy, xz), (_, yy, yz), (_, _, zz) = inertia.tolist()
    return (
        xx * ax + (zz - yy) * (y * z) + yz * (y * y - z * z) + xz * u[1][0] - xy * u[2][0],
        yy * ay + (xx - zz) * (x * z) + xz * (z * z - x * x) + xy * u[2][1] - yz * u[0][1],
        zz * az + (yy - xx) * (x * y) + xy * (x * x - y * y) + yz * u[0][2] - xz * u[1][2],
    )


def _at_joints(joints: Sequence[Joint], wrenches: Mapping[int, tuple[Vector, Vector]]) -> list[Scalar]:
    """What each joint feels of the wrenches on links, by their numbers; on the base (-1) they are felt by none."""
    totals = _subtree_totals(joints, wrenches)
    return [_along_joint(joint.link, total) for joint, total in zip(joints, totals, strict=True)]


def _subtree_totals(joints: Sequence[Joint], own: Mapping[int, tuple[Vector, Vector]]) -> list[tuple[Vector, Vector]]:
    """Forces and moments (or momenta) of each joint's whole subtree, from those of links by their numbers."""
    nothing = (ZERO, ZERO)
    total = [own.get(number, nothing) for number in range(len(joints))]
    for k in range(len(joints) - 1, -1, -1):
        joint, parent = joints[k], joints[k].link.parent
        if parent >= 0 and total[k] is not nothing:
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
