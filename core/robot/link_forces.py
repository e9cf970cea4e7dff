"""Forces on links as torques of their joints, and directions in the axes of links, for many samples at once.

Each link's quantities are vectors (3, m), one column a sample, in its joint's axes and about its joint's origin. Every
joint turns about, or slides along, the z of its axes. Positions are (j, m).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from collaudit.core.numeric.arrays import FloatArray, blocks
from collaudit.core.numeric.parallel import each


@dataclass(frozen=True, slots=True, eq=False)
class Link:
    """A joint and its place on the joint before.

    Attributes:
        parent: number of the joint that moves this one, -1 for the base.
        prismatic: whether it slides along z; else it turns about z.
        rotation, translation: (3, 3), (3,) m: pose of its axes at position zero in its parent's.
    """

    parent: int
    prismatic: bool
    rotation: FloatArray
    translation: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class FramePlacement:
    """A frame: the number of the joint that moves it (-1: none), and its (3, 3), (3,) pose in that joint's axes."""

    link: int
    rotation: FloatArray
    translation: FloatArray


#: A force and a moment, (3, m) each.
Wrench = tuple[FloatArray, FloatArray]
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


def force(links: Sequence[Link], place: FramePlacement, q: FloatArray, wrench: FloatArray) -> FloatArray:
    """(j, m) joint torques J(q)^T F of a wrench (6, m) at the origin of a frame in its axes."""
    return _at_joints(joints_at(links, q), {place.link: _in_link(place, wrench)})


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
    """Forces and moments of each joint's whole subtree, from those of links by their numbers."""
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
