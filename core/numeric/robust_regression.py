"""Regression that a minority of wrong samples does not move, and the spread of what it leaves."""

from __future__ import annotations

import numpy as np

from collaudit.core.numeric.arrays import BoolArray, FloatArray
from collaudit.core.numeric.stats import HUBER_BOUND, robust_sd

_ROUNDS = 25
_CHANGE = 1e-3
#: Bisquare's bound in standard deviations: 95 % of the efficiency of least squares on normal errors.
_BISQUARE = 4.685
_RIDGE = 1e-9
#: Most samples are this share of them; a fit that leaves less than this share of another's residual for most is better.
_MAJORITY, _FAR_LESS = 0.58, 0.5
_STARTS, _CONCENTRATIONS, _TRIMMED_SAMPLES = 8, 12, 4000
#: A cell whose spread is more than so many times that of all holds what is no spread: most of it is disturbed.
_WIDEST = 4.0
_CELLS = (0.1, 0.4, 0.7)  # quantiles of a condition between which a spread is its own


def robust_fit(
    columns: FloatArray, target: FloatArray, share: FloatArray | None = None, fine: float = 0.0
) -> FloatArray:
    """Coefficients (k,) by iterated reweighting: Huber's weights to come near, then bisquare to forget outliers.

    Holland and Welsch, Commun. Stat. A 6, 1977; the scale is the median absolute residual. Outliers that last, all of
    one sign, bend Huber's fit so far that bisquare no longer tells them: where a fit that starts from a part of the
    samples leaves far less of most of them, bisquare starts from that one.

    Args:
        columns: (n, k) in the order of time, of any size; columns that repeat others are no harm.
        target: (n,).
        share: (n,) what each row counts whatever its residual; None for all alike.
        fine: residuals of this size are none: what leaves no more for most samples needs no other start.
    """
    scale = np.maximum(np.sqrt(np.mean(columns**2, axis=0)), 1e-12)
    scaled = columns / scale
    counts = np.ones(target.size) if share is None else share
    start = _reweighted(scaled, target, counts, np.zeros(columns.shape[1]), np.ones(target.size), bisquare=False)
    left = _most(np.abs(target - scaled @ start), counts)
    if left > fine:
        trimmed = _trimmed_fit(scaled, target, counts)
        if max(fine, _most(np.abs(target - scaled @ trimmed), counts)) < _FAR_LESS * left:
            start = trimmed
    weight = _bisquare(target - scaled @ start)
    return np.asarray(_reweighted(scaled, target, counts, start, weight, bisquare=True) / scale)


def _reweighted(
    scaled: FloatArray, target: FloatArray, share: FloatArray, estimate: FloatArray, weight: FloatArray, bisquare: bool
) -> FloatArray:
    """Coefficients (k,) after the rounds of one kind of weights, the first with the weights given."""
    for _ in range(_ROUNDS):
        fresh = _least_squares(scaled, target, weight * share)
        rest = target - scaled @ fresh
        sd = max(robust_sd(rest), 1e-12)
        done = float(np.max(np.abs(scaled @ (fresh - estimate)))) < _CHANGE * sd
        estimate = fresh
        weight = _bisquare(rest) if bisquare else np.minimum(1.0, HUBER_BOUND / np.maximum(np.abs(rest) / sd, 1e-12))
        if done:
            break
    return estimate


def _bisquare(rest: FloatArray) -> FloatArray:
    ratio = np.abs(rest) / max(robust_sd(rest), 1e-12)
    return np.asarray(np.where(ratio < _BISQUARE, (1.0 - (ratio / _BISQUARE) ** 2) ** 2, 0.0))


def _least_squares(scaled: FloatArray, target: FloatArray, weight: FloatArray) -> FloatArray:
    gram = scaled.T @ (weight[:, None] * scaled)
    gram += _RIDGE * np.trace(gram) * np.eye(gram.shape[0])
    return np.asarray(np.linalg.solve(gram, scaled.T @ (weight * target)))


def _most(size: FloatArray, share: FloatArray) -> float:
    """What most of the residuals stay below, each counted by its share."""
    order = np.argsort(size)
    counted = np.cumsum(share[order])
    return float(size[order[np.searchsorted(counted, _MAJORITY * counted[-1])]])


def _trimmed_fit(scaled: FloatArray, target: FloatArray, share: FloatArray) -> FloatArray:
    """Coefficients (k,) that explain most samples best: least trimmed squares by concentration.

    Rousseeuw and Van Driessen, Data Min. Knowl. Discov. 12, 2006. What disturbs a log lasts, so the starts are halves
    of the time, at every eighth of it.
    """
    every = max(1, target.size // _TRIMMED_SAMPLES)
    x, y, counts = scaled[::every], target[::every], share[::every]
    part = np.arange(y.size) * _STARTS // y.size
    best, least = np.zeros(x.shape[1]), np.inf
    for first in range(_STARTS):
        estimate = _least_squares(x, y, counts * ((part - first) % _STARTS < _STARTS // 2))
        for _ in range(_CONCENTRATIONS):
            size = np.abs(y - x @ estimate)
            estimate = _least_squares(x, y, counts * (size <= _most(size, counts)))
        left = _most(np.abs(y - x @ estimate), counts)
        if left < least:
            best, least = estimate, left
    return best


def local_spread(rest: FloatArray, kept: BoolArray, conditions: FloatArray, least: int) -> FloatArray:
    """(n,) robust standard deviation of residuals, larger where motion like it leaves more.

    A model errs more in fast motion and under acceleration; one spread for all would take that for contact.

    Args:
        rest: (n,) residuals.
        kept: (n,) which of them count.
        conditions: (n, c) sizes that the spread may depend on.
        least: samples that a cell of conditions needs to have a spread of its own.
    """
    whole = robust_sd(rest[kept])
    cell = np.zeros(rest.size, dtype=np.int64)
    for column in conditions.T:
        edges = np.quantile(column[kept], _CELLS)
        cell = (len(_CELLS) + 1) * cell + np.searchsorted(edges, column)
    out = np.full(rest.size, whole)
    for number in np.unique(cell):
        inside = cell == number
        use = inside & kept
        if np.count_nonzero(use) >= least:
            out[inside] = np.clip(robust_sd(rest[use]), whole, _WIDEST * whole)
    return out
