"""Contact that lasts for a good part of a log: a step of one joint's torque over one stretch of time.

A clamp, or somebody who leans on the arm, bends a robust regression when it lasts: what it leaves is neither far off
nor a minority of samples. It is one block of time, though, whereas errors of a model come again with pose and motion.
So the regression is made with one more column, one inside a stretch of time and zero outside, for every stretch at
once.
"""

from __future__ import annotations

import numpy as np

from collaudit.core.dataclass import dataclass
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray
from collaudit.core.numeric.robust_regression import Columns, robust_fit
from collaudit.core.numeric.stats import robust_sd

#: Time is cut into blocks so long at least, and into so many at most: a stretch begins and ends with a block.
_BLOCK_S, _MOST_BLOCKS = 0.5, 160
#: Of fewer blocks nothing is told: a few motions, each made once, leave errors that look like one block of time.
_LEAST_BLOCKS = 40
_MAX_SAMPLES = 6000
#: A stretch lasts so long at least, and for this share of the motion: shorter ones are found sample by sample, and of
#: a longer one nothing tells which side of it is the contact.
_LEAST_S, _SHARES = 1.5, (0.03, 0.55)
#: Of the stretch's own column so much must be left by the other columns: else pose and motion explain it as well.
_OWN = 0.1
#: A step counts from so many robust standard deviations of the blocks' medians, where it explains this share of what
#: the other columns leave. Clean motion of simulated arms reaches 5 and 0.14, that of real ones 8 and 0.52; clamps that
#: raise a threshold to three times itself 16 and 0.69.
_CONTRAST, _EXPLAINED = 10.0, 0.6
_RANK = 1e-6
#: Stretches that one joint is searched for, each in what the others leave; samples that a search needs.
_MOST, _LEAST_SAMPLES = 3, 200


@dataclass(frozen=True, slots=True)
class LastingStep:
    """A stretch of time in which one joint carries a torque of its own.

    Attributes:
        first, last: half-open range of the rows given.
        torque: the step, in the unit of the effort.
        contrast: its size in robust standard deviations of the medians of blocks of time.
    """

    first: int
    last: int
    torque: float
    contrast: float


def lasting_contact(
    rows: IntArray, columns: Columns, effort: FloatArray, time_s: FloatArray, least: float
) -> BoolArray:
    """(m,) samples of a log in stretches that show one joint with a torque of its own.

    Args:
        rows: (n,) samples at which the joint tells something, rising.
        columns, effort, least: as of :func:`lasting_step`.
        time_s: (m,) of all samples.
    """
    out = np.zeros(time_s.size, dtype=bool)
    for _ in range(_MOST):
        kept = np.flatnonzero(~out[rows])
        if kept.size < _LEAST_SAMPLES:
            break
        found = lasting_step(columns.only(kept), effort[kept], time_s[rows[kept]], least)
        if found is None:
            break
        out[rows[kept][found.first] : rows[kept][found.last - 1] + 1] = True
    return out


def lasting_step(columns: Columns, effort: FloatArray, time_s: FloatArray, least: float) -> LastingStep | None:
    """The one stretch of time with a torque of its own; None where none is plain.

    Args:
        columns: (n, c) what explains the effort, in the order of time.
        effort: (n,).
        time_s: (n,) with gaps where the joint tells nothing.
        least: standard deviations of blocks below this, in the unit of the effort, are taken for this.
    """
    use = np.arange(0, effort.size, max(1, effort.size // _MAX_SAMPLES))
    x, y = columns.at(use), effort[use]
    x /= np.maximum(np.sqrt(np.mean(x**2, axis=0)), 1e-12)  # all columns of one size, for the rank
    step_s = max(_BLOCK_S, float(time_s[use[-1]] - time_s[use[0]]) / _MOST_BLOCKS)
    block = np.floor((time_s[use] - time_s[use[0]]) / step_s).astype(np.int64)
    if np.unique(block).size < _LEAST_BLOCKS:
        return None
    found = _best_stretch(x, y, block, step_s)
    if found is None or found[2] < _EXPLAINED:
        return None
    inside = np.asarray((block >= found[0]) & (block < found[1]))
    contrast, torque = _contrast(x, y, block, inside, least)
    if contrast < _CONTRAST:
        return None
    whole = np.floor((time_s - time_s[use[0]]) / step_s)
    first, last = np.searchsorted(whole, found[:2], side="left")
    return LastingStep(int(first), int(last), torque, contrast)


def _best_stretch(x: FloatArray, y: FloatArray, block: IntArray, step_s: float) -> tuple[int, int, float] | None:
    """First and last block (half-open) of the stretch whose column explains most, and the share that it explains.

    The columns are projected out of effort and of every stretch's column; sums over a stretch are differences of
    running sums, so that all stretches are tried at once (Frisch and Waugh, Econometrica 1, 1933).
    """
    left, values, _ = np.linalg.svd(x, full_matrices=False)
    basis = left[:, values > _RANK * values[0]]
    rest = y - basis @ (basis.T @ y)
    edges = np.searchsorted(block, np.arange(int(block[-1]) + 2))
    total = np.concatenate([[0.0], np.cumsum(rest)])[edges]
    shared = np.vstack([np.zeros(basis.shape[1]), np.cumsum(basis, axis=0)])[edges]
    a, b = np.triu_indices(edges.size, 1)
    count = (edges[b] - edges[a]).astype(float)
    share = count / y.size
    tried = (share >= _SHARES[0]) & (share <= _SHARES[1]) & ((b - a) * step_s >= _LEAST_S)
    a, b, count = a[tried], b[tried], count[tried]
    if a.size == 0:
        return None
    own = count - np.sum((shared[b] - shared[a]) ** 2, axis=1)
    explained = np.where(own > _OWN * count, (total[b] - total[a]) ** 2 / np.maximum(own, 1e-9), 0.0)
    best = int(np.argmax(explained))
    return int(a[best]), int(b[best]), float(explained[best] / max(float(rest @ rest), 1e-300))


def _contrast(x: FloatArray, y: FloatArray, block: IntArray, inside: BoolArray, least: float) -> tuple[float, float]:
    """Size of the step against the scatter of the blocks about the robust fit with it, and the step."""
    with_step = np.column_stack([x, inside.astype(float)])
    estimate = robust_fit(with_step, y)
    rest = y - with_step @ estimate
    count = np.bincount(block)
    full = np.flatnonzero(count >= 0.3 * float(np.median(count[count > 0])))
    starts = np.searchsorted(block, full)
    medians = np.array([np.median(rest[i : i + n]) for i, n in zip(starts, count[full], strict=True)])
    torque = float(estimate[-1])
    return abs(torque) / max(robust_sd(medians), least, 1e-12), torque
