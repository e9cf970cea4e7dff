"""Changes of one series over nights: their first night, their size, and the night on which the data told them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from collaudit.core.history.change_point import FEWEST, SeriesChange, find_change
from collaudit.core.history.joint_series import NightSeries, Quantity
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.numeric.stats import STANDARD_ERRORS_95

#: Chance of any false change in all series of a store, over all nights on which somebody looked.
FALSE_CHANGES = 0.05
#: Nights with a temperature, as a share, and its range in kelvin, for it to be told from the rest.
_WITH_TEMPERATURE, _LEAST_RANGE_K = 0.8, 1.0
_MOST_CHANGES = 3
#: Parts of the nights in which a step is looked for where the whole shows none (Kovács et al., Biometrika 110, 2023).
_PARTS = ((0.0, 0.5), (0.25, 0.75), (0.5, 1.0))

Temperature = Literal["not known", "does not explain it", "explains it"]


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


def _find(series: NightSeries, a: int, b: int, covariate: FloatArray | None = None) -> SeriesChange | None:
    own = slice(a, b)
    return find_change(series.days[own], series.value[own], series.se[own], covariate)


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
