"""Regression that nearly half of the rows being wrong does not move, and the spread of what it leaves."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from collaudit.core.numeric.arrays import BoolArray, FloatArray, run_bounds
from collaudit.core.numeric.stats import median_of, quantile_of, robust_sd

#: Bisquare's bound in standard deviations: 95 % of the efficiency of least squares on normal errors.
BISQUARE = 4.685
#: Rows that starts are sought among.
_FEW = 1500
#: Starts on neighbouring rows: this share of all, at so many places.
_WINDOW, _WINDOWS = 0.3, 8
#: Steps of least absolute deviations, of concentration for every start and for the best ones, of bisquare.
_ABSOLUTE, _FIRST, _BEST, _MORE, _LAST = 10, 3, 4, 6, 8
#: Standard deviation of errors by the RMS of their smaller half: 2.6 of normal ones, 1.5 of a ripple's; the stricter.
_HALF = 1.6
#: Each further run of rows off the estimate counts as much as so many rows that count as one.
_RUN = 0.6
_RIDGE, _HELD = 1e-7, 1e4  # least and most that is added to a column's mean square
_CELLS = (0.1, 0.4, 0.7)  # quantiles of a condition between which a spread is its own


@dataclass(frozen=True, slots=True, eq=False)
class RobustFit:
    """An estimate.

    Attributes:
        coefficients: (c,).
        sd: robust standard deviation of the errors of rows that agree with it.
        root: (c, c) whose product with its transpose is the covariance, in units of ``sd``².
    """

    coefficients: FloatArray
    sd: float
    root: FloatArray

    def widening(self, columns: FloatArray) -> FloatArray:
        """(m,) standard deviation of what is left at rows (m, c), in that of their errors: the estimate errs, too."""
        return np.asarray(np.sqrt(1.0 + np.sum((columns @ self.root) ** 2, axis=1)))


def robust_fit(columns: FloatArray, target: FloatArray, prior_sd: FloatArray, alike: float) -> RobustFit:
    """The estimate that most rows agree with, by bisquare weights from several starts (an MM-estimate).

    The starts are least absolute deviations, and least squares on stretches of rows: wrong rows that follow each other
    leave some of them free. Concentration steps bring each to the half of the rows that it fits best (Rousseeuw and
    Van Driessen, Data Min. Knowl. Disc. 12, 2006); at the least spread so found, that one is taken which leaves the
    least loss (Yohai, Ann. Stat. 15, 1987), where wrong rows in many runs count as more than as many in few.

    Args:
        columns: (n, c), of any size, in the order of time; columns that repeat others are no harm.
        target: (n,).
        prior_sd: (c,) of the coefficients about zero; inf for no prior.
        alike: neighbouring rows whose errors are alike, and count as one beside the prior.
    """
    scale = np.maximum(np.sqrt(np.mean(columns**2, axis=0)), 1e-12)
    whole = _Problem(columns / scale, target, (scale * prior_sd) ** -2.0, alike)
    few = whole.thinned(max(1, target.size // _FEW))
    sought = sorted((few.concentrated(start, _FIRST) for start in few.starts()), key=lambda found: found[0])[:_BEST]
    best = [few.concentrated(start, _MORE) for _, start in sought]
    sd = max(_HALF * min(half for half, _ in best) * np.sqrt(1.0 + alike * scale.size / target.size), 1e-12)
    ends = [few.bisquare(start, sd, _LAST) for _, start in best]
    estimate = min(ends, key=lambda end: few.disagreement(end, sd))
    for _ in range(_LAST):
        estimate = whole.bisquare(estimate, sd, 1)
        rest = np.abs(whole.rest(estimate))
        sd = max(robust_sd(rest[rest < BISQUARE * sd]), 1e-12)
    return RobustFit(estimate / scale, sd, whole.root(estimate, sd) / scale[:, None])


@dataclass(frozen=True, slots=True, eq=False)
class _Problem:
    """Rows with columns of one size, and the prior's precision (c,) of each coefficient."""

    columns: FloatArray
    target: FloatArray
    precision: FloatArray
    alike: float

    def thinned(self, step: int) -> _Problem:
        return _Problem(
            np.ascontiguousarray(self.columns[::step]), self.target[::step], self.precision, max(1.0, self.alike / step)
        )

    def rest(self, estimate: FloatArray) -> FloatArray:
        return np.asarray(self.target - self.columns @ estimate)

    def gram(self, weight: FloatArray, sd: float) -> FloatArray:
        out = self.columns.T @ (weight[:, None] * self.columns)
        held = np.minimum(self.precision * sd**2 * self.alike, _HELD * self.target.size)
        out[np.diag_indices_from(out)] += _RIDGE * self.target.size + held
        return np.asarray(out)

    def solve(self, weight: FloatArray, sd: float) -> FloatArray:
        found = np.linalg.solve(self.gram(weight, sd), self.columns.T @ (weight * self.target))
        return np.asarray(found, dtype=np.float64)

    def starts(self) -> Iterator[FloatArray]:
        """Least absolute deviations by reweighting, then least squares on stretches of rows."""
        rest, n = self.target - median_of(self.target), self.target.size
        for _ in range(_ABSOLUTE):
            sd = max(robust_sd(rest), 1e-12)
            estimate = self.solve(sd / np.maximum(np.abs(rest), 0.01 * sd), sd)
            rest = self.rest(estimate)
        yield estimate
        for first in np.linspace(0.0, 1.0 - _WINDOW, _WINDOWS):
            weight = np.zeros(n)
            weight[int(first * n) : int((first + _WINDOW) * n)] = 1.0
            yield self.solve(weight, 0.3 * sd)

    def concentrated(self, estimate: FloatArray, steps: int) -> tuple[float, FloatArray]:
        """The RMS of the smaller half of what is left, and the estimate, after least squares on that half, repeated."""
        for _ in range(steps):
            rest = np.abs(self.rest(estimate))
            half = median_of(rest)
            estimate = self.solve((rest <= half).astype(np.float64), max(half, 1e-12))
        rest = np.abs(self.rest(estimate))
        return float(np.sqrt(np.mean(rest[rest <= median_of(rest)] ** 2))), estimate

    def weight(self, estimate: FloatArray, sd: float) -> FloatArray:
        return np.asarray(np.maximum(1.0 - (self.rest(estimate) / (BISQUARE * sd)) ** 2, 0.0) ** 2)

    def bisquare(self, estimate: FloatArray, sd: float, steps: int) -> FloatArray:
        for _ in range(steps):
            estimate = self.solve(self.weight(estimate, sd), sd)
        return estimate

    def disagreement(self, estimate: FloatArray, sd: float) -> float:
        """Bisquare's loss, in rows, and what is added for runs of rows beyond its bound."""
        size = np.abs(self.rest(estimate)) / (BISQUARE * sd)
        loss = 1.0 - np.maximum(1.0 - size**2, 0.0) ** 3
        return float(loss.sum()) + _RUN * self.alike * run_bounds(size > 1.0)[0].size

    def root(self, estimate: FloatArray, sd: float) -> FloatArray:
        """Of the covariance, by eigenvectors: columns alike leave none of its matrices positive."""
        values, vectors = np.linalg.eigh(self.gram(self.weight(estimate, sd), sd))
        return np.asarray(vectors * np.sqrt(self.alike / np.maximum(values, _RIDGE * self.target.size)))


