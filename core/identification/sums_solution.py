"""Inertials, rotors, gains and friction solved together from sums, with a prior; errors, and parts held out.

For joint j:  effort_j / k_j - model_j = (Y(q, dq, ddq) d)_j + dI_j ddq_j + friction_j + offset_j + noise, with drive
gain k, changes d and dI of the described inertial parameters and rotor inertia; beside them what
``torque_terms.py`` has. Inertial parameters count in directions of which each is a standard deviation of their
prior, so that what no torque depends on keeps it. The problem is linear but for the gain (Gauss and Newton). A joint's
noise is told from what is left; neighbouring errors are alike: the data's weight against the prior is divided by how
much more the sum of errors over a block varies than independent errors would (Kish's design effect).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from collaudit.core.identification.motion_sums import MotionSums
from collaudit.core.identification.torque_terms import OFFSET, prior_directions
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray
from collaudit.core.robot.robot_model import RobotModel
from collaudit.core.torque_table.block_sums import explained, scatter, solutions

#: Rounds in which noise and prior are balanced, and gains found where they are open.
_ROUNDS, _ROUNDS_OF_GAINS = 4, 12
#: Blocks of fewer rows say nothing of a held-out error.
_FEWEST = 5


@dataclass(frozen=True, slots=True, eq=False)
class Unknowns:
    """What is known before the data, and how well.

    Attributes:
        inertials: (p,) prior of the inertial parameters.
        inertials_prior_sd: (p,) its standard deviation; 0 holds a parameter.
        armature, armature_prior_sd: (j,) the same for rotor inertia.
        gain: (j,) starting values of the drive gains; NaN where none is known.
        gain_prior_sd: (j,) prior of the gains about ``gain``; 0 holds one, inf leaves it to the data.
        springs: (j,) joints with a torque by their angle; None for none.
    """

    inertials: FloatArray
    inertials_prior_sd: FloatArray
    armature: FloatArray
    armature_prior_sd: FloatArray
    gain: FloatArray
    gain_prior_sd: FloatArray
    springs: BoolArray | None = None

    def held(self, inertials: FloatArray, armature: FloatArray) -> Unknowns:
        """The same with inertials and rotors as given: only friction and offset are open."""
        none, rotors = np.zeros_like(inertials), np.zeros_like(armature)
        return replace(self, inertials=inertials, inertials_prior_sd=none, armature=armature, armature_prior_sd=rotors)

    @property
    def sprung(self) -> BoolArray:
        """(j,) joints with a torque by their angle."""
        return np.zeros(self.gain.size, dtype=np.bool_) if self.springs is None else self.springs

    @property
    def started(self) -> FloatArray:
        """(j,) gains before the data; 1 where none is known, and nothing counts."""
        return np.where(np.isfinite(self.gain), self.gain, 1.0)

    def expected(self, kinds: int) -> Solution:
        """All that is known before the data, with so many coefficients of friction and offset."""
        joints = self.gain.size
        return Solution(self.inertials, self.armature, self.started, np.zeros((joints, kinds)), np.ones(joints))


@dataclass(frozen=True, slots=True, eq=False)
class Solution:
    """What the data and the prior say together.

    Attributes:
        inertials: (p,); armature: (j,); gain: (j,).
        nuisance: (j, k) coefficients of friction and offset, N·m; the offset is number ``OFFSET``.
        precision: (j,) of one row, the likeness of its neighbours taken off, 1/(N·m)².
    """

    inertials: FloatArray
    armature: FloatArray
    gain: FloatArray
    nuisance: FloatArray
    precision: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class StandardErrors:
    """How well a solution is known; standard errors are such that 1.96 of them span the 95 % interval.

    Attributes:
        inertials: (p, p) covariance, prior included.
        armature_sd, gain_sd, offset_sd: (j,), the other unknowns' errors included.
        angle: (j, 4, 4) covariance of the torque by the angle.
        load: (l, l) covariance of what like motion tells of some inertial parameters, friction beside; of those asked
            for.
    """

    inertials: FloatArray
    armature_sd: FloatArray
    gain_sd: FloatArray
    offset_sd: FloatArray
    angle: FloatArray
    load: FloatArray


def own_armature(robot: RobotModel) -> FloatArray:
    """(j,) rotor inertia that the description states of the bodies' own joints, kg·m²."""
    names = robot.inertial_bodies().joint_names
    return np.asarray(robot.armature[[names.index(name) for name in robot.joint_names]])


