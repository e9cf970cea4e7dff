"""The solve of one cause: robust least squares, and what it takes away of blocks of time that it has not seen."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from collaudit.core.causes.excess import Excess, rms
from collaudit.core.causes.trials import Trial
from collaudit.core.numeric.arrays import BoolArray, FloatArray
from collaudit.core.numeric.stats import STANDARD_ERRORS_95
from collaudit.core.residual.friction_level import LARGEST

_ROUNDS = 6
#: Standard errors by which one cause must leave less than another to be told from it.
_CLEARLY = 3.0


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
    value, half_width, _ = sums.explained(np.ones(before.shape[0], dtype=np.bool_))
    return Solved(trial, value, half_width, float(gone.sum() / whole.sum()), float((gone / whole).min()), rest)


@dataclass(frozen=True, slots=True, eq=False)
class _Sums:
    """Products of the columns of a cause, of what is followed beside it, and of the torque: over blocks of time.

    Each joint's level of friction and zero of torque are followed within the bounds in which a residual follows them:
    else a load is told too small. A solve of some blocks, and what it leaves in each, need these sums alone.

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
    def of(cls, table: Excess, trial: Trial) -> _Sums:
        """Of a cause's columns (n, j, k)."""
        followed, bound = [], []
        if trial.kind != "friction":
            followed.append(table.friction_nm)
            bound.append(np.full(len(table.joints), LARGEST))
        if trial.kind != "zero":
            followed.append(table.known.astype(float))
            bound.append(np.maximum(table.zero_bound_nm, 1e-9))
        columns = np.concatenate([trial.columns_nm, np.stack([*followed, table.torque_nm], axis=2)], axis=2)
        columns = columns * (table.known / table.usual_nm)[:, :, None]
        of_block = table.rows_of_blocks(columns)
        products = of_block.transpose(0, 2, 3, 1) @ of_block.transpose(0, 2, 1, 3)
        return cls(products, table.count, trial.prior_sd, np.array(bound).reshape(-1, len(table.joints)))

    def explained(self, blocks: BoolArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """(k,) parameters of the cause by some of the blocks, half of their intervals, and (b, j) what all blocks keep.

        That is the RMS over the joint's usual level, NaN where too little is known.
        """
        count = self.prior_sd.size
        value, half_width = _solve(self, blocks)
        followed = value[count:].reshape(self.bound.shape)
        level = np.clip(followed, -self.bound, self.bound)
        own = value[:count]
        if np.any(level != followed):
            own, _ = _solve(self.with_followed(level), blocks)
        return own, half_width[:count], self.size(own, level)

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


def _solve(sums: _Sums, blocks: BoolArray) -> tuple[FloatArray, FloatArray]:
    """Parameters, k of the cause and f of each joint, of some blocks, and half of their intervals.

    Minimises the sum of each block's RMS, by reweighted least squares: a contact is large in few blocks.
    """
    count, (followed, joints) = sums.prior_sd.size, sums.bound.shape
    own = np.tile(np.arange(count), (joints, 1))
    place = np.hstack([own, count + np.arange(followed * joints).reshape(followed, joints).T])  # (j, k + f)
    prior = np.diag(1.0 / np.concatenate([sums.prior_sd, sums.bound.ravel()]) ** 2)
    used = blocks[:, None] * np.ones(joints)
    weight, value, precision = used, np.zeros(len(prior)), prior
    slope = np.zeros(sums.products.shape[:-1])
    for _ in range(_ROUNDS):
        weighted = np.einsum("bj,bjmn->jmn", weight, sums.products)
        precision, target = prior.copy(), np.zeros(len(prior))
        for at, product in zip(place, weighted, strict=True):
            precision[np.ix_(at, at)] += product[:-1, :-1]
            target[at] += product[:-1, -1]
        value = np.asarray(np.linalg.solve(precision, target), dtype=np.float64)
        all_of_joint = np.hstack([value[place], -np.ones((joints, 1))])
        slope = (sums.products @ all_of_joint[:, :, None])[..., 0]
        square = np.maximum(np.sum(slope * all_of_joint, axis=2), 0.0)
        weight = used / np.maximum(np.sqrt(square / np.maximum(sums.count, 1.0)), 1.0)
    score = np.zeros((len(blocks), value.size))
    for j, at in enumerate(place):
        score[:, at] += weight[:, j, None] * slope[:, j, :-1]
    told = np.count_nonzero(sums.count[blocks].any(axis=1))
    inverse = np.linalg.inv(precision)
    spread = inverse @ (score.T @ score) @ inverse * float(told) / max(int(told) - value.size, 1)
    return value, STANDARD_ERRORS_95 * np.sqrt(np.maximum(np.diag(spread), 0.0))
