"""Least squares on sums of products over blocks of time, with a weight for each block: contact is what the rest leaves.

Neighbouring samples share their errors, so a block counts as one: its weight falls where it is far off, and intervals
are those of the blocks' scores (Liang and Zeger, Biometrika 73, 1986). A part of a log is its sums less some blocks.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import stdtrit as student_quantile

from collaudit.core.errors import NotJudgedError
from collaudit.core.numeric.arrays import FloatArray, IntArray
from collaudit.core.numeric.stats import NORMAL_QUANTILE_975, STANDARD_ERRORS_95, median_of

#: Blocks that tell a coefficient, at least.
_FEWEST = 8
#: A block that is off by more than so many times the median of all counts less; few do in the first rounds, which seek
#: what most blocks agree with.
_FAR = (1.0,) * 6 + (3.0,) * 4
_ROUNDING = 1e-6
#: Share of the largest singular value below which combinations of coefficients are not told.
_RANK = 1e-12
#: The same of columns themselves.
_ALIKE = 1e-5
#: Share of what is known of a coefficient that one block has at most.
_MOST = 0.9
#: Share of its standard deviation that a column must have of its own, beside the others. Torque by a description is
#: good to about a fifth (masses, centres of mass): what others leave of it is that error, where they leave no more.
LEAST_OWN = 0.2
#: Share of a channel's variance, after the other columns, that a column must explain for its sign to be clear.
MIN_EXPLAINED = 0.2


@dataclass(frozen=True, slots=True)
class Slope:
    """How a channel goes with one column, others beside it.

    Attributes:
        value: coefficient of the column.
        half: half width of its interval, from the scatter between blocks of time.
        explained: share of the channel's variance, after the others, that the column explains.
    """

    value: float
    half: float
    explained: float

    @property
    def negative(self) -> bool:
        """Whether the channel clearly runs against the column."""
        return self.value + self.half < 0 and self.explained >= MIN_EXPLAINED

    @property
    def positive(self) -> bool:
        """Whether the channel clearly goes with the column."""
        return self.value - self.half > 0 and self.explained >= MIN_EXPLAINED


@dataclass(frozen=True, slots=True, eq=False)
class Estimate:
    """Coefficients (p,) with their covariance (p, p), and the products (p, p) of the weighted columns, prior included.

    ``influence`` (b, p) is by how much each block moves them. ``left`` is the weighted sum of squares that they leave,
    ``count`` that of samples.
    """

    value: FloatArray
    covariance: FloatArray
    influence: FloatArray
    products: FloatArray
    left: float
    count: float


def estimate(
    products: FloatArray, count: FloatArray, place: IntArray, prior: FloatArray, usual: float | None = None
) -> Estimate:
    """Coefficients by least squares with a weight for each block of each joint: 1 up to the usual RMS, less beyond.

    With S the RMS of a block in units of the usual one, the sum over blocks of S² is minimised where S < 1, and of
    1 + log S² beyond, by reweighting. The intervals are those of that sum: second derivative, and scores.

    Args:
        products: (b, j, c + 1, c + 1) of each joint's columns and, last, of its torque.
        count: (b, j) samples.
        place: (j, c) number of the coefficient of each column.
        prior: (p,) precision of the coefficients about zero.
        usual: RMS up to which a block counts whole; None for three times the median of all.
    """
    weight, slope, square, value, gram, *sums = _majority(products, count, place, prior, usual)
    bread, score = gram.copy(), np.zeros((len(count), value.size))
    for j, at in enumerate(place):
        own = weight[:, j, None] * slope[:, j, :-1]
        score[:, at] += own
        off = weight[:, j] < 1.0
        bread[np.ix_(at, at)] -= own[off].T @ (own[off] / (weight * square)[off, j, None])
    inverse, share = generalised_inverse(bread, _RANK), np.zeros_like(score)
    for at, product in zip(place, np.moveaxis(weight[:, :, None, None] * products, 1, 0), strict=True):
        share += _told(product[:, :-1, :-1], inverse[at])
    influence = score @ inverse
    return Estimate(value, clustered_covariance(influence, share), influence, gram, *sums)


def block_weights(products: FloatArray, count: FloatArray) -> FloatArray:
    """(b,) of the blocks of one joint, where all of its columns (b, c + 1, c + 1) may explain the last one.

    No majority is sought: so many columns would explain any half of a short log.
    """
    place = np.arange(products.shape[-1] - 1)[None]
    return _majority(products[:, None], count[:, None], place, np.zeros(place.size), None, _FAR[-4:])[0][:, 0]


def _majority(
    products: FloatArray,
    count: FloatArray,
    place: IntArray,
    prior: FloatArray,
    usual: float | None,
    rounds: Sequence[float] = _FAR,
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray, float, float]:
    """Of :func:`estimate`: weights (b, j), slopes (b, j, c + 1), squares (b, j), value, products, left and count."""
    size, joints, width = prior.size, len(place), place.shape[1] + 1
    by_joint, counted = np.ascontiguousarray(np.swapaxes(products, 0, 1)), np.ascontiguousarray(count.T)
    flat, rows = by_joint.reshape(*counted.shape, width**2), by_joint.reshape(joints, len(count) * width, width)
    pairs = (place[:, :, None] * size + place[:, None, :]).ravel()
    weight, every = np.ones(counted.shape), np.full((joints, width, 1), -1.0)
    settled, before = False, 0.0
    for far in rounds:
        if settled and (usual is not None or far == before):
            continue  # the same weights again
        total = (weight[:, None] @ flat).reshape(joints, width, width)
        both: FloatArray = np.bincount(pairs, total[:, :-1, :-1].ravel(), size**2).astype(np.float64)
        told: FloatArray = np.bincount(place.ravel(), total[:, :-1, -1].ravel(), size).astype(np.float64)
        gram = both.reshape(size, size) + np.diag(prior)
        value = generalised_inverse(gram, _RANK) @ told
        every[:, :-1, 0] = value[place]
        slope = (rows @ every).reshape(*counted.shape, width)
        square = np.maximum((slope @ every)[..., 0], 0.0)
        left, known = float(np.sum(weight * square)), float(np.sum(weight * counted))
        rms = np.sqrt(square / np.maximum(counted, 1.0))
        bound = usual or max(far * median_of(rms[counted > 0]), _ROUNDING * rms.max(), 1e-300)
        used, weight = weight, 1.0 / np.maximum(rms / bound, 1.0) ** 2
        settled, before = np.array_equal(used, weight), far
    return np.asarray(weight.T), np.swapaxes(slope, 0, 1), square.T, value, gram, left, known


def scatter(
    products: FloatArray,
    rest: FloatArray,
    columns: FloatArray,
    place: IntArray,
    gram: FloatArray,
    prior: FloatArray,
    asked: FloatArray,
) -> FloatArray:
    """(k, k) covariance of sums of coefficients, from the scatter of their scores between blocks, the prior included.

    Args:
        products: (b, j, c, c) of each joint's columns, weighted.
        rest: (j, c) what these are multiplied by to give what is left, in units of its noise.
        columns: (j, c, m) the same of the columns of the coefficients; place: (j, m) numbers of these.
        gram: (p, p) products of all; prior: (p,) precision that comes to it.
        asked: (p, k) weights of the coefficients in what is asked.
    """
    inverse = generalised_inverse(gram + np.diag(prior), _RANK) @ asked
    influence, share = np.zeros((len(products), asked.shape[1])), np.zeros((len(products), asked.shape[1]))
    for j, power in enumerate(np.einsum("bjcc->jc", products)):
        own = np.flatnonzero(power)
        if own.size:
            block, moved = products[:, j, own][..., own], columns[j, own] @ inverse[place[j]]
            influence += block @ rest[j, own] @ moved
            share += _told(block, moved)
    return clustered_covariance(influence, share) + (inverse.T * prior) @ inverse


def _told(products: FloatArray, inverse: FloatArray) -> FloatArray:
    """(b, k) share that each block's products (b, c, c) have of what is known of k coefficients.

    Args:
        inverse: (c, k) of the inverse of all products: rows of the columns, columns of the coefficients.
    """
    return np.asarray(np.maximum(np.sum((products @ inverse) * inverse, axis=1), 0.0))


def clustered_covariance(influence: FloatArray, share: FloatArray) -> FloatArray:
    """(p, p) such that 1.96 standard errors span 95 %, from what each block moves (b, p) and tells (b, p).

    A block with a share h of what is known of a coefficient has its influence raised by 1/(1 - h), as leaving it out
    would show (jackknife), and 1/sum(h²) takes the place of the number of blocks in Student's t: a few fast moves may
    carry all that a log says.
    """
    part = share / np.maximum(share.sum(axis=0), 1e-300)
    blocks = 1.0 / np.maximum(np.sum(part**2, axis=0), 1e-12)
    reach = student_quantile(np.clip(blocks - 1.0, 1.0, 1e6), 0.975) / NORMAL_QUANTILE_975
    raised = influence / (1.0 - np.minimum(part, _MOST)) * reach
    return np.asarray(raised.T @ raised)


@dataclass(frozen=True, slots=True, eq=False)
class BlockSums:
    """Products of one joint's named columns (b, c, c) over blocks of time, and (b,) of how many samples.

    The first column is ``one``.
    """

    names: tuple[str, ...]
    products: FloatArray
    count: FloatArray

    @classmethod
    def of(cls, time: FloatArray | IntArray, names: tuple[str, ...], columns: FloatArray) -> BlockSums:
        """Of (n, c) columns by the block (n,) of each sample, rising."""
        _, block = np.unique(time, return_inverse=True)
        products = products_of(np.column_stack([np.ones(len(columns)), columns])[:, None], block)[:, 0]
        return cls(("one", *names), products, np.bincount(block).astype(np.float64))

    def mean(self, name: str) -> float:
        """Of a column."""
        return float(self.products[:, 0, self.names.index(name)].sum() / self.count.sum())

    def sd(self, name: str) -> float:
        """Standard deviation of a column."""
        k = self.names.index(name)
        square = float(self.products[:, k, k].sum() / self.count.sum())
        return float(np.sqrt(max(square - self.mean(name) ** 2, 0.0)))

    def slope(
        self,
        channel: str,
        on: str,
        *beside: str,
        sigmas: float = STANDARD_ERRORS_95,
        least_own: float = LEAST_OWN,
    ) -> Slope | None:
        """A channel on one column beside others; None where too little tells it, or too little of it is its own.

        Args:
            channel, on, beside: names of columns; those alike count once.
            sigmas: half width of the interval in standard errors.
            least_own: share of its standard deviation that the others must leave of the column.
        """
        if np.count_nonzero(self.count) < _FEWEST:
            return None
        pick = [self.names.index(name) for name in (on, *beside, channel)]
        products, place = self.products[:, None, pick][..., pick], np.arange(len(pick) - 1)[None]
        found = estimate(products, self.count[:, None], place, np.zeros(place.size))
        across = found.products[0, 1:]
        power = float(found.products[0, 0] - across @ generalised_inverse(found.products[1:, 1:]) @ across)
        if power <= max(1e-9, (least_own * self.sd(on)) ** 2) * found.count:
            return None
        value = float(found.value[0])
        explained = value**2 * power / max(value**2 * power + found.left, 1e-300)
        return Slope(value, sigmas * float(np.sqrt(found.covariance[0, 0])), explained)


def solutions(sums: FloatArray, columns: tuple[int, ...]) -> tuple[FloatArray, FloatArray]:
    """(k, p) coefficients of the last column in these, of each of (k, c, c) sums, and (k,) squares that are left."""
    pick = list(columns)
    size = np.sqrt(np.maximum(np.einsum("kii->ki", sums)[:, pick], 1e-30))
    gram = sums[:, pick][:, :, pick] / (size[:, :, None] * size[:, None, :]) + 1e-9 * np.eye(len(pick))
    right = sums[:, pick, -1] / size
    found = np.linalg.solve(gram, right[:, :, None])[:, :, 0]
    whole = np.maximum(sums[:, -1, -1], 0.0)
    return found / size, np.clip(whole - np.sum(found * right, axis=1), 0.0, whole)


def explained(products: FloatArray, across: FloatArray, squares: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(c, t) coefficients of columns for targets, and (t,) sums of squares that they leave.

    Args:
        products: (c, c) sums of products of the columns; across: (c, t) with the targets; squares: (t,) of these.
    """
    found = generalised_inverse(products) @ across
    return found, np.clip(squares - np.sum(found * across, axis=0), 0.0, squares)


