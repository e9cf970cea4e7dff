"""The pieces of the identification problem that are the same in every step of its solution.

A joint's torque holds more than the rigid body; that is projected out, as columns of *nuisance*.
A law of friction that is too poor biases what it is projected from: what sliding friction does at low speed has the
sign of the motion, as the torque of a ramp has, and friction that follows the speed late (frictional lag: Rabinowicz,
Proc. Phys. Soc. 71, 1958; LuGre: Canudas de Wit et al., IEEE Trans. Automatic Control 40, 1995) has the shape of
inertia. So the columns are sgn v, v and 1; |v|, which tells the directions apart; sgn v·exp(-|v|/w) for two widths;
and a·exp(-|v|/w) for the lag. The offset may wander: hat functions over each log. A spring or counterbalance adds a
polynomial in one joint's angle.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from collaudit.core.data.identification_result import DEGREE, AngleTorque, scaled_angle
from collaudit.core.identification.problem.identification_samples import Motion
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray
from collaudit.core.numeric.stats import interval_95

#: Columns of friction and offset of a joint, and which of them is the offset.
FRICTION_COLUMNS, OFFSET = 7, 2
_COUPLED = 3
_LOW_SPEEDS = (0.03, 0.1)  # rad/s: Stribeck velocities of gears lie between
#: rad (or m) that a joint must cover for its angle to tell anything.
_LEAST_RANGE = 0.2


@dataclass(frozen=True, slots=True, eq=False)
class Unknowns:
    """What is known before the data, and how well.

    Attributes:
        inertials: (p,) prior of the inertial parameters.
        inertials_prior_sd: (p,) its standard deviation; 0 holds a parameter.
        armature, armature_prior_sd: (j,) the same for rotor inertia.
        gain: (j,) starting values of the drive gains.
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

    @property
    def values(self) -> FloatArray:
        """(p + 2 j,) inertials, rotor inertias and gains before the data."""
        return np.concatenate([self.inertials, self.armature, self.gain])

    @property
    def sd(self) -> FloatArray:
        """(p + 2 j,) their standard deviations."""
        return np.concatenate([self.inertials_prior_sd, self.armature_prior_sd, self.gain_prior_sd])


@dataclass(frozen=True, slots=True, eq=False)
class Terms:
    """Columns of each joint's equation.

    Attributes:
        motion: the samples.
        columns: for each joint (n, f_j): derivatives by the inertial parameters that are free and that it feels.
        index: for each joint (f_j,): which parameters these are.
        nuisance: (j, n, k) columns of friction and offset, before the drift those of springs.
        one_way: (j,) joints of which the motion does not tell offset from friction.
        starts: (c,) first sample of each cluster; clusters follow one another.
    """

    motion: Motion
    columns: tuple[FloatArray, ...]
    index: tuple[IntArray, ...]
    nuisance: FloatArray
    one_way: BoolArray
    starts: IntArray

    @classmethod
    def of(cls, motion: Motion, unknowns: Unknowns) -> Terms:
        """Those of n samples of j joints, for unknowns with the same parameters free."""
        columns, index = [], []
        for own in np.moveaxis(motion.regressor, 1, 0):
            pick = np.flatnonzero((unknowns.inertials_prior_sd > 0) & np.any(own != 0.0, axis=0))
            columns.append(np.ascontiguousarray(own[:, pick]))
            index.append(np.asarray(pick, dtype=np.int64))
        nuisance, one_way = nuisance_columns(
            motion.velocity, motion.acceleration, motion.drift, motion.moving, motion.coupled
        )
        if unknowns.springs is not None and unknowns.springs.any():
            nuisance = np.insert(nuisance, [nuisance.shape[2] - motion.drift.shape[1]] * DEGREE, 0.0, axis=2)
            at = cls.angles_in(nuisance, motion)
            for k in np.flatnonzero(unknowns.springs):
                nuisance[k][:, at] = angle_columns(motion.position[:, k], motion.moving[:, k])
        starts = np.asarray(np.flatnonzero(np.diff(motion.cluster, prepend=-1)), dtype=np.int64)
        return cls(motion, tuple(columns), tuple(index), nuisance, one_way, starts)

    @staticmethod
    def angles_in(nuisance: FloatArray, motion: Motion) -> slice:
        """Which of the columns (or coefficients) of nuisance are those of angles, where there are any."""
        end = nuisance.shape[-1] - motion.drift.shape[1]
        return slice(end - DEGREE, end)

    def without_drift(self) -> Terms:
        """The same with an offset that stays, as for predicting another time."""
        return replace(self, nuisance=self.nuisance[:, :, : self.nuisance.shape[2] - self.motion.drift.shape[1]])

    def by_cluster(self, values: FloatArray) -> FloatArray:
        """Sums of (n,) or (n, k) values over each cluster."""
        return np.asarray(np.add.reduceat(values, self.starts, axis=0))


