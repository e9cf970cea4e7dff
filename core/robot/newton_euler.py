"""The recursive Newton-Euler algorithm (Luh, Walker, Paul 1980) over a robot's links, for many samples at once.

Each link's quantities are vectors (3, m), one column a sample, in its joint's axes and about its joint's origin. Every
joint turns about, or slides along, the z of its axes. Positions, velocities and accelerations are (j, m).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from collaudit.core.numeric.arrays import FloatArray, blocks
from collaudit.core.numeric.parallel import each


@dataclass(frozen=True, slots=True, eq=False)
class Link:
    """A joint and the body it moves.

    Attributes:
        parent: number of the joint that moves this one, -1 for the base.
        prismatic: whether it slides along z; else it turns about z.
        rotation, translation: (3, 3), (3,) m: pose of its axes at position zero in its parent's.
        mass_kg: of the body.
        first_kg_m: (3,) mass times centre of mass, in the joint's axes.
        inertia: (3, 3) kg·m² about the joint's origin.
        armature: reflected rotor inertia, kg·m² or kg.
    """

    parent: int
    prismatic: bool
    rotation: FloatArray
    translation: FloatArray
    mass_kg: float
    first_kg_m: FloatArray
    inertia: FloatArray
    armature: float

    @property
    def moves_a_body(self) -> bool:
        """Whether the joint itself moves anything but a rotor."""
        return bool(self.mass_kg or self.first_kg_m.any() or self.inertia.any())

    def less(self, other: Link) -> Link:
        """The same joint with what its body and rotor have more than another's: torques are linear in them."""
        return replace(
            self,
            mass_kg=self.mass_kg - other.mass_kg,
            first_kg_m=self.first_kg_m - other.first_kg_m,
            inertia=self.inertia - other.inertia,
            armature=self.armature - other.armature,
        )


@dataclass(frozen=True, slots=True, eq=False)
class FramePlacement:
    """A frame: the number of the joint that moves it (-1: none), and its (3, 3), (3,) pose in that joint's axes."""

    link: int
    rotation: FloatArray
    translation: FloatArray


#: A force and a moment, or a linear and an angular momentum, (3, m) each.
Wrench = tuple[FloatArray, FloatArray]
#: A point mass: its frame, kg, and its centre (3,) m there.
Body = tuple[FramePlacement, float, FloatArray]
_Z = np.array([[0.0], [0.0], [1.0]])


@dataclass(frozen=True, slots=True, eq=False)
class Joint:
    """A joint at its positions: ways into and out of its axes, and its origin (3, m) in its parent's axes.

    The origin of one that turns stays where it is: (3, 1).
    """

    link: Link
    cos: FloatArray
    sin: FloatArray
    offset: FloatArray

    @classmethod
    def at(cls, link: Link, position: FloatArray) -> Joint:
        """A joint at (m,) positions."""
        offset = link.translation[:, None]
        if link.prismatic:
            return cls(link, np.ones_like(position), np.zeros_like(position), offset + link.rotation @ _Z * position)
        return cls(link, np.cos(position), np.sin(position), offset)

    def into(self, x: FloatArray) -> FloatArray:
        """From its parent's axes into its own."""
        out = self.link.rotation.T @ x
        out[0], out[1] = self.cos * out[0] + self.sin * out[1], self.cos * out[1] - self.sin * out[0]
        return np.asarray(out)

    def out_of(self, x: FloatArray) -> FloatArray:
        """From its own axes into its parent's."""
        turned = x.copy()
        turned[0], turned[1] = self.cos * x[0] - self.sin * x[1], self.sin * x[0] + self.cos * x[1]
        return np.asarray(self.link.rotation @ turned)

    def along(self, wrench: Wrench) -> FloatArray:
        """(m,) what it feels of a force and a moment."""
        force, moment = wrench
        return np.asarray(force[2] if self.link.prismatic else moment[2])


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """A link's angular velocity ω and acceleration α, and the acceleration of its origin."""

    omega: FloatArray
    alpha: FloatArray
    acceleration: FloatArray

    def at(self, point: FloatArray) -> FloatArray:
        """Acceleration of a point of the link."""
        return self.acceleration + cross(self.alpha, point) + cross(self.omega, cross(self.omega, point))


def cross(x: FloatArray, y: FloatArray) -> FloatArray:
    """x × y."""
    out = np.empty((3, max(x.shape[1], y.shape[1])))
    np.subtract(x[1] * y[2], x[2] * y[1], out=out[0])
    np.subtract(x[2] * y[0], x[0] * y[2], out=out[1])
    np.subtract(x[0] * y[1], x[1] * y[0], out=out[2])
    return out


