"""Changes of a series over nights, and since when: a step or a drift that begins at some point, against a constant.

y = a + b·h(t - t_k) + error, with h a step (0 before t_k, 1 from it on) or a ramp (max(0, t - t_k)), by weighted least
squares for every k. The best is tested by its F statistic times the number of k and shapes tried (Bonferroni), so that
the chance of a change where there is none is at most p, for independent normal errors of any common size. The points
that begin a change nearly as well make its interval (Seber and Lee, Linear Regression Analysis, 2003, sec. 5.4).
Errors that carry over from one value to the next widen everything by (1 + r) / (1 - r), r their correlation.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from scipy.linalg import orth
from scipy.special import fdtrc as fisher_tail
from scipy.special import fdtri as fisher_quantile
from scipy.special import stdtrit as student_quantile

from collaudit.core.history.joint_series import NightSeries, Quantity
from collaudit.core.numeric.arrays import BoolArray, FloatArray
from collaudit.core.numeric.stats import STANDARD_ERRORS_95

Shape = Literal["step", "drift"]
#: Fewer values than this show no change that could be told from chance.
FEWEST = 8
#: Values before and after a change, at least.
_SIDE = 3
_LEVEL = 0.95
#: Chance of any false change in all series of a store, over all nights on which somebody looked.
FALSE_CHANGES = 0.05
#: Nights with a temperature, as a share, and its range in kelvin, for it to be told from the rest.
_WITH_TEMPERATURE, _LEAST_RANGE_K = 0.8, 1.0
_MOST_CHANGES = 3
#: Parts of the nights in which a step is looked for where the whole shows none (Kovács et al., Biometrika 110, 2023).
_PARTS = ((0.0, 0.5), (0.25, 0.75), (0.5, 1.0))
Temperature = Literal["not known", "does not explain it", "explains it"]


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


@dataclass(frozen=True, slots=True)
class Change:
    """A change of one quantity of one joint.

    Attributes:
        quantity, joint: of what.
        shape: step, or drift that went on to the last night.
        night: that it begins with; ``night_ci95``: first and last night that it may begin with.
        told_night: first night whose data, with all before it, were enough to tell it.
        before: level before it, in the quantity's unit.
        grown, grown_ci95: from before it to the last night, in the quantity's unit.
        per_night, per_night_ci95: of a drift, as a share of ``before`` a night (of quantities that are shares or may be
            zero, in the unit); None of a step.
        chance: chance of as clear a change in any series of the store without one, all looks counted; an upper bound.
        temperature: whether the joint's temperature explains it.
    """

    quantity: Quantity
    joint: str
    shape: Literal["step", "drift"]
    night: str
    night_ci95: tuple[str, str]
    told_night: str
    before: float
    grown: float
    grown_ci95: tuple[float, float]
    per_night: float | None
    per_night_ci95: tuple[float, float] | None
    chance: float
    temperature: Temperature = "not known"


def series_changes(series: NightSeries, joint: str, tests: int) -> tuple[Change, ...]:
    """The significant changes of a series, in the order of their nights.

    Args:
        series: at least eight nights, or there are none.
        joint: its name.
        tests: how many series are looked at in all; every night counts as a further look.
    """
    looks = max(1, tests) * max(1, len(series.nights)) * _MOST_CHANGES
    found = sorted(_split(series, 0, len(series.nights), looks), key=lambda item: item[0])
    return tuple(_described(series, joint, a, change, looks) for _, a, change in found[:_MOST_CHANGES])


def _split(series: NightSeries, a: int, b: int, looks: int) -> Iterator[tuple[int, int, tuple[int, SeriesChange]]]:
    """(first night, begin of the part, (end, change)) of all changes in the nights a to b; steps part a series."""
    change = _find(series, a, b)
    if change is None:
        return
    end, begin = b, a
    if change.p * looks > FALSE_CHANGES:
        steps = [found for found in _parts(series, a, b) if found[2].p * looks * len(_PARTS) <= FALSE_CHANGES]
        if not steps:
            return
        begin, end, change = min(steps, key=lambda found: found[2].p)
    if _new_basis(series, begin, change):
        return
    yield begin + change.index, begin, (end, change)
    if change.shape == "step":
        yield from _split(series, a, begin + change.index, looks)
        yield from _split(series, begin + change.index, b, looks)


def _parts(series: NightSeries, a: int, b: int) -> Iterator[tuple[int, int, SeriesChange]]:
    """Steps in parts of the nights: wear and repair together look like no single change."""
    for first, last in _PARTS:
        begin, end = a + round(first * (b - a)), a + round(last * (b - a))
        change = _find(series, begin, end)
        if change is not None and change.shape == "step":
            yield begin, end, change


def _find(series: NightSeries, a: int, b: int) -> SeriesChange | None:
    return find_change(series.days[a:b], series.value[a:b], series.se[a:b])


def _new_basis(series: NightSeries, a: int, change: SeriesChange) -> bool:
    """A step where another friction file begins, no larger than the two curves' errors."""
    if change.shape != "step":
        return False
    for at in range(a + change.first, a + change.last + 1):
        if series.basis[at] != series.basis[at - 1]:
            error = STANDARD_ERRORS_95 * float(np.hypot(series.basis_se[at], series.basis_se[at - 1]))
            if abs(change.size) <= error:
                return True
    return False


def _described(series: NightSeries, joint: str, a: int, found: tuple[int, SeriesChange], looks: int) -> Change:
    b, change = found
    nights = series.nights
    before = float(np.mean(series.value[a : a + max(1, change.index)]))
    relative = series.quantity == "friction" and before > 0
    unit = before if relative else 1.0
    drift = change.shape == "drift"
    made = Change(
        quantity=series.quantity,
        joint=joint,
        shape=change.shape,
        night=nights[a + change.index],
        night_ci95=(nights[a + change.first], nights[a + change.last]),
        told_night=_detectable_from(series, a, b, change, looks),
        before=before,
        grown=change.grown,
        grown_ci95=change.grown_ci95,
        per_night=change.size / unit if drift else None,
        per_night_ci95=(change.size_ci95[0] / unit, change.size_ci95[1] / unit) if drift else None,
        chance=min(1.0, change.p * looks),
    )
    return replace(made, temperature=_temperature(series, a, b, change, looks))


def _detectable_from(series: NightSeries, a: int, b: int, change: SeriesChange, looks: int) -> str:
    """The night on which the data up to it were first enough, as somebody who looked every night would have seen."""
    for end in range(a + max(FEWEST, change.first + 1), b):
        early = _find(series, a, end)
        if early is not None and early.p * looks <= FALSE_CHANGES and early.grown * change.grown > 0:
            return series.nights[end - 1]
    return series.nights[b - 1]


def _temperature(series: NightSeries, a: int, b: int, change: SeriesChange, looks: int) -> Temperature:
    warm = series.temperature_c[a:b]
    known = np.isfinite(warm)
    if known.mean() < _WITH_TEMPERATURE or np.ptp(warm[known]) < _LEAST_RANGE_K:
        steady = known.mean() >= _WITH_TEMPERATURE
        return "does not explain it" if steady else "not known"
    t, y, se = (every[a:b][known] for every in (series.days, series.value, series.se))
    left = find_change(t, y, se, warm[known])
    same = left is not None and left.grown * change.grown > 0 and left.p * looks <= FALSE_CHANGES
    return "does not explain it" if same else "explains it"