@dataclass(frozen=True, slots=True, eq=False)
class Problem:
    """Sums with what is unknown of them.

    The coefficients (m,) are r of the inertial parameters, rotors and gains (j,) each, then friction and offset (j, k):
    all by how much they differ from the prior.

    Attributes:
        sums: without joints whose gain is not known.
        unknowns: before the data.
        directions: (p, r) of the inertial parameters, each a standard deviation of the prior.
        along: (d, r) the same in combinations that torques depend on.
        drift: whether the offset may wander: not where another time is predicted.
    """

    sums: MotionSums
    unknowns: Unknowns
    directions: FloatArray
    along: FloatArray
    drift: bool

    @classmethod
    def of(cls, sums: MotionSums, unknowns: Unknowns, drift: bool = True) -> Problem:
        """The problem of a prior."""
        directions, known = prior_directions(sums.base, unknowns.inertials_prior_sd), np.isfinite(unknowns.gain)
        return cls(sums if known.all() else sums.only(known), unknowns, directions, sums.base @ directions, drift)

    @property
    def kinds(self) -> int:
        """Columns of friction and offset."""
        return self.sums.parts["end"] - self.sums.parts["law"]

    @property
    def place(self) -> IntArray:
        """(j, r + 2 + k) numbers of the coefficients that each joint feels."""
        r, joints = self.along.shape[1], self.unknowns.gain.size
        each, shared = np.arange(joints)[:, None], np.broadcast_to(np.arange(r), (joints, r))
        friction = r + 2 * joints + self.kinds * each + np.arange(self.kinds)
        return np.hstack([shared, r + each, r + joints + each, friction])

    def rest(self, at: Solution) -> FloatArray:
        """(j, c) what columns are multiplied by to give the torque that a solution leaves."""
        parts, robot = self.sums.parts, self.sums.robot
        out = np.zeros((at.gain.size, parts["end"]))
        out[:, parts["effort"]] = 1.0 / at.gain
        out[:, parts["model"]] = -1.0
        out[:, parts["spin"]] = own_armature(robot) - at.armature
        out[:, self.sums.columns("base")] = self.sums.base @ (robot.inertial_parameters - at.inertials)
        out[:, self.sums.nuisance] = -at.nuisance
        return out

    def columns(self, at: Solution) -> FloatArray:
        """(j, c, r + 2 + k + 1) by which columns become those of the coefficients and, last, what these explain."""
        parts, x, r = self.sums.parts, self.unknowns, self.along.shape[1]
        out = np.zeros((at.gain.size, parts["end"], r + 3 + self.kinds))
        out[:, self.sums.columns("base"), :r] = self.along
        out[:, parts["spin"], r] = x.armature_prior_sd > 0.0
        by_gain = -self.rest(at) / at.gain[:, None]
        by_gain[:, parts["effort"]] += at.gain**-2.0
        out[:, :, r + 1] = by_gain * (x.gain_prior_sd > 0.0)[:, None]
        out[:, self.sums.nuisance, r + 2 : -1] = np.eye(self.kinds)
        out[:, self.sums.columns("drift")] *= self.drift
        out[:, self.sums.columns("angle")] *= x.sprung[:, None, None]
        out[:, :, -1] = self.rest(replace(x.expected(self.kinds), gain=at.gain))
        out[:, :, -1] += out[:, :, r + 1] * (at.gain - x.started)[:, None]
        return out

    def gram(self, products: FloatArray, at: Solution) -> FloatArray:
        """(m + 1, m + 1) products of all columns and, last, of what they explain; without the prior."""
        columns, place = self.columns(at), self.place
        local = np.swapaxes(columns, 1, 2) @ products @ columns * at.precision[:, None, None]
        out = np.zeros((self.along.shape[1] + (2 + self.kinds) * len(place) + 1,) * 2)
        for own, its in zip(place, local, strict=True):
            numbers = np.append(own, len(out) - 1)
            out[np.ix_(numbers, numbers)] += its
        return out

    def prior_precision(self, products: FloatArray, at: Solution) -> FloatArray:
        """(m,) of the coefficients. Where another time is predicted, some combinations of friction may be open there.

        No part of it is then expected to exceed its joint's whole torque.
        """
        e, nuisance = self.sums.parts["effort"], self.sums.nuisance
        squares = np.einsum("jcc->jc", products)
        friction = squares[:, nuisance] / np.maximum(squares[:, [e]], 1e-30) * at.gain[:, None] ** 2 * (not self.drift)
        held = [
            np.where(sd > 0.0, sd, np.inf) ** -2.0
            for sd in (self.unknowns.armature_prior_sd, self.unknowns.gain_prior_sd)
        ]
        return np.concatenate([np.ones(self.along.shape[1]), *held, friction.ravel()])

    def fitted(self, products: FloatArray, at: Solution) -> Solution:
        """The solution by products (j, c, c), with noise and gains about those of another one."""
        gram, (r, joints) = self.gram(products, at), (self.along.shape[1], at.gain.size)
        size = len(gram) - 1
        gram[np.arange(size), np.arange(size)] += self.prior_precision(products, at)
        inertials, armature, gain, nuisance = np.split(
            solutions(gram[None], tuple(range(size)))[0][0], [r, r + joints, r + 2 * joints]
        )
        x = self.unknowns
        gain = x.started + gain
        return Solution(
            x.inertials + self.directions @ inertials,
            x.armature + armature,
            np.where(np.abs(gain) > 1e-9, gain, at.gain),
            nuisance.reshape(joints, -1),
            at.precision,
        )

    def left(self, products: FloatArray, at: Solution) -> FloatArray:
        """(j,) sum of squares that a solution leaves of products (j, c, c)."""
        rest = self.rest(at)
        return np.asarray(np.maximum(np.einsum("jc,jcd,jd->j", rest, products, rest), 0.0))

    def solved(self) -> Solution:
        """The solution by all blocks; noise and prior are balanced, and gains found, in rounds."""
        at = self.unknowns.expected(self.kinds)
        for _ in range(_ROUNDS_OF_GAINS if (self.unknowns.gain_prior_sd > 0.0).any() else _ROUNDS):
            at = self.fitted(self.sums.total, self.weighed(at))
        return self.weighed(at)

    def weighed(self, at: Solution) -> Solution:
        """The same with the precision of its rows."""
        (by_block, again), count = self.sums.level, self.sums.counted
        together = np.einsum("bjc,jc->bj", by_block, self.rest(at))
        left = np.maximum(self.left(self.sums.total, at), 1e-8 * np.maximum(count, 1.0))
        alike = np.sum(together**2, axis=0) / np.maximum(self.left(again, at), 1e-30)
        return replace(at, precision=count / left / np.maximum(alike, 1.0))

    def rms(self, at: Solution) -> list[float | None]:
        """What a solution leaves of each joint, N·m."""
        left = zip(self.left(self.sums.total, at), self.sums.counted, strict=True)
        return [float(np.sqrt(square / count)) if count > 0 else None for square, count in left]

    def possible_precision(self, at: Solution, free: BoolArray) -> FloatArray:
        """(f, f) precision of free inertials and rotors (p + 2 j,), friction and offset left to the data."""
        base, x = self.sums.base, self.unknowns
        d, joints, p = len(base), at.gain.size, base.shape[1]
        gram = replace(self, along=np.eye(d)).gram(self.sums.total, at)[:-1, :-1]
        k = d + 2 * joints
        data = gram[:k, :k] - gram[:k, k:] @ explained(gram[k:, k:], gram[k:, :k], np.zeros(k))[0]
        onto = np.zeros((k, p + 2 * joints))
        onto[:d, :p], onto[d:, p:] = base, np.eye(2 * joints)
        sd = np.concatenate([x.inertials_prior_sd, x.armature_prior_sd, x.gain_prior_sd])[free]
        return np.asarray(onto[:, free].T @ data @ onto[:, free] + np.diag(sd**-2.0))

    def errors(self, at: Solution, load: slice = slice(0)) -> StandardErrors:
        """Covariance of all unknowns together, friction and offset among them, from the scatter between blocks.

        Args:
            at: the solution.
            load: inertial parameters that another log may tell.
        """
        parts, products = self.sums.parts, self.sums.total
        r, joints, size = self.along.shape[1], at.gain.size, np.sqrt(at.precision)
        first = r + 2 * joints + self.kinds * np.arange(joints)
        angle = np.arange(parts["angle"], parts["drift"]) - parts["law"]
        own = np.concatenate([np.arange(r + 2 * joints), first + OFFSET, (first[:, None] + angle).ravel()])
        full = scatter(
            self.sums.products,
            self.rest(at) * size[:, None],
            self.columns(at)[..., :-1] * size[:, None, None],
            self.place,
            self.gram(products, at)[:-1, :-1],
            self.prior_precision(products, at),
            np.hstack([np.eye(self.place.max() + 1)[:, own], self._taken(at, load)]),
        )
        armature, gain, offset = np.sqrt(np.maximum(np.diag(full)[r : r + 3 * joints], 0.0)).reshape(3, joints)
        springs = full[r + 3 * joints : own.size, r + 3 * joints : own.size].reshape(2 * (joints, angle.size))
        unseen = np.diag(self.unknowns.inertials_prior_sd**2) - self.directions @ self.directions.T
        return StandardErrors(
            self.directions @ full[:r, :r] @ self.directions.T + unseen,
            armature,
            gain,
            offset,
            springs[np.arange(joints), :, np.arange(joints)],
            full[own.size :, own.size :],
        )

    def _taken(self, at: Solution, load: slice) -> FloatArray:
        """(m, l) by how much inertial parameters, told with friction alone, take up what is wrong of the others."""
        along, r = self.sums.base[:, load], self.along.shape[1]
        gram = replace(self, along=np.hstack([self.along, along])).gram(self.sums.total, at)[:-1, :-1]
        own, every = r + np.arange(along.shape[1]), np.arange(len(gram))
        others = np.delete(every, own)
        told = np.concatenate([own, every[r + along.shape[1] + 2 * at.gain.size :]])
        return explained(gram[np.ix_(told, told)], gram[np.ix_(told, others)], np.zeros(others.size))[0][: own.size].T


def held_out(sums: MotionSums, unknowns: Unknowns, divisions: Sequence[IntArray]) -> FloatArray:
    """(b, j) RMS torque that is left of each block by a fit without its part, N·m; over the divisions (b,).

    A part is left out of the sums; noise is that of all. NaN where a joint hardly counts.
    """
    problem = Problem.of(sums, unknowns, drift=False)
    at, its, squares = problem.solved(), problem.sums, np.zeros(sums.count.shape)
    for part in divisions:
        without = np.array([problem.rest(problem.fitted(its.total - own, at)) for own in its.of_parts(part)])[part]
        squares += its.weight * np.sum((its.raw @ without[..., None])[..., 0] * without, axis=2)
    count, known = its.weight * its.count, its.count >= _FEWEST
    return np.sqrt(np.maximum(squares, 0.0) / len(divisions) / np.where(known, count, np.nan))