def joints_at(links: Sequence[Link], q: FloatArray) -> list[Joint]:
    """The joints at positions (j, m)."""
    return [Joint.at(link, position) for link, position in zip(links, q, strict=True)]


def motions_of(joints: Sequence[Joint], v: FloatArray, a: FloatArray, base: FloatArray) -> list[Motion]:
    """Of each link, on a base that accelerates by ``base`` (3,)."""
    still = np.zeros((3, v.shape[1]))
    rest, out = Motion(still, still, still + base[:, None]), list[Motion]()
    for joint, speed, rate in zip(joints, v, a, strict=True):
        before = out[joint.link.parent] if joint.link.parent >= 0 else rest
        omega, alpha = joint.into(before.omega), joint.into(before.alpha)
        acceleration = joint.into(before.at(joint.offset))
        own = np.array([omega[1] * speed, -omega[0] * speed, rate])  # ω × (speed z), and the rate along z
        if joint.link.prismatic:
            own[:2] *= 2.0
            acceleration += own
        else:
            alpha += own
            omega[2] += speed
        out.append(Motion(omega, alpha, acceleration))
    return out


def inverse_dynamics(
    links: Sequence[Link], gravity_m_s2: FloatArray, q: FloatArray, v: FloatArray, a: FloatArray
) -> FloatArray:
    """(j, m) torque of each joint, M(q) a + C(q, v) v + G(q), rotor inertia included."""
    rotors = np.array([[link.armature] for link in links]) * a
    if not any(link.moves_a_body for link in links):
        return rotors
    joints, wrenches = joints_at(links, q), {}
    for number, motion in enumerate(motions_of(joints, v, a, -gravity_m_s2)):
        link, h = links[number], links[number].first_kg_m[:, None]
        if not link.moves_a_body:
            continue
        turned = cross(motion.alpha, h) + cross(motion.omega, cross(motion.omega, h))
        force = link.mass_kg * motion.acceleration + turned
        spin = link.inertia @ motion.alpha + cross(motion.omega, link.inertia @ motion.omega)
        wrenches[number] = (force, spin + cross(h, motion.acceleration))
    return _at_joints(joints, wrenches) + rotors


def momentum(links: Sequence[Link], gravity_m_s2: FloatArray, q: FloatArray, v: FloatArray) -> FloatArray:
    """(2 j, m) momenta p = M(q) v, then C(q, v)^T v - G(q).

    With the momentum (P, L) of everything a joint moves, M(q) v is its component along the joint, and C(q, v)^T v, the
    derivative of the kinetic energy by the joint's position, is L·(ω × z) + P·(v × z).
    """
    joints, momenta = joints_at(links, q), {}
    moving: list[tuple[FloatArray, FloatArray]] = []
    still = np.zeros((3, v.shape[1]))
    for number, (joint, speed) in enumerate(zip(joints, v, strict=True)):
        link, h = joint.link, joint.link.first_kg_m[:, None]
        omega, velocity = moving[link.parent] if link.parent >= 0 else (still, still)
        velocity, omega = joint.into(velocity + cross(omega, joint.offset)), joint.into(omega)
        velocity, omega = (velocity + speed * _Z, omega) if link.prismatic else (velocity, omega + speed * _Z)
        moving.append((omega, velocity))
        momenta[number] = link.mass_kg * velocity + cross(omega, h), link.inertia @ omega + cross(h, velocity)
    along, change = [], []
    for joint, (linear, angular), (omega, velocity), speed in zip(
        joints, _subtrees(joints, momenta), moving, v, strict=True
    ):
        along.append(joint.along((linear, angular)) + joint.link.armature * speed)
        turned = cross(linear, omega) if joint.link.prismatic else cross(angular, omega) + cross(linear, velocity)
        change.append(turned[2])
    return np.concatenate([along, np.array(change) - holding(links, gravity_m_s2, q)])


def holding(links: Sequence[Link], gravity_m_s2: FloatArray, q: FloatArray) -> FloatArray:
    """(j, m) torque G(q) of each joint that holds the arm: :func:`inverse_dynamics` at rest."""
    joints = joints_at(links, q)
    lifted = _in_links(joints, np.zeros((3, q.shape[1])) - gravity_m_s2[:, None])
    both = enumerate(zip(links, lifted, strict=True))
    return _at_joints(joints, {k: (link.mass_kg * up, cross(link.first_kg_m[:, None], up)) for k, (link, up) in both})


