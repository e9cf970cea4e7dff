"""Fitting a joint's friction model, and deciding how much of it the data determine."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from collaudit.core.friction import least_squares as ls
from collaudit.core.friction.units import FrictionUnits
from collaudit.core.result import Bounds, FrictionFit, FrictionPoint, KnownCombination
from collaudit.core.series import FloatArray

_LEVEL = 0.975
_SIGNIFICANT = 0.01
_MIN_SPEED_RATIO = 1.5


@dataclass(frozen=True, slots=True)
class _Quality:
    """Error scale and t quantile that turn unscaled variances into intervals."""

    scale: float
    t: float

    @property
    def allowance(self) -> float:
        return self.scale * self.t**2


def fit_friction(
    points: Sequence[FrictionPoint],
    units: FrictionUnits,
    model: str = "auto",
) -> FrictionFit:
    """Fit eq. (11) to friction points, or the simpler model the data support.

    Args:
        points: (speed, friction) points of one joint.
        units: names and units of the parameters.
        model: ``auto`` falls back to Coulomb-viscous where the exponential cannot be told apart over the
            measured speeds; ``static-lugre`` and ``coulomb-viscous`` insist.

    Returns:
        Parameters with 95 % intervals, or a fit without a model and the reason.
    """
    empty = _empty(points, units)
    reason = _too_little(points, units)
    if reason is not None:
        return replace(empty, reason=reason)
    data = _with_scatter(_arrays(points))
    simple = ls.fit_coulomb_viscous(data)
    if model == "coulomb-viscous":
        return _coulomb_viscous(
            empty, data, simple, units, ("The model was chosen in the configuration.",), (None, None)
        )
    free = 4 + (data.offset is not None)
    if data.n < free + 1:
        why = (
            f"{data.n} points are too few to tell an exponential from a straight line (at least {free + 1} are needed)."
        )
        return _coulomb_viscous(empty, data, simple, units, (why,), (None, None))
    prof = ls.profile(data)
    quality = _quality(float(prof.sum_squares[prof.best]), data.n - free)
    c_interval = ls.interval_of_c(prof, quality.allowance)
    reasons = _why_not_identifiable(data, prof, simple, quality, c_interval, units)
    if reasons and model == "auto":
        return _coulomb_viscous(empty, data, simple, units, reasons, c_interval)
    return _static_lugre(empty, data, prof, quality, c_interval, units, reasons)


def _empty(points: Sequence[FrictionPoint], units: FrictionUnits) -> FrictionFit:
    speeds = [p.speed_rad_s for p in points]
    return FrictionFit(
        model=None,
        parameters={},
        ci95={},
        covariance=None,
        identifiable=False,
        not_identifiable=(),
        known=(),
        n_points=len(points),
        n_pairs=sum(p.source == "pair" for p in points),
        speed_range_rad_s=(min(speeds), max(speeds)) if speeds else None,
        rmse_nm=None,
        effort_unit=units.effort,
        points=tuple(points),
    )


def _too_little(points: Sequence[FrictionPoint], units: FrictionUnits) -> str | None:
    """Why these points cannot carry even Coulomb-viscous friction, or None."""
    if not points:
        return "no constant-velocity section of this joint gave a friction point"
    speeds = sorted(p.speed_rad_s for p in points)
    if len(points) < 3 or speeds[-1] < _MIN_SPEED_RATIO * speeds[0]:
        mean = float(np.mean([p.friction_nm for p in points]))
        return (
            f"{len(points)} point(s) between {speeds[0]:.3g} and {speeds[-1]:.3g} {units.speed} (friction about "
            f"{mean:.3g} {units.effort}): at least 3 points over speeds a factor {_MIN_SPEED_RATIO} apart are needed"
        )
    return None


def _arrays(points: Sequence[FrictionPoint]) -> ls.Points:
    """Points as arrays; a standard error below a third of the median is not believed (blocks are few)."""
    se = np.array([p.se_nm for p in points])
    friction = np.array([p.friction_nm for p in points])
    floor = max(float(np.median(se)) / 3.0, 1e-6 * float(np.max(np.abs(friction))), 1e-12)
    direction = np.array([p.direction for p in points], dtype=float)
    both = np.count_nonzero(direction > 0) >= 2 and np.count_nonzero(direction < 0) >= 2
    offset = direction if both and len(points) >= 6 else None
    return ls.Points(np.array([p.speed_rad_s for p in points]), friction, np.maximum(se, floor), offset)


def _with_scatter(data: ls.Points) -> ls.Points:
    """Add a common variance to all points where they scatter more than their standard errors say.

    The variance is the one that brings chi-square down to its degrees of freedom (Paule and Mandel, J. Res.
    Natl. Bur. Stand. 87, 1982), so that a point with a lucky small error cannot pull the curve to itself.
    """
    free = 4 + (data.offset is not None)
    c = 0.0
    if data.n > free:
        prof = ls.profile(data)
        c = float(prof.c[prof.best])

    def excess(variance: float) -> float:
        wider = replace(data, sd=np.sqrt(data.sd**2 + variance))
        if c > 0.0:
            return ls.fit_at(wider, c).sum_squares - (data.n - free)
        return ls.fit_coulomb_viscous(wider).sum_squares - max(1, data.n - free + 2)

    top = float(np.var(data.friction)) + float(np.max(data.sd)) ** 2
    if excess(0.0) <= 0 or excess(top) >= 0:
        return data
    from scipy.optimize import brentq

    variance = float(brentq(excess, 0.0, top, xtol=1e-12 * top))
    return replace(data, sd=np.sqrt(data.sd**2 + variance))


def _quality(sum_squares: float, freedom: int) -> _Quality:
    """Errors are scaled up where the points scatter more than their standard errors say (Birge ratio)."""
    from scipy.stats import t

    return _Quality(max(1.0, sum_squares / freedom), float(t.ppf(_LEVEL, freedom)))


def _why_not_identifiable(
    data: ls.Points,
    prof: ls.Profile,
    simple: ls.LinearFit,
    quality: _Quality,
    c_interval: Bounds,
    units: FrictionUnits,
) -> tuple[str, ...]:
    """Sentences on why the exponential cannot be told from Coulomb + viscous; empty when it can."""
    from scipy.stats import f

    slowest, fastest = float(data.speed.min()), float(data.speed.max())
    span = f"over {slowest:.3g} to {fastest:.3g} {units.speed}"
    freedom = data.n - 4 - (data.offset is not None)
    gain = (simple.sum_squares - float(prof.sum_squares[prof.best])) / 2.0 / quality.scale
    p_value = float(f.sf(gain, 2, freedom))
    low, high = c_interval
    straight = f"C may be so small that exp(-C·v) is a straight line {span}; faster motion would settle it"
    gone = f"C may be so large that exp(-C·v) is gone at {slowest:.3g} {units.speed}; slower motion would settle it"
    open_sides = [text for text, side in ((straight, low), (gone, high)) if side is None]
    if p_value > _SIGNIFICANT:
        reasons = [
            f"Coulomb + viscous friction explains the points {span} as well (F test p = {p_value:.2g}): "
            "B and C are not determined"
        ]
        return ("; ".join(reasons + open_sides) + ".",)
    return tuple(f"{text}. B and C are not determined." for text in open_sides)


def _bounds(value: float, variance: float, quality: _Quality) -> Bounds:
    half = quality.t * float(np.sqrt(quality.scale * variance))
    return value - half, value + half


def _coulomb_viscous(
    empty: FrictionFit,
    data: ls.Points,
    simple: ls.LinearFit,
    units: FrictionUnits,
    reasons: tuple[str, ...],
    c_interval: Bounds,
) -> FrictionFit:
    """Coulomb + viscous parameters, and what they mean for eq. (11)."""
    freedom = max(1, data.n - simple.estimate.size)
    quality = _quality(simple.sum_squares, freedom)
    a, d = float(simple.estimate[0]), float(simple.estimate[1])
    ci = [_bounds(v, float(simple.covariance[k, k]), quality) for k, v in enumerate((a, d))]
    names = _combinations(c_interval)
    known = tuple(
        KnownCombination(name, value, interval, unit)
        for name, value, interval, unit in zip(names, (a, d), ci, (units.effort, units.viscous), strict=True)
    )
    keys = (units.key("A"), units.key("D"))
    return replace(
        empty,
        model="coulomb-viscous",
        parameters=dict(zip(keys, (a, d), strict=True)),
        ci95=dict(zip(keys, ci, strict=True)),
        covariance=_covariance(simple.covariance[:2, :2], quality),
        identifiable=False,
        not_identifiable=reasons,
        known=known,
        rmse_nm=_rmse(data, a + d * data.speed),
    )


def _combinations(c_interval: Bounds) -> tuple[str, str]:
    """What the level and the slope of a straight line mean for eq. (11), by which side of C is open.

    A slowly falling exponential is part of the line (A + B, D - B·C); one that is gone is not (A, D).
    """
    if c_interval[0] is None and c_interval[1] is not None:
        return "A + B", "D - B·C"
    if c_interval[0] is not None and c_interval[1] is None:
        return "A (A + B if C is small)", "D (D - B·C if C is small)"
    return "A + B (A alone if C is large)", "D - B·C (D alone if C is large)"


def _static_lugre(
    empty: FrictionFit,
    data: ls.Points,
    prof: ls.Profile,
    quality: _Quality,
    c_interval: Bounds,
    units: FrictionUnits,
    reasons: tuple[str, ...],
) -> FrictionFit:
    a, b, d = (float(x) for x in prof.estimate[prof.best, :3])
    c = float(prof.c[prof.best])
    keys = tuple(units.key(p) for p in "ABCD")
    intervals: list[Bounds | None] = [
        ls.interval_of_linear(prof, 0, quality.allowance),
        ls.interval_of_linear(prof, 1, quality.allowance),
        c_interval,
        ls.interval_of_linear(prof, 2, quality.allowance),
    ]
    notes = list(reasons)
    if not reasons and intervals[1] is not None and (intervals[1][1] or 0.0) < 0:
        notes.append(
            "B is negative: friction rises towards a level instead of falling from breakaway; A is not a Coulomb level."
        )
    covariance = None
    if not reasons:
        jac = ls.jacobian(data, prof.estimate[prof.best], c)
        covariance = _covariance(ls.solve(jac).covariance[:4, :4], quality)
    else:  # an open profile has no finite covariance, and its A, B, D have no closed interval either
        intervals = [None, None, c_interval, None]
    return replace(
        empty,
        model="static-lugre",
        parameters=dict(zip(keys, (a, b, c, d), strict=True)),
        ci95=dict(zip(keys, intervals, strict=True)),
        covariance=covariance,
        identifiable=not reasons,
        not_identifiable=tuple(notes),
        rmse_nm=_rmse(data, a + b * np.exp(-c * data.speed) + d * data.speed),
    )


def _covariance(unscaled: FloatArray, quality: _Quality) -> tuple[tuple[float, ...], ...]:
    return tuple(tuple(float(x) for x in row) for row in quality.scale * unscaled)


def _rmse(data: ls.Points, curve: FloatArray) -> float:
    return float(np.sqrt(np.mean((data.friction - curve) ** 2)))
