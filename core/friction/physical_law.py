"""What a fitted law may claim: friction as it can be, and parameters that the points determine.

Friction dissipates, viscous friction is not negative, breakaway not below Coulomb friction. A fit that wants otherwise
beyond its uncertainty says something about the data, not about friction: the bound holds and what the data wanted is
stated. Where the mean friction itself is negative the effort's sign is the likely cause; no bound makes sense of that.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np
from scipy.special import stdtrit as student_quantile

from collaudit.core.data.friction_result import Bounds, FrictionPoint, Identifiability, OpenSide
from collaudit.core.friction import least_squares as ls
from collaudit.core.friction.law_candidates import Candidate, FrictionUnits
from collaudit.core.friction_laws.friction_law import SeparableLaw, without_column
from collaudit.core.friction_laws.law_registry import LINE
from collaudit.core.numeric.arrays import FloatArray

_LEAST_POINTS = 3
_CLEAR = 0.999  # one-sided level at which the mean friction counts as negative
_SHARE = 0.8  # of the points that must be negative themselves
_ROUNDING = 1e-12
_FALLEN = 0.5  # of its level that friction has left at the slowest speed measured, where it is said to vanish at rest


def drives(points: Sequence[FrictionPoint]) -> bool:
    """Whether friction is negative at nearly every speed, its mean beyond its uncertainty (one-sided 99.9 %).

    Not where one direction is missing or the points are few.
    An error of the model's gravity torque raises one direction and lowers the other: their mean is free of it.
    """
    value = np.array([p.friction_nm for p in points])
    way = np.array([p.direction for p in points])
    sides = [value[way == side] for side in (1, -1)]
    pairs = value[way == 0]
    if len(points) < _LEAST_POINTS or (pairs.size == 0 and min(s.size for s in sides) == 0):
        return False
    offset = 0.0 if min(s.size for s in sides) == 0 else 0.5 * float(np.mean(sides[0]) - np.mean(sides[1]))
    free = value - offset * way
    if pairs.size == 0:
        level, freedom = 0.5 * float(np.mean(sides[0]) + np.mean(sides[1])), len(points) - 2
    else:
        level, freedom = float(np.mean(free)), len(points) - 1
    if freedom < 1:
        return False
    scatter = float(np.std(free, ddof=1)) / np.sqrt(len(points))
    timing = float(np.mean([p.timing_nm for p in points]))
    bound = level + float(student_quantile(freedom, _CLEAR)) * float(np.hypot(scatter, timing))
    return bound < 0 and float(np.mean(free < 0)) >= _SHARE


def physical(found: Candidate, speed: FloatArray, refit: Callable[[SeparableLaw], Candidate]) -> Candidate:
    """A fit held to physical bounds, with a refusal where its law does not apply.

    Args:
        found: the free fit.
        speed: (n,) speeds of the points.
        refit: fits a law with some of its columns left out to the same points.

    Returns:
        The fit, refitted where viscous friction would be negative; refused where the law would not dissipate at a
        speed used, or break away below its Coulomb friction.
    """
    law = found.law
    drives = "" if _dissipates(found, speed) else "it would drive the joint at some of the speeds measured"
    if not isinstance(law, SeparableLaw):
        return replace(found, refusal=drives)
    open_rate = law.rate is not None and bool(found.reasons)  # what is not determined wanders, and is not used
    negative = [p.symbol for p in law.parameters if p.kind == "viscous" and found.values[p.symbol] < 0]
    if negative and not open_rate:
        smaller = law
        for symbol in negative:
            smaller = without_column(smaller, symbol)
        found = _held(found, refit(smaller), negative)
    level, rise = _level_and_rise(found)
    known = law.rate is not None and not open_rate
    if known and level < 0:
        return replace(found, refusal="Coulomb friction would be negative")
    if known and law.breakaway and rise < 0:
        return replace(found, refusal="breakaway friction would be below Coulomb friction")
    if known and (below := _negative_friction(found)):
        return replace(found, refusal=f"{below} would be negative")
    if _dissipates(found, speed):
        return found
    return _bounded_line(found, speed, refit) if law is LINE else replace(found, refusal=drives)


def vanishes_unseen(found: Candidate, speed: FloatArray) -> str:
    """Why a law by which friction vanishes towards rest is not taken: the fall lies below all speeds measured.

    Any curve that levels off is imitated by such a law, which then has no friction at the speeds it was not fitted to.

    Args:
        found: the fit.
        speed: (n,) speeds of the points.
    """
    law = found.law
    if not isinstance(law, SeparableLaw) or law.rate is None or found.reasons:
        return ""
    level, rise = _level_and_rise(found)
    if level <= 0 or level + rise > 1e-3 * level:
        return ""
    slowest = np.array([float(speed.min())])
    left = float(np.broadcast_to(law.shape(slowest, law.natural(found.values)[1])[0], 1)[0])
    return "" if left < _FALLEN else "friction would vanish below the slowest speed measured, where nothing shows it"


def _bounded_line(found: Candidate, speed: FloatArray, refit: Callable[[SeparableLaw], Candidate]) -> Candidate:
    """The straight line with neither level nor slope below zero."""
    flat = refit(without_column(LINE, "A")) if found.values["A"] < 0 < found.values["D"] else found
    level = max(flat.values.get("A", 0.0), 0.0)
    slope = max(flat.values.get("D", 0.0), 0.0)
    values = {"A": level, "D": slope}
    return replace(
        found,
        values=values,
        ci95={symbol: (0.0, max(0.0, (found.ci95[symbol] or (0.0, 0.0))[1] or 0.0)) for symbol in values},
        predicted=level + slope * speed,
        sum_squares=flat.sum_squares,
        at_bounds=tuple(symbol for symbol, value in values.items() if value == 0.0),
        beyond=(*found.beyond, *_wanted(found, ["A"])),
    )


def _held(free: Candidate, bounded: Candidate, symbols: Sequence[str]) -> Candidate:
    """The bounded fit under the names of the free one; intervals of what is held end at zero."""
    values = {s: bounded.values.get(s, 0.0) for s in free.values}
    ci95 = {s: bounded.ci95.get(s) for s in free.values}
    for symbol in symbols:
        upper = (free.ci95[symbol] or (None, None))[1]
        ci95[symbol] = None if upper is None else (0.0, max(0.0, upper))
    covariance = None
    if bounded.covariance is not None:
        names = list(free.values)
        kept = [names.index(s) for s in bounded.values]
        covariance = np.zeros((len(names), len(names)))
        covariance[np.ix_(kept, kept)] = bounded.covariance
    return replace(
        bounded,
        law=free.law,
        values=values,
        ci95=ci95,
        covariance=covariance,
        at_bounds=(*bounded.at_bounds, *symbols),
        beyond=(*free.beyond, *_wanted(free, symbols)),
    )


def _wanted(free: Candidate, symbols: Sequence[str]) -> tuple[str, ...]:
    """What the data wanted beyond the bound by more than its interval, in words."""
    out = []
    for symbol in symbols:
        low, high = free.ci95[symbol] or (None, None)
        if high is not None and high < 0 and low is not None:
            out.append(f"{symbol} = {free.values[symbol]:.3g} (95 %: {low:.3g} to {high:.3g})")
    return tuple(out)


def _level_and_rise(found: Candidate) -> tuple[float, float]:
    """Coulomb level, the first coefficient of every law, and what friction towards standstill lies above it."""
    law = found.law
    assert isinstance(law, SeparableLaw)
    linear, _ = law.natural(found.values)
    start = float(law.curve(found.values, np.array([1e-9]))[0])
    return float(linear[0]), start - float(linear[0])


def _negative_friction(found: Candidate) -> str:
    """What friction cannot be below zero and is: a level."""
    law = found.law
    symbols = [p.symbol for p in law.parameters if p.kind == "friction"]
    return "" if law.breakaway else next((symbol for symbol in symbols if found.values[symbol] < 0), "")


def _dissipates(found: Candidate, speed: FloatArray) -> bool:
    """Whether friction opposes the motion at every speed measured, to 0.1 % of the largest."""
    grid = np.linspace(float(speed.min()), float(speed.max()), 50)
    friction = found.law.curve(found.values, grid)
    return bool(np.min(friction) >= -1e-3 * float(np.max(np.abs(friction))))


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