def force(links: Sequence[Link], place: FramePlacement, q: FloatArray, wrench: FloatArray) -> FloatArray:
    """(j, m) joint torques J(q)^T F of a wrench (6, m) at the origin of a frame in its axes."""
    return _at_joints(joints_at(links, q), {place.link: _in_link(place, wrench)})


def force_less_body(
    links: Sequence[Link],
    place: FramePlacement,
    carried: Body,
    q: FloatArray,
    v: FloatArray,
    a: FloatArray,
    wrench: FloatArray,
) -> FloatArray:
    """:func:`force`, less what accelerating a point mass takes, its weight apart."""
    frame, mass_kg, centre = carried
    joints, felt = joints_at(links, q), {place.link: _in_link(place, wrench)}
    if frame.link >= 0:
        point = (frame.rotation @ centre + frame.translation)[:, None]
        needed = mass_kg * motions_of(joints, v, a, np.zeros(3))[frame.link].at(point)
        own_force, own_moment = felt.get(frame.link, (0.0, 0.0))
        felt[frame.link] = own_force - needed, own_moment - cross(point, needed)
    return _at_joints(joints, felt)


def weight(
    links: Sequence[Link], place: FramePlacement, mass_kg: float, com_m: FloatArray, gravity: FloatArray, q: FloatArray
) -> FloatArray:
    """(6, m) force and moment, in a frame's axes at its origin, of the weight of a point mass at ``com_m`` in it."""
    pull = np.zeros((3, q.shape[1])) + mass_kg * gravity[:, None]
    own = place.rotation.T @ (_in_links(joints_at(links, q), pull)[place.link] if place.link >= 0 else pull)
    return np.concatenate([own, cross(com_m[:, None], own)])


def _in_links(joints: Sequence[Joint], vector: FloatArray) -> list[FloatArray]:
    """A vector (3, m) of the base in the axes of each link."""
    out = list[FloatArray]()
    for joint in joints:
        out.append(joint.into(out[joint.link.parent] if joint.link.parent >= 0 else vector))
    return out


def _in_link(place: FramePlacement, wrench: FloatArray) -> Wrench:
    """A force and a moment (6, m) at a frame's origin, about the origin of its link and in its axes."""
    force, moment = place.rotation @ wrench[:3], place.rotation @ wrench[3:]
    return force, moment + cross(place.translation[:, None], force)


def _at_joints(joints: Sequence[Joint], wrenches: Mapping[int, Wrench]) -> FloatArray:
    """(j, m) what each joint feels of the wrenches on links, by their numbers; on the base (-1) none feels any."""
    return np.array([joint.along(total) for joint, total in zip(joints, _subtrees(joints, wrenches), strict=True)])


def _subtrees(joints: Sequence[Joint], own: Mapping[int, Wrench]) -> list[Wrench]:
    """Forces and moments (or momenta) of each joint's whole subtree, from those of links by their numbers."""
    nothing = np.zeros((3, joints[0].cos.size))
    total = [own.get(number, (nothing, nothing)) for number in range(len(joints))]
    for number in range(len(joints) - 1, -1, -1):
        joint, parent = joints[number], joints[number].link.parent
        if parent >= 0 and total[number][0] is not nothing:
            force, moment = (joint.out_of(x) for x in total[number])
            before = total[parent]
            total[parent] = before[0] + force, before[1] + moment + cross(joint.offset, force)
    return total


#: Samples at a time: so many that two threads seldom wait for each other to call NumPy (with 8,192 they took as long as
#: one), few enough that what is worked on stays in the last level of the cache.
_BLOCK = 32_768


def evaluate(compute: Callable[..., FloatArray], signals: Sequence[FloatArray], outputs: int) -> FloatArray:
    """(n, outputs) of a computation over all samples; one with any input that is not finite is NaN altogether.

    Args:
        compute: from (c, m) of each signal to (outputs, m).
        signals: (n, c) each.
        outputs: numbers that come out of a sample.
    """
    count = signals[0].shape[0]
    out = np.empty((count, outputs), order="F")

    def one(block: slice) -> None:
        rows = [signal[block].T for signal in signals]
        known = np.all([np.isfinite(x).all(axis=0) for x in rows], axis=0)
        with np.errstate(invalid="ignore"):  # the sine of what is not finite is not a number, and that is right
            out[block] = np.where(known, compute(*rows), np.nan).T

    each(one, list(blocks(count, _BLOCK)))
    return out