def friction_columns(velocity: FloatArray, acceleration: FloatArray) -> FloatArray:
    """(n, 7) sgn v, v, 1, |v|, two that fade with speed, and the lag, for one joint.

    Args:
        velocity: (n,) rad/s; acceleration: (n,) rad/s².
    """
    sign, speed = np.sign(velocity), np.abs(velocity)
    fading = [sign * np.exp(-speed / width) for width in _LOW_SPEEDS]
    lag = acceleration * np.exp(-speed / _LOW_SPEEDS[-1])
    return np.column_stack([sign, velocity, np.ones_like(speed), speed, *fading, lag])


def nuisance_columns(
    velocity: FloatArray, acceleration: FloatArray, drift: FloatArray, moving: BoolArray, coupled: FloatArray
) -> tuple[FloatArray, BoolArray]:
    """(j, n, 7 + 3 c + d) columns of every joint, and (j,) which joints move one way only.

    Of those friction and offset are one: what is the same both ways is left to friction.

    Args:
        velocity, acceleration, moving: (n, j).
        drift: (n, d).
        coupled: (c, j) weights of the joints in the speeds of axes that turn with several: their friction and drive
            inertia are columns of each of these joints.
    """
    joints = velocity.shape[1]
    first = FRICTION_COLUMNS + _COUPLED * coupled.shape[0]
    out = np.zeros((joints, velocity.shape[0], first + drift.shape[1]))
    one_way = np.zeros(joints, dtype=bool)
    for j in range(joints):
        out[j, :, :FRICTION_COLUMNS] = friction_columns(velocity[:, j], acceleration[:, j])
        for c in np.flatnonzero(coupled[:, j]):
            s = velocity @ coupled[c]
            at = FRICTION_COLUMNS + _COUPLED * c
            out[j, :, at : at + _COUPLED] = np.column_stack([np.sign(s), s, acceleration @ coupled[c]])
        out[j, :, first:] = drift
        ahead = np.count_nonzero(velocity[moving[:, j], j] > 0)
        total = np.count_nonzero(moving[:, j])
        one_way[j] = min(ahead, total - ahead) < 0.01 * total
        if one_way[j]:
            out[j][:, [OFFSET, OFFSET + 1]] = 0.0
    return out, one_way


def angle_columns(position: FloatArray, moving: BoolArray) -> FloatArray:
    """(n, 4) Legendre polynomials of the angle over the range seen, less their means; zero where it is too small.

    Args:
        position: (n,) of one joint; moving: (n,) where it counts.
    """
    found = _range(position, moving)
    out = np.zeros((position.size, DEGREE))
    if found is None:
        return out
    every = _polynomials(position, *found)
    return np.asarray(every - every[moving].mean(axis=0))


def angle_torque(
    position: FloatArray, moving: BoolArray, coefficients: FloatArray, covariance: FloatArray | None
) -> AngleTorque | None:
    """The torque that coefficients stand for; None where the motion tells none.

    Args:
        position, moving: as of :func:`angle_columns`.
        coefficients: (4,) of its columns; covariance: (4, 4) of them, None without intervals.
    """
    found = _range(position, moving)
    if found is None:
        return None
    nodes = np.linspace(*found, DEGREE + 1)
    columns = _polynomials(nodes, *found) - _polynomials(position[moving], *found).mean(axis=0)
    torque = columns @ coefficients
    angles = tuple(nodes.tolist())
    if covariance is None:
        return AngleTorque(angles, tuple(torque.tolist()))
    sd = np.sqrt(np.maximum(np.einsum("ij,jk,ik->i", columns, covariance, columns), 0.0))
    return AngleTorque(angles, tuple(torque.tolist()), tuple(map(interval_95, torque, sd)))


def _range(position: FloatArray, moving: BoolArray) -> tuple[float, float] | None:
    if not moving.any():
        return None
    low, high = float(position[moving].min()), float(position[moving].max())
    return (low, high) if high - low >= _LEAST_RANGE else None


def _polynomials(position: FloatArray, low: float, high: float) -> FloatArray:
    every = np.polynomial.legendre.legvander(np.clip(scaled_angle(position, low, high), -1.0, 1.0), DEGREE)
    return np.asarray(every[:, 1:])