def local_spread(rest: FloatArray, kept: BoolArray, conditions: Sequence[FloatArray], least: int) -> FloatArray:
    """(n,) robust standard deviation of residuals, larger where motion like it leaves more.

    A model errs more in fast motion and under acceleration; one spread for all would take that for contact.

    Args:
        rest: (n,) residuals.
        kept: (n,) which of them count.
        conditions: sizes (n,) that the spread may depend on.
        least: samples that a cell of conditions needs to have a spread of its own.
    """
    cell = np.zeros(rest.size, dtype=np.uint8)
    for column in conditions:
        counted = column[kept]
        edges = [quantile_of(counted, share) for share in _CELLS]
        cell *= np.uint8(len(_CELLS) + 1)
        for edge in edges:
            cell += ~(column <= edge)  # what is not known lies beyond the last edge
    cell_kept, rest_kept = cell[kept], rest[kept]
    whole = robust_sd(rest_kept)
    spread = np.full((len(_CELLS) + 1) ** len(conditions), whole)
    count = np.bincount(cell_kept, minlength=spread.size)
    by_cell = np.split(rest_kept[np.argsort(cell_kept, kind="stable")], np.cumsum(count)[:-1])
    for number in np.flatnonzero(count >= max(1, least)):
        spread[number] = max(whole, robust_sd(by_cell[number]))
    return np.asarray(spread[cell])
