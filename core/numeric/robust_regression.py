"""Regression that a minority of wrong samples does not move, and the spread of what it leaves."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray
from collaudit.core.numeric.blocks import blocks
from collaudit.core.numeric.parallel import ordered_map
from collaudit.core.numeric.stats import HUBER_BOUND, quantile_of, robust_sd

_ROUNDS = 25
_CHANGE = 1e-3
#: Bisquare's bound in standard deviations: 95 % of the efficiency of least squares on normal errors.
_BISQUARE = 4.685
_RIDGE = 1e-9
_CELLS = (0.1, 0.4, 0.7)  # quantiles of a condition between which a spread is its own


class Columns:
    """Columns (n, c) of a regression that are made where they are asked for: those of a long log take gigabytes."""

    def __init__(self, count: int, make: Callable[[slice | IntArray], FloatArray]) -> None:
        """Of so many rows; ``make`` gives (m, c) at some of them."""
        self.count, self._make = count, make

    @classmethod
    def of(cls, columns: FloatArray) -> Columns:
        """Columns that are at hand."""
        return cls(columns.shape[0], lambda rows: columns[rows])

    def at(self, rows: slice | IntArray) -> FloatArray:
        """(m, c) at rows."""
        return np.ascontiguousarray(self._make(rows))

    def only(self, rows: IntArray) -> Columns:
        """The columns of these rows; themselves where that are all."""
        return self if rows.size == self.count else Columns(rows.size, lambda picked: self._make(rows[picked]))

    def times(self, coefficients: FloatArray) -> FloatArray:
        """(n,) what coefficients (c,) make of them."""
        out = np.empty(self.count)

        def fill(block: slice) -> None:
            out[block] = self.at(block) @ coefficients

        for _ in ordered_map(fill, list(blocks(self.count))):
            pass
        return out


def robust_fit(columns: FloatArray, target: FloatArray, share: FloatArray | None = None) -> FloatArray:
    """Coefficients (k,) by iterated reweighting: Huber's weights to come near, then bisquare to forget outliers.

    Holland and Welsch, Commun. Stat. A 6, 1977; the scale is the median absolute residual.

    Args:
        columns: (n, k), of any size; columns that repeat others are no harm.
        target: (n,).
        share: (n,) what each row counts whatever its residual; None for all alike.
    """
    scale = np.maximum(np.sqrt(np.mean(columns**2, axis=0)), 1e-12)
    scaled = columns / scale
    estimate = np.zeros(columns.shape[1])
    weight = np.ones(target.size)
    for bisquare in (False, True):
        for _ in range(_ROUNDS):
            total = weight if share is None else weight * share
            gram = scaled.T @ (total[:, None] * scaled)
            gram += _RIDGE * np.trace(gram) * np.eye(gram.shape[0])
            fresh = np.linalg.solve(gram, scaled.T @ (total * target))
            rest = target - scaled @ fresh
            sd = max(robust_sd(rest), 1e-12)
            done = float(np.max(np.abs(scaled @ (fresh - estimate)))) < _CHANGE * sd
            estimate = fresh
            ratio = np.abs(rest) / sd
            if bisquare:
                weight = np.where(ratio < _BISQUARE, (1.0 - (ratio / _BISQUARE) ** 2) ** 2, 0.0)
            else:
                weight = np.minimum(1.0, HUBER_BOUND / np.maximum(ratio, 1e-12))
            if done:
                break
    return np.asarray(estimate / scale)


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
        for block in blocks(cell.size):
            cell[block] *= np.uint8(len(_CELLS) + 1)
            for edge in edges:
                cell[block] += ~(column[block] <= edge)  # what is not known lies beyond the last edge
    cell_kept, rest_kept = cell[kept], rest[kept]
    whole = robust_sd(rest_kept)
    spread = np.full((len(_CELLS) + 1) ** len(conditions), whole)
    count = np.bincount(cell_kept, minlength=spread.size)
    by_cell = np.split(rest_kept[np.argsort(cell_kept, kind="stable")], np.cumsum(count)[:-1])
    for number in np.flatnonzero(count >= max(1, least)):
        spread[number] = max(whole, robust_sd(by_cell[number]))
    return np.asarray(spread[cell])
