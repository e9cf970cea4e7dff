"""One friction law fitted to points: parameters, intervals, covariance, and whether the data determine them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import fdtrc as fisher_tail

from collaudit.core.data.friction_result import Bounds
from collaudit.core.data.joint_log import EffortUnit, JointType
from collaudit.core.friction import least_squares as ls
from collaudit.core.friction_laws.friction_law import FrictionLaw, RateTerm, RidgeLaw, SeparableLaw, without_column
from collaudit.core.friction_laws.law_registry import LINE
from collaudit.core.numeric.arrays import FloatArray

_SIGNIFICANT = 0.01


@dataclass(frozen=True, slots=True, eq=False)
class Candidate:
    """A fitted law.

    Attributes:
        law: the law.
        values: parameters by symbol.
        ci95: intervals by symbol; None where there is none at all.
        covariance: (p, p) in the order of ``values``, or None.
        predicted: (n,) curve at the points, without the nuisance offset.
        sum_squares: weighted, with the offset.
        parameters: number fitted, offset not counted.
        c_interval: of the rate C; (None, None) for laws without one.
        reasons: why the parameters are not determined; empty when they are.
        jacobian: (n, p) weighted derivatives by the natural coefficients, or None.
        at_bounds: symbols at the edge of what was searched or allowed.
        ridge: on the weights of a ridge law.
        refusal: why friction cannot be like this; empty when it can.
        beyond: parameters that the data want beyond physical bounds by more than their uncertainty, in words.
    """

    law: FrictionLaw
    values: dict[str, float]
    ci95: dict[str, Bounds | None]
    covariance: FloatArray | None
    predicted: FloatArray
    sum_squares: float
    parameters: float
    c_interval: Bounds
    reasons: tuple[str, ...]
    jacobian: FloatArray | None
    at_bounds: tuple[str, ...] = ()
    ridge: float | None = None
    beyond: tuple[str, ...] = ()
    refusal: str = ""


def fit_linear_law(data: ls.Points, law: SeparableLaw) -> Candidate:
    """A law without a rate: ordinary weighted least squares."""
    design, target = data.design(law), data.target
    fit = ls.solve(design, target)
    k, sum_squares = len(law.symbols), float(fit.sum_squares)
    quality = ls.Quality.of(sum_squares, max(1, data.n - fit.estimate.size), data)
    values = law.named(fit.estimate[:k], 0.0)
    ci: dict[str, Bounds | None] = {
        symbol: quality.bounds(values[symbol], float(fit.covariance[i, i])) for i, symbol in enumerate(law.symbols)
    }
    return Candidate(
        law=law,
        values=values,
        ci95=ci,
        covariance=quality.scale * fit.covariance[:k, :k],
        predicted=law.curve(values, data.speed),
        sum_squares=sum_squares,
        parameters=k,
        c_interval=(None, None),
        reasons=(),
        jacobian=design,
    )


def fit_rate_law(data: ls.Points, law: SeparableLaw, term: RateTerm, units: FrictionUnits) -> Candidate:
    """A law with a rate C: profile over C, every interval taken from the profile."""
    prof = ls.profile(data, law)
    k = len(law.symbols) - 1
    freedom = data.n - prof.estimate.shape[1] - 1
    quality = ls.Quality.of(float(prof.sum_squares[prof.best]), freedom, data)
    c_interval = ls.interval_of_c(prof, quality.allowance)
    line = LINE if law.viscous_columns else without_column(LINE, "D")
    reasons = _why_not(data, prof, quality, c_interval, term, units, line)
    linear, c = prof.estimate[prof.best], float(prof.c[prof.best])
    values = law.named(linear[:k], c)
    jac = ls.jacobian(data, law, linear, c)
    turn = _translation(law, k, c)
    ci: dict[str, Bounds | None] = {}
    for symbol, row in zip(law.symbols, turn, strict=True):
        if row[-1]:
            ci[symbol] = c_interval if row[-1] > 0 else _reciprocal(c_interval)
        elif reasons:  # an open profile leaves the other coefficients without a closed interval either
            ci[symbol] = None
        else:
            full = np.concatenate([row[:-1], np.zeros(prof.estimate.shape[1] - k)])
            ci[symbol] = ls.interval_of_linear(prof, full, quality.allowance)
    low, high = ls.search_range(data)
    rates = [symbol for symbol, row in zip(law.symbols, turn, strict=True) if row[-1]]
    pick = [*range(k), jac.shape[1] - 1]
    natural = ls.solve(jac).covariance[np.ix_(pick, pick)]
    return Candidate(
        law=law,
        values=values,
        ci95=ci,
        covariance=None if reasons else np.asarray(quality.scale * turn @ natural @ turn.T),
        predicted=law.curve(values, data.speed),
        sum_squares=float(prof.sum_squares[prof.best]),
        parameters=k + 1,
        c_interval=c_interval,
        reasons=reasons,
        jacobian=jac,
        at_bounds=() if low * 1.01 < c < high * 0.99 else tuple(rates),
    )


def _translation(law: SeparableLaw, k: int, c: float) -> FloatArray:
    """(p, k + 1) derivatives of each named parameter by the linear coefficients and by C."""
    base = law.named(np.zeros(k), c)
    units = [law.named(unit, c) for unit in np.eye(k)]
    step = 1e-6 * c
    ahead, behind = law.named(np.zeros(k), c + step), law.named(np.zeros(k), c - step)
    rows = [[*(unit[s] - base[s] for unit in units), (ahead[s] - behind[s]) / (2 * step)] for s in law.symbols]
    return np.array(rows)


def _reciprocal(interval: Bounds) -> Bounds:
    low, high = interval
    return (None if high is None else 1.0 / high), (None if low is None else 1.0 / low)


def _why_not(
    data: ls.Points,
    prof: ls.Profile,
    quality: ls.Quality,
    c_interval: Bounds,
    term: RateTerm,
    units: FrictionUnits,
    straight_line: SeparableLaw,
) -> tuple[str, ...]:
    """Sentences on why the rate is not determined beside Coulomb + viscous friction; empty when it is."""
    slowest, fastest = float(data.speed.min()), float(data.speed.max())
    span = f"over {slowest:.3g} to {fastest:.3g} {units.speed}"
    line = ls.fit_at(data, straight_line, 0.0)
    more = prof.estimate.shape[1] + 1 - line.estimate.size
    gain = (float(line.sum_squares) - float(prof.sum_squares[prof.best])) / more / quality.scale
    p_value = float(fisher_tail(more, data.n - prof.estimate.shape[1] - 1, max(gain, 0.0)))
    low, high = c_interval
    verb = "are" if len(term.unknown) > 1 else "is"
    open_rate = f"{' and '.join(term.unknown)} {verb} not determined"
    straight = f"{term.rate} may be so small that {term.text} is a straight line {span}; faster motion would settle it"
    large = (
        f"{term.rate} may be so large that {term.text} is {term.large} at {slowest:.3g} {units.speed}; "
        "slower motion would settle it"
    )
    open_sides = [text for text, side in ((straight, low), (large, high)) if side is None]
    if p_value > _SIGNIFICANT:
        reason = (
            f"Coulomb + viscous friction explains the points {span} as well (F test p = {p_value:.2g}): {open_rate}"
        )
        return ("; ".join([reason, *open_sides]) + ".",)
    return tuple(f"{text}. {open_rate}." for text in open_sides)


_RIDGES = np.geomspace(1e-4, 1e6, 31)


def fit_ridge_law(data: ls.Points, law: RidgeLaw, ridge: float | None = None) -> Candidate:
    """Fit a ridge law; the ridge on its weights is the one with the smallest leave-one-out error.

    Leave-one-out errors of a ridge fit are r_i/(1 - h_ii) with h the hat matrix (Allen, Technometrics 16, 1974).

    Args:
        data: the points.
        law: the law.
        ridge: to use a ridge found before, as in fits with speeds held out.

    Returns:
        The fit; its parameter count is the trace of the hat matrix.
    """
    layout = law.layout(data.speed)
    columns = law.columns(data.speed, layout)
    design = data.columns(np.ones(data.n), data.speed, *columns.T)
    free, weights = 2, columns.shape[1]
    penalty = np.zeros(design.shape[1])
    penalty[free : free + weights] = 1.0
    tried = [float(r) for r in _RIDGES] if ridge is None else [ridge]
    errors = [_left_out(design, data.target, r * penalty) for r in tried]
    best = tried[int(np.argmin(errors))]
    gram = design.T @ design + np.diag(best * penalty)
    inverse = np.linalg.pinv(gram, hermitian=True)
    estimate = inverse @ design.T @ data.target
    rest = data.target - design @ estimate
    count = float(np.trace(inverse @ design.T @ design)) - (data.offset is not None)
    sum_squares = float(rest @ rest)
    quality = ls.Quality.of(sum_squares, max(1, round(data.n - count)), data)
    fitted = ["A", "D", *(f"W{k}" for k in range(1, weights + 1))]
    k = len(fitted)
    values = dict(zip(fitted, (float(x) for x in estimate[:k]), strict=True)) | layout
    covariance = np.zeros((len(values), len(values)))
    covariance[:k, :k] = quality.scale * inverse[:k, :k]
    return Candidate(
        law=law,
        values=values,
        ci95=dict.fromkeys(values),
        covariance=covariance,
        predicted=law.curve(values, data.speed),
        sum_squares=sum_squares,
        parameters=count,
        c_interval=(None, None),
        reasons=(),
        jacobian=None,
        ridge=best,
    )


def _left_out(design: FloatArray, target: FloatArray, penalty: FloatArray) -> float:
    inverse = np.linalg.pinv(design.T @ design + np.diag(penalty), hermitian=True)
    rest = target - design @ (inverse @ (design.T @ target))
    leverage = np.einsum("ni,ij,nj->n", design, inverse, design, optimize=True)
    return float(np.mean((rest / np.maximum(1.0 - leverage, 1e-6)) ** 2))


@dataclass(frozen=True, slots=True)
class FrictionUnits:
    """Units of one joint's friction.

    Attributes:
        effort: unit of friction: ``N·m``, ``N`` or ``raw``.
        speed: ``rad/s`` or ``m/s``.
        suffix: the effort's suffix in file keys.
        length: ``rad`` or ``m``.
    """

    effort: str
    speed: str
    suffix: str
    length: str

    @classmethod
    def of(cls, joint_type: JointType, effort_unit: EffortUnit) -> FrictionUnits:
        """Units for a kind of joint and a log's effort unit."""
        length = "m" if joint_type == "prismatic" else "rad"
        if effort_unit == "raw":
            return cls("raw", f"{length}/s", "raw", length)
        effort, suffix = ("N", "n") if joint_type == "prismatic" else ("N·m", "nm")
        return cls(effort, f"{length}/s", suffix, length)

    def key(self, law: FrictionLaw, symbol: str) -> str:
        """Key of a law's parameter in friction.json: its symbol and its unit."""
        unit = {
            "friction": f"_{self.suffix}",
            "viscous": f"_{self.suffix}_s_per_{self.length}",
            "rate": f"_s_per_{self.length}",
            "speed": f"_{self.length}_per_s",
            "number": "",
        }
        return symbol + unit[law.parameter(symbol).kind]


def parameter_symbol(key: str) -> str:
    """The symbol in a key: ``A_nm`` → ``A``."""
    return key.partition("_")[0]