def squares_left(columns: FloatArray, targets: FloatArray) -> FloatArray:
    """(t,) sums of squares of targets (n, t) that columns (n, c) leave; next to none of too few samples.

    By the columns themselves: products of columns that are nearly alike would leave rounding errors as large as noise.
    """
    _refuse_unless_finite(columns)
    size = np.linalg.norm(columns, axis=0)
    basis, values, _ = np.linalg.svd(columns / np.where(size > 0, size, 1.0), full_matrices=False)
    along = basis[:, values > _ALIKE * values.max(initial=0.0)].T @ targets
    return np.asarray(np.maximum(np.sum(targets**2, axis=0) - np.sum(along**2, axis=0), 0.0))


def products_of(columns: FloatArray, block: IntArray, blocks: int = 0) -> FloatArray:
    """(b, j, c, c) sums over blocks, numbered (n,) from 0, of products of columns (n, j, c); of so many at least."""
    rows = rows_of_blocks(columns, block, blocks)
    return np.asarray(rows.transpose(0, 2, 3, 1) @ rows.transpose(0, 2, 1, 3))


def rows_of_blocks(rows: FloatArray, block: IntArray, blocks: int = 0) -> FloatArray:
    """(n, ...) as (b, r, ...): the rows of each block, and zeros behind them.

    Args:
        rows: in the order of time.
        block: (n,) number of the block of each, from 0, rising.
        blocks: of so many at least.
    """
    edges = np.searchsorted(block, np.arange(max(blocks, int(block[-1]) + 1 if block.size else 0) + 1))
    taken = edges[:-1, None] + np.arange(np.diff(edges).max(initial=0))
    there = taken < edges[1:, None]
    out = rows[np.minimum(taken, len(rows) - 1)]
    out[~there] = 0.0
    return out


def generalised_inverse(gram: FloatArray, rank: float = 1e-10) -> FloatArray:
    """(k, k) generalised inverse of weighted products (k, k) of columns: those alike or zero share or have no part.

    Args:
        gram: rows and columns are scaled to a diagonal of one.
        rank: share of the largest singular value below which one is none.

    Raises:
        NotJudgedError: products are no numbers: speeds or accelerations are beyond all arms.
    """
    _refuse_unless_finite(gram)
    diagonal = np.diag(gram)
    size = np.sqrt(np.where(diagonal > 0, np.maximum(diagonal, 1e-300), 1.0))
    scale = np.outer(size, size)
    values, vectors = np.linalg.eigh(gram / scale)  # as np.linalg.pinv(hermitian=True), in a third of its time
    kept = np.abs(values) > rank * np.abs(values).max(initial=0.0)
    return np.asarray((vectors[:, kept] / values[kept]) @ vectors[:, kept].T / scale)


def _refuse_unless_finite(values: FloatArray) -> None:
    if not np.isfinite(values).all():
        raise NotJudgedError(
            "the motion cannot be identified: its speeds and accelerations are beyond any arm's",
            hint="look at the time of the log and its unit: [log.units] time, [log.csv] rate_hz, [log] time",
        )
