"""Friction laws compared on speeds left out of the fit and by AICc, and what the points determine of the one taken."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations

import numpy as np

from collaudit.core.data.friction_result import Bounds, Identifiability, ModelComparison, OpenSide
from collaudit.core.friction import least_squares as ls
from collaudit.core.friction.law_candidates import Candidate, FrictionUnits, fit_ridge_law
from collaudit.core.friction_laws.friction_law import FrictionLaw, RidgeLaw, SeparableLaw
from collaudit.core.friction_laws.law_registry import law_named
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


_ROUNDING = 1e-12


def identifiability(
    data: ls.Points, fitted: Candidate, richer: Candidate | None, units: FrictionUnits
) -> Identifiability:
    """What the points determine.

    Args:
        data: the points.
        fitted: the law that was taken.
        richer: the reference law where that one could not be determined, for the motion that would settle it.
        units: names of the parameters.
    """

    def key(symbol: str) -> str:
        return units.key(fitted.law, symbol)

    values = _singular_values(fitted.jacobian)
    smallest = values[-1] if values else 0.0
    correlations, covariance = {}, fitted.covariance
    for (a, first), (b, second) in combinations(enumerate(fitted.values), 2):
        if covariance is not None and covariance[a, a] > 0 and covariance[b, b] > 0:
            share = covariance[a, b] / np.sqrt(covariance[a, a] * covariance[b, b])
            correlations[f"{key(first)} ~ {key(second)}"] = float(np.clip(share, -1.0, 1.0))
    asked = richer if richer is not None else fitted
    return Identifiability(
        singular_values=values,
        condition=float(values[0] / smallest) if smallest > _ROUNDING else None,
        correlations=correlations,
        at_bounds=tuple(key(s) for s in fitted.at_bounds),
        open_sides={key(s): side for s, b in fitted.ci95.items() if (side := _open(b)) is not None},
        motion_needed=_motion(data, asked, units) if asked.reasons else (),
    )


def _singular_values(jacobian: FloatArray | None) -> tuple[float, ...]:
    if jacobian is None:
        return ()
    scale = np.linalg.norm(jacobian, axis=0)
    scaled = jacobian / np.where(scale > 0, scale, 1.0)
    return tuple(float(x) for x in np.linalg.svd(scaled, compute_uv=False))


def _open(bounds: Bounds | None) -> OpenSide | None:
    low, high = bounds or (None, None)
    if low is None and high is None:
        return "both"
    return "low" if low is None else "high" if high is None else None


def _motion(data: ls.Points, asked: Candidate, units: FrictionUnits) -> tuple[str, ...]:
    """Speeds that would close an open side of the rate, each in both directions."""
    low, high = asked.c_interval
    slowest, fastest = float(data.speed.min()), float(data.speed.max())
    needed = []
    if high is None:
        speed = 0.5 * slowest if low is None else min(0.5 * slowest, 1.0 / low)
        needed.append(f"speeds below {speed:.2g} {units.speed} in both directions")
    if low is None:
        speed = 2.0 * fastest if high is None else max(2.0 * fastest, 1.0 / high)
        needed.append(f"speeds above {speed:.2g} {units.speed} in both directions")
    if not needed:
        needed.append(
            f"more passes in both directions at speeds between {slowest:.2g} and {min(fastest, 4 * slowest):.2g} "
            f"{units.speed}"
        )
    return tuple(needed)
