"""The solve of one cause: robust least squares, and what it takes away of blocks of time that it has not seen."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from collaudit.core.causes.excess import Excess, rms
from collaudit.core.causes.trials import Trial
from collaudit.core.numeric.arrays import BoolArray, FloatArray
from collaudit.core.numeric.stats import STANDARD_ERRORS_95
from collaudit.core.residual.followed_offsets import BOUND_SHARE, LARGEST
from collaudit.core.torque_table.block_sums import Estimate, estimate, products_of

#: Standard errors by which one cause must leave less than another to be told from it.
_CLEARLY = 3.0
#: What acts by the arm's pose. A zero that is held to its bound, or friction that changed in another way than by its
#: level, would be told as a part of it: 0.02 kg of a load, of a UR10.
_OF_POSES = frozenset({"tool", "mounting", "force", "pull"})


@dataclass(frozen=True, slots=True, eq=False)
class Solved:
    """One cause, tried.

    Attributes:
        trial: what was tried.
        value, half_width: (k,) parameters and half of their 95 % intervals, from blocks of time.
        share: of the excess that is gone in blocks that the solve has not seen; below 0 it makes things worse.
        least_share: of the two halves of the log the one in which less is gone.
        rest: (b,) what is left in each block by the solve that has not seen it: RMS over the usual, summed over joints.
    """

    trial: Trial
    value: FloatArray
    half_width: FloatArray
    share: float
    least_share: float
    rest: FloatArray

    def beats(self, other: Solved) -> bool:
        """Whether it clearly leaves less than another cause, over the blocks of time."""
        more = other.rest - self.rest
        return bool(more.mean() > _CLEARLY * more.std() / np.sqrt(more.size))


def solved(table: Excess, trial: Trial, before: FloatArray) -> Solved | None:
    """Try one cause; None where the motion does not hold it.

    Args:
        table: what is left over.
        trial: the cause.
        before: (b, j) excess of each block and joint without it.
    """
    if not trial.columns_nm.any():
        return None
    sums = _Sums.of(table, trial)
    gone, whole, rest = np.zeros(2), np.zeros(2), np.zeros(before.shape[0])
    for half in (0, 1):
        own = table.half == half
        size = sums.explained(table.half != half)[2]
        rest[own] = np.nan_to_num(size).sum(axis=1)[own]
        whole[half], gone[half] = before[own].sum(), (before[own] - table.beyond(size)[own]).sum()
    if not whole.all():
        return None
    every = np.ones(before.shape[0], dtype=np.bool_)
    if trial.kind in _OF_POSES:
        day = _Sums.of(table, trial, whole_day=True)  # of which nothing is held
        value, half_width = day.own(day.solve(every))
    else:
        value, half_width, _ = sums.explained(every)
    half_width = np.hypot(half_width, STANDARD_ERRORS_95 * np.array(trial.fit_sd))
    return Solved(trial, value, half_width, float(gone.sum() / whole.sum()), float((gone / whole).min()), rest)


@dataclass(frozen=True, slots=True, eq=False)
class _Sums:
    """Products of the columns of a cause, of what is followed beside it, and of the torque: over blocks of time.

    Each joint's level of friction and zero of torque are followed within the bounds in which a residual follows them:
    else a load is told too small. A solve of some blocks, and what it leaves in each, need these sums alone.

    What another day and the errors of a fit leave is more: both drift over the log, sliding friction changes beside its
    level, rotors are a tenth too large, and the zero lies as far off as a threshold.

    Attributes:
        products: (b, j, m, m) of the joint's m = k + f + 1 columns, in units of its usual level: k of the cause, f
            followed ones, the torque.
        count: (b, j) samples.
        prior_sd: (k,) of the cause's parameters.
        bound: (f, j) of the followed parameters.
    """

    products: FloatArray
    count: FloatArray
    prior_sd: FloatArray
    bound: FloatArray

    @classmethod
    def of(cls, table: Excess, trial: Trial, whole_day: bool = False) -> _Sums:
        """Of a cause's columns (n, j, k), beside what a residual follows, or all that a day may change."""
        followed, bound = [], []
        level, zero = np.full(len(table.joints), LARGEST), np.maximum(table.zero_bound_nm, 1e-9)
        if trial.kind != "friction":
            followed.append(table.friction_nm)
            bound.append(level)
        if trial.kind != "zero":
            followed.append(table.known.astype(float))
            bound.append(zero)
        if whole_day:
            drift = np.linspace(-1.0, 1.0, table.time_s.size)[:, None]
            spin = np.nan_to_num(table.motion[2][:, table.columns])
            followed += [drift * table.known, drift * table.friction_nm, np.sign(table.friction_nm), spin]
            zero = zero / BOUND_SHARE
            bound = [level, zero, zero, 0.5 * level, zero, zero]
        columns = np.concatenate([trial.columns_nm, np.stack([*followed, table.torque_nm], axis=2)], axis=2)
        columns = columns * (table.known / table.usual_nm)[:, :, None]
        return cls(
            products_of(columns, table.block),
            table.count,
            trial.prior_sd,
            np.array(bound).reshape(-1, len(table.joints)),
        )

    def explained(self, blocks: BoolArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """(k,) parameters of the cause by some of the blocks, half of their intervals, and (b, j) what all blocks keep.

        That is the RMS over the joint's usual level, NaN where too little is known.
        """
        count, found = self.prior_sd.size, self.solve(blocks)
        half_width = self.own(found)[1]
        followed = found.value[count:].reshape(self.bound.shape)
        level = np.clip(followed, -self.bound, self.bound)
        if np.any(level != followed):
            found = self.with_followed(level).solve(blocks)
        own = found.value[:count]
        return own, half_width, self.size(own, level)

    def own(self, found: Estimate) -> tuple[FloatArray, FloatArray]:
        """(k,) of a solution the parameters of the cause, and half of their intervals."""
        count = self.prior_sd.size
        variance = np.maximum(np.diag(found.covariance)[:count], 0.0)
        return found.value[:count], STANDARD_ERRORS_95 * np.sqrt(variance)

    def solve(self, blocks: BoolArray) -> Estimate:
        """Parameters of some blocks: k of the cause, then f of each joint, one followed column after the other."""
        count, (followed, joints) = self.prior_sd.size, self.bound.shape
        own = np.tile(np.arange(count), (joints, 1))
        place = np.hstack([own, count + np.arange(followed * joints).reshape(followed, joints).T])
        prior = np.concatenate([self.prior_sd, self.bound.ravel()]) ** -2.0
        return estimate(self.products[blocks], self.count[blocks], place, prior, usual=1.0)

    def with_followed(self, level: FloatArray) -> _Sums:
        """Without the followed columns, of which (f, j) is taken off the torque."""
        count, (followed, joints) = self.prior_sd.size, level.shape
        kept = np.zeros((joints, count + followed + 1, count + 1))
        kept[:, np.arange(count), np.arange(count)] = 1.0
        kept[:, -1, -1] = 1.0
        kept[:, count:-1, -1] = -level.T
        products = kept.transpose(0, 2, 1) @ self.products @ kept
        return _Sums(products, self.count, self.prior_sd, np.zeros((0, joints)))

    def size(self, own: FloatArray, level: FloatArray) -> FloatArray:
        """(b, j) RMS of what these parameters leave; NaN where too little is known."""
        all_of_joint = np.hstack([np.tile(own, (level.shape[1], 1)), level.T, -np.ones((level.shape[1], 1))])
        return rms(np.sum((self.products @ all_of_joint[:, :, None])[..., 0] * all_of_joint, axis=2), self.count)
