"""Whether a series changed, and since when: a step or a drift that begins at some point, against a constant.

y = a + b·h(t - t_k) + error, with h a step (0 before t_k, 1 from it on) or a ramp (max(0, t - t_k)), by weighted least
squares for every k. The best is tested by its F statistic times the number of k and shapes tried (Bonferroni), so that
the chance of a change where there is none is at most p, for independent normal errors of any common size. The points
that begin a change nearly as well make its interval (Seber and Lee, Linear Regression Analysis, 2003, sec. 5.4).
Errors that carry over from one value to the next widen everything by (1 + r) / (1 - r), r their correlation.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.linalg import orth
from scipy.special import fdtrc as fisher_tail
from scipy.special import fdtri as fisher_quantile
from scipy.special import stdtrit as student_quantile

from collaudit.core.numeric.arrays import BoolArray, FloatArray

Shape = Literal["step", "drift"]
#: Fewer values than this show no change that could be told from chance.
FEWEST = 8
#: Values before and after a change, at least.
_SIDE = 3
_LEVEL = 0.95


@dataclass(frozen=True, slots=True, eq=False)
class SeriesChange:
    """A change.

    Attributes:
        shape: step, or drift that goes on to the last value.
        index, first, last: of the value that it begins at, and the interval (95 %) of that.
        size, size_ci95: of a step; of a drift for every unit of t. The interval holds for all beginnings in theirs.
        grown, grown_ci95: from before the change to the last value.
        p: chance of as clear a change anywhere in a series that has none.
    """

    shape: Shape
    index: int
    first: int
    last: int
    size: float
    size_ci95: tuple[float, float]
    grown: float
    grown_ci95: tuple[float, float]
    p: float


def find_change(
    t: FloatArray, y: FloatArray, se: FloatArray, covariate: FloatArray | None = None
) -> SeriesChange | None:
    """The clearest change of a series, however unclear; None where there are too few values.

    Args:
        t: (n,) rising.
        y: (n,) values.
        se: (n,) their standard errors; values scatter by them and by something more, which is estimated.
        covariate: (n,) of something that y may follow, such as temperature: taken out of both y and change.
    """
    n, taken = t.size, 0 if covariate is None else 1
    if n < FEWEST + taken:
        return None
    root = np.sqrt(_weights(y, se))
    base = [root] if covariate is None else [root, root * (covariate - covariate.mean())]
    columns, shapes, starts = _columns(t)
    own, shapes_left = _without(base, root * y), _without(base, root[:, None] * columns)
    norm = np.sum(shapes_left**2, axis=0)
    usable = norm > 1e-9 * np.maximum(np.sum((root[:, None] * columns) ** 2, axis=0), 1e-300)
    if not usable.any():
        return None
    slope = np.where(usable, shapes_left.T @ own / np.where(usable, norm, 1.0), 0.0)
    gained = np.where(usable, slope**2 * norm, 0.0)
    best = int(np.argmax(gained))
    freedom = float(n - 3 - taken)
    rest = own - slope[best] * shapes_left[:, best]
    scale = max(1.0, float(np.sum(rest**2)) / freedom) * _carried_over(rest)
    return _change(t, (slope, norm, gained), (shapes, starts), best, scale, freedom)


def _change(
    t: FloatArray,
    fit: tuple[FloatArray, FloatArray, FloatArray],
    tried: tuple[BoolArray, FloatArray],
    best: int,
    scale: float,
    freedom: float,
) -> SeriesChange:
    """The best of the candidates with its interval; ``scale`` is the variance of the weighted errors."""
    (slope, norm, gained), (is_step, starts) = fit, tried
    p = min(1.0, slope.size * float(fisher_tail(1.0, freedom, gained[best] / scale)))
    like = gained[best] - gained <= scale * float(fisher_quantile(1.0, freedom, _LEVEL))
    same = np.flatnonzero(like & (is_step == is_step[best]) & (norm > 0))
    half = float(student_quantile(freedom, 0.5 + _LEVEL / 2)) * np.sqrt(scale / norm[same])
    low, high = slope[same] - half, slope[same] + half
    span = np.ones(same.size) if is_step[best] else t[-1] - t[starts[same].astype(np.int64)]
    own = 1.0 if is_step[best] else t[-1] - t[int(starts[best])]
    return SeriesChange(
        shape="step" if is_step[best] else "drift",
        index=int(starts[best]),
        first=int(starts[same].min()),
        last=int(starts[same].max()),
        size=float(slope[best]),
        size_ci95=(float(low.min()), float(high.max())),
        grown=float(slope[best] * own),
        grown_ci95=(float((low * span).min()), float((high * span).max())),
        p=p,
    )


def _columns(t: FloatArray) -> tuple[FloatArray, BoolArray, FloatArray]:
    """(n, k) shapes of all changes tried; which are steps; the value that each begins at."""
    n = t.size
    steps = np.arange(_SIDE, n - _SIDE + 1)
    drifts = np.arange(0, n - _SIDE)
    step = (np.arange(n)[:, None] >= steps).astype(np.float64)
    drift = np.maximum(t[:, None] - t[drifts], 0.0)
    is_step = np.repeat([True, False], [steps.size, drifts.size])
    return np.hstack([step, drift]), is_step, np.concatenate([steps, drifts]).astype(np.float64)


def _weights(y: FloatArray, se: FloatArray) -> FloatArray:
    """Inverse variances: each value's own and what neighbours differ by beyond that."""
    known = np.where(np.isfinite(se) & (se > 0), se, 0.0) ** 2
    between = 0.5 * np.median(np.diff(y) ** 2) / 0.4549  # median of chi-squared with one degree of freedom
    extra = max(0.0, between - float(np.mean(known)))
    floor = max(1e-300, 1e-12 * float(np.mean(y**2)))
    return np.asarray(1.0 / np.maximum(known + extra, floor))


def _without(base: list[FloatArray], columns: FloatArray) -> FloatArray:
    """Columns (n,) or (n, k) less their parts along the base."""
    directions = np.column_stack(base)
    directions = orth(directions / np.maximum(np.linalg.norm(directions, axis=0), 1e-300), rcond=1e-9)
    return np.asarray(columns - directions @ (directions.T @ columns))


def _carried_over(rest: FloatArray) -> float:
    """Factor by which errors that carry over from one value to the next widen the variance of a mean."""
    total = float(rest @ rest)
    if total <= 0 or rest.size < 2:
        return 1.0
    r = float(rest[1:] @ rest[:-1]) / total + 1.0 / rest.size  # the estimate is low by about one over n
    r = min(max(r, 0.0), 0.8)
    return (1.0 + r) / (1.0 - r)
