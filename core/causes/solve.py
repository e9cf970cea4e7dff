"""The solve of one cause: robust least squares, and what it takes away of blocks of time that it has not seen."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from collaudit.core.causes.excess import Excess
from collaudit.core.causes.trials import Trial, only
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
    block_half = np.zeros(before.shape[0], dtype=np.int64)
    block_half[table.block] = table.half
    gone, whole, rest = np.zeros(2), np.zeros(2), np.zeros(before.shape[0])
    for half in (0, 1):
        left, _, _ = _explained(table, trial, table.half != half)
        own = block_half == half
        rest[own] = np.nan_to_num(table.size(left)).sum(axis=1)[own]
        whole[half], gone[half] = before[own].sum(), (before[own] - table.beyond(left)[own]).sum()
    if not whole.all():
        return None
    _, value, half_width = _explained(table, trial, np.ones(table.block.size, dtype=np.bool_))
    return Solved(trial, value, half_width, float(gone.sum() / whole.sum()), float((gone / whole).min()), rest)


def _explained(table: Excess, trial: Trial, rows: BoolArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """(n, j) what a cause leaves by what some rows tell of it, its parameters, and half of their intervals.

    Beside it stand each joint's level of friction and zero of torque, within the bounds in which a residual follows
    them: else a load is told too small.
    """
    count, joints = trial.prior_sd.size, range(len(table.joints))
    beside = [] if trial.kind == "friction" else [only(table.friction_nm, j) for j in joints]
    bounds = [LARGEST] * len(beside)
    if trial.kind != "zero":
        beside += [only(table.known.astype(float), j) for j in joints]
        bounds += table.zero_bound_nm.tolist()
    followed, most = np.concatenate(beside, axis=2), np.array(bounds)
    both = np.concatenate([trial.columns_nm, followed], axis=2)
    value, half_width = _solve(
        table, both, np.concatenate([trial.prior_sd, np.maximum(most, 1e-9)]), table.torque_nm, rows
    )
    level = np.clip(value[count:], -most, most)
    rest = table.torque_nm - followed @ level
    if np.any(level != value[count:]):
        own, _ = _solve(table, trial.columns_nm, trial.prior_sd, rest, rows)
        value = np.concatenate([own, level])
    return rest - trial.columns_nm @ value[:count], value[:count], half_width[:count]


def _solve(
    table: Excess, columns_nm: FloatArray, prior_sd: FloatArray, torque_nm: FloatArray, rows: BoolArray
) -> tuple[FloatArray, FloatArray]:
    """Parameters of (n, j, k) columns, and half of their intervals, of some rows of a torque (n, j).

    Minimises the sum of each block's RMS, by reweighted least squares: a contact is large in few blocks.
    """
    x = (columns_nm / table.usual_nm[:, None])[rows]
    y = (torque_nm / table.usual_nm)[rows]
    known, block = table.known[rows], table.block[rows]
    prior, blocks = np.diag(1.0 / prior_sd**2), int(table.block[-1]) + 1
    weight, left = np.ones(y.shape), y
    value, precision = np.zeros(prior_sd.size), prior
    for _ in range(_ROUNDS):
        weighted = x * (weight * known)[:, :, None]
        precision = np.einsum("njk,njl->kl", weighted, x) + prior
        value = np.linalg.solve(precision, np.einsum("njk,nj->k", weighted, y))
        left = np.where(known, y - x @ value, 0.0)
        count = np.stack([np.bincount(block, its, blocks) for its in known.T.astype(float)], axis=1)
        square = np.stack([np.bincount(block, its, blocks) for its in left.T**2], axis=1)
        weight = 1.0 / np.maximum(np.sqrt(square / np.maximum(count, 1.0)), 1.0)[block]
    score = np.zeros((blocks, value.size))
    np.add.at(score, block, np.einsum("njk,nj->nk", x * (weight * known)[:, :, None], left))
    told = np.count_nonzero(np.bincount(block, minlength=blocks))
    inverse = np.linalg.inv(precision)
    spread = inverse @ (score.T @ score) @ inverse * float(told) / max(int(told) - value.size, 1)
    return value, STANDARD_ERRORS_95 * np.sqrt(np.maximum(np.diag(spread), 0.0))
