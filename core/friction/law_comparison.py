"""Friction laws compared: on speeds left out of the fit, by AICc, and how far the points scatter about all of them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import scipy

from collaudit.core.data.friction_result import ModelComparison
from collaudit.core.friction import least_squares as ls
from collaudit.core.friction.law_candidates import Candidate, fit_ridge_law
from collaudit.core.friction_laws.friction_law import FrictionLaw, RidgeLaw, SeparableLaw
from collaudit.core.friction_laws.law_registry import LAWS, LINE, law_named
from collaudit.core.numeric.arrays import FloatArray, IntArray

_FOLDS = 10
_MIN_SPEEDS = 4
_SAME_SPEED = 1.03
_UNTOLD = 1e20  # variance of a coefficient whose column others explain
_NO_MATCH = 4.0  # times the best's mean square, or noise's where that is more: twice its error is not "as good"
_AICC_TIE = 6.0  # "considerably less support" (Burnham and Anderson, Model Selection, 2002, 2.6)


#: Errors at speeds left out: score in squared standard deviations, its standard error, RMSE in N·m.
_HeldOut = tuple[float, float, float]


def speed_folds(speed: FloatArray) -> IntArray | None:
    """(n,) fold of each point, whole speeds together, neighbouring speeds apart; None with too few speeds."""
    order = np.argsort(speed, kind="stable")
    cluster = np.zeros(speed.size, dtype=np.int64)
    start, count = float(speed[order[0]]), 0
    for i in order:
        if speed[i] > _SAME_SPEED * start:
            start, count = float(speed[i]), count + 1
        cluster[i] = count
    if count + 1 < _MIN_SPEEDS:
        return None
    return np.asarray(cluster % min(_FOLDS, count + 1), dtype=np.int64)


def held_out(data: ls.Points, law: FrictionLaw, folds: IntArray, ridge: float | None = None) -> _HeldOut | None:
    """Fit without each fold of speeds in turn and predict it; None where what is left cannot carry the law."""
    errors = np.full(data.n, np.nan)
    for fold in range(int(folds.max()) + 1):
        rest, out = (np.asarray(np.flatnonzero(x), dtype=np.int64) for x in (folds != fold, folds == fold))
        predicted = _predict(data.take(rest), data.take(out), law, ridge)
        if predicted is None:
            return None
        errors[out] = data.friction[out] - predicted
    with np.errstate(over="ignore"):  # a law that runs away beyond its points is as wrong as can be
        square = (errors / data.sd) ** 2
        means = np.array([square[folds == k].mean() for k in range(int(folds.max()) + 1)])
        se = float(np.std(means, ddof=1) / np.sqrt(means.size))
    return float(square.mean()), se, float(np.sqrt(np.mean(errors**2)))


def _predict(train: ls.Points, test: ls.Points, law: FrictionLaw, ridge: float | None) -> FloatArray | None:
    """Friction at the test points by a fit to the others, their offset included; None where they cannot carry it."""
    if isinstance(law, SeparableLaw):
        return _predict_separable(train, test, law)
    assert isinstance(law, RidgeLaw)
    if train.n < law.least_held_out:
        return None
    fitted = fit_ridge_law(train, law, ridge)
    curve = law.curve(fitted.values, test.speed)
    if train.offset is None or test.offset is None:
        return curve
    rest = train.friction - fitted.predicted
    offset = float(np.sum(rest * train.offset / train.sd**2) / np.sum(train.offset**2 / train.sd**2))
    return np.asarray(curve + offset * test.offset)


def _predict_separable(train: ls.Points, test: ls.Points, law: SeparableLaw) -> FloatArray | None:
    if train.n < len(law.symbols) + (train.offset is not None) + 1:
        return None
    c = ls.best_rate(train, law) if law.rate is not None else 0.0
    design = train.design(law, c)
    fit = ls.solve(design, train.target)
    if not float(np.diag(fit.covariance).max()) < _UNTOLD:
        return None
    estimate = fit.estimate
    held = [k for k in law.viscous_columns if estimate[k] < 0]
    if held:
        free = np.delete(np.arange(design.shape[1]), held)
        estimate = np.zeros(design.shape[1])
        estimate[free] = ls.solve(design[:, free], train.target).estimate
    return np.asarray(test.raw(law, c) @ estimate)


def aicc(data: ls.Points, candidate: Candidate) -> float | None:
    """n·ln(SS/n) + 2k + 2k(k+1)/(n-k-1), the offset and the error scale counted (Hurvich and Tsai 1989)."""
    k = candidate.parameters + (data.offset is not None) + 1
    spare = data.n - k - 1
    if spare <= 0:
        return None
    chi = max(candidate.sum_squares, 1e-300)
    return float(data.n * np.log(chi / data.n) + 2 * k + 2 * k * (k + 1) / spare)


def compare(data: ls.Points, candidates: list[Candidate]) -> list[ModelComparison]:
    """The table, in the order of ``candidates``; nothing chosen yet."""
    folds = speed_folds(data.speed)
    rows = []
    for candidate in candidates:
        out = None if folds is None else held_out(data, candidate.law, folds, candidate.ridge)
        score, se, rmse = (None, None, None) if out is None else out
        note = "" if out is not None else "too few speeds to leave any out"
        if candidate.reasons:
            note = "its parameters are not determined by the data"
        if candidate.refusal:
            note = candidate.refusal
        rows.append(
            ModelComparison(
                model=candidate.law.name,
                parameters=round(float(candidate.parameters), 2),
                rmse_nm=float(np.sqrt(np.mean((data.friction - candidate.predicted) ** 2))),
                held_out_rmse_nm=rmse,
                held_out_score=score,
                held_out_score_se=se,
                aicc=aicc(data, candidate),
                chosen=False,
                note=note,
            )
        )
    return rows


def choose(rows: list[ModelComparison], usable: list[bool]) -> tuple[int | None, list[ModelComparison]]:
    """The simplest usable law within one standard error of the best on speeds held out.

    The standard error is the larger of the two laws', and no law with twice the best's error (and noise's) is
    close: one that misses speeds on end has a large standard error for that very reason. The data-driven law counts
    as the largest of all and is taken only where every other is two standard errors worse, or has twice its error:
    its parameters mean nothing by themselves. Among laws of equal size the one with the clearly smaller AICc (by 6
    and more), else the one listed first.

    Returns:
        Its index (None when nothing could be held out), and the table with notes.
    """
    scored = [i for i, row in enumerate(rows) if usable[i] and row.held_out_score is not None]
    if not scored:
        return None, rows
    best = min(scored, key=lambda i: rows[i].held_out_score or 0.0)
    close = [i for i in scored if _within(rows[i], rows[best])]
    fewest = min(_size(rows[i]) for i in close)
    simplest = [i for i in close if _size(rows[i]) == fewest]
    taken = simplest[0]
    for i in simplest[1:]:
        now, other = rows[taken].aicc, rows[i].aicc
        if now is not None and other is not None and other < now - _AICC_TIE:
            taken = i
    out = []
    for i, row in enumerate(rows):
        note = row.note
        if i == taken:
            note = "the simplest within one standard error of the best" if i != best else "the best and simplest enough"
        elif usable[i] and i in scored:
            note = "as good, and not simpler" if i in close else "worse on speeds held out"
        out.append(replace(row, chosen=i == taken, note=note))
    return taken, out


def _size(row: ModelComparison) -> tuple[bool, int]:
    return law_named(row.model).data_driven, round(row.parameters or 0.0)


def _within(row: ModelComparison, best: ModelComparison) -> bool:
    """Whether a law's score is within one standard error of the best (two where the best is data-driven)."""
    se = max(row.held_out_score_se or 0.0, best.held_out_score_se or 0.0)
    reach = 2.0 if law_named(best.model).data_driven else 1.0
    score, least = row.held_out_score or 0.0, best.held_out_score or 0.0
    return score <= min(least + reach * se, _NO_MATCH * max(least, 1.0))


def with_scatter(points: ls.Points) -> ls.Points:
    """Add a common variance to all points where they scatter more than their standard errors say.

    The variance is the one that brings chi-square down to its degrees of freedom (Paule and Mandel, J. Res.
    Natl. Bur. Stand. 87, 1982), so that a point with a lucky small error cannot pull the curve to itself. Points that
    rely on the robot model have a variance of their own beside pairs: an error of the model, or a drift of the
    effort's zero, is in them and not in pairs.
    """
    pair = np.asarray(points.direction == 0)
    variance = np.zeros(points.n)
    pairs = points.take(np.asarray(np.flatnonzero(pair), dtype=np.int64))
    if pairs.n < points.n and _flexible(pairs):
        variance[pair], law = _common_variance(pairs)
        rest = points.take(np.asarray(np.flatnonzero(~pair), dtype=np.int64))
        settled = replace(pairs, sd=np.sqrt(pairs.sd**2 + variance[pair]))
        variance[~pair] = _variance_needed_beyond(settled, rest, law)
    else:
        variance[:], _ = _common_variance(points)
    return replace(points, sd=np.sqrt(points.sd**2 + variance))


def _common_variance(data: ls.Points) -> tuple[float, SeparableLaw]:
    """The variance that the points need about the law that needs least, and that law."""
    laws = _flexible(data) or [LINE]
    most = float(np.var(data.friction)) + float(np.max(data.sd)) ** 2
    needed = [_variance_needed(_excess(data, law), most) for law in laws]
    return min(needed), laws[int(np.argmin(needed))]


def _variance_needed_beyond(pairs: ls.Points, rest: ls.Points, law: SeparableLaw) -> float:
    """Variance that points resting on the model need about the curve of the pairs, an offset aside where they show one.

    They are not weighed together with the pairs: many good pairs would leave room for a model point far off the curve.
    """
    c = ls.best_rate(pairs, law) if law.rate is not None else 0.0
    k = len(law.symbols) - (law.rate is not None)
    columns = np.stack(law.shape(rest.speed, c), axis=-1)
    left = rest.friction - columns @ ls.fit_at(pairs, law, c).estimate[:k]
    freedom = rest.n - (rest.offset is not None)

    def excess(variance: float) -> float:
        weight = 1.0 / (rest.sd**2 + variance)
        mean = 0.0 if rest.offset is None else float(np.sum(weight * left * rest.offset) / np.sum(weight))
        return float(np.sum(weight * (left - mean * rest.direction) ** 2)) - freedom

    return _variance_needed(excess, rest.n * float(np.max(left**2)) + 1e-12)


def _flexible(data: ls.Points) -> list[SeparableLaw]:
    """The laws that the points could carry, as yardsticks of their scatter: the one that fits best counts.

    All that can bend more than the line, the freest first (of equal ones the first listed counts).
    """
    freer = [law for law in LAWS.values() if isinstance(law, SeparableLaw) and len(law.symbols) > len(LINE.symbols)]
    return [law for law in sorted(freer, key=lambda law: -len(law.symbols)) if data.n > _free(data, law)]


def _free(data: ls.Points, law: SeparableLaw) -> int:
    return len(law.symbols) + (data.offset is not None)


def _excess(data: ls.Points, law: SeparableLaw) -> Callable[[float], float]:
    """By what share of itself chi-square of a law exceeds its degrees of freedom, by the common variance.

    It falls, and along a straight line where all points have one standard deviation.
    """
    c = ls.best_rate(data, law) if law.rate is not None else 0.0
    columns, freedom = data.raw(law, c), max(1, data.n - _free(data, law))

    def excess(variance: float) -> float:
        weighed = replace(data, sd=np.sqrt(data.sd**2 + variance))
        return 1.0 - freedom / max(float(ls.solve(weighed.weighted(columns), weighed.target).sum_squares), 1e-300)

    return excess


def _variance_needed(excess: Callable[[float], float], top: float) -> float:
    """Common variance that brings chi-square down to its degrees of freedom; 0 where it is there already."""
    if excess(0.0) <= 0:
        return 0.0
    if excess(top) >= 0:
        return top
    return float(scipy.optimize.brentq(excess, 0.0, top, xtol=1e-12 * top, rtol=1e-6))
