"""The pieces of the identification problem that are the same in every step of its solution."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from collaudit.core.data.identification_result import DEGREE
from collaudit.core.identification.problem.identification_samples import Motion
from collaudit.core.identification.problem.nuisance import angle_columns, nuisance_columns
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray


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
        nuisance: (j, n, k) columns of friction and offset (``nuisance.py``), before the drift those of springs.
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

    def over(self, motion: Motion) -> Terms:
        """The same columns for the same samples of which others count."""
        return replace(self, motion=motion)

    def without_drift(self) -> Terms:
        """The same with an offset that stays, as for predicting another time."""
        return replace(self, nuisance=self.nuisance[:, :, : self.nuisance.shape[2] - self.motion.drift.shape[1]])

    def by_cluster(self, values: FloatArray) -> FloatArray:
        """Sums of (n,) or (n, k) values over each cluster."""
        return np.asarray(np.add.reduceat(values, self.starts, axis=0))
