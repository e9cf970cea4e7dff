"""Friction variation: with running time, temperature and load on the gear, and over position."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit as student_quantile

from collaudit.core.data.identification_result import Bounds, FrictionVariation, RippleFacts, Trend, TrendFit
from collaudit.core.data.uniform_series import UniformSeries
from collaudit.core.findings import Finding, fact
from collaudit.core.friction.friction_model import FrictionModel, TemperatureModel
from collaudit.core.friction.motion_points import Settled, numbered
from collaudit.core.numeric.arrays import FloatArray, IntArray
from collaudit.core.numeric.stats import STANDARD_ERRORS_95, quantile_of

_BLOCK_S = 2.0
_MIN_BLOCKS = 12
_MIN_RUN_S = 60.0
_MIN_KELVIN = 2.0
_MIN_LOAD = 0.5  # of friction's mean: a smaller span of loads shows nothing
_MOST_CYCLES = 400  # a turn
_FINE_CYCLES = 16
_MOST_SAMPLES = 60_000
_KNOTS = 8
_TOGETHER = 4  # neighbouring blocks err alike
_SHARE_LEFT = 1e-4  # of the column's power, to be separated from a law
_ALONG = "there is too little motion at equal speeds; what went along with the speeds is in the law"


class Slope(NamedTuple):
    """Share of friction per unit with its interval, and a point of the line: what is off at the mean of the other."""

    per_unit: float
    ci95: Bounds
    mean: float
    level: float


def friction_slope(
    time_s: FloatArray, residual: FloatArray, friction: FloatArray, beside: FloatArray, against: FloatArray
) -> Slope | None:
    """Slope of residual/friction over something else, compared at equal speeds (t interval over stretches of time).

    Args:
        time_s, residual, friction: (n,) settled samples: time, torque that is left, friction as fitted, signed.
        beside: (n, k) what may be in the residual besides, from :func:`any_law`.
        against: (n,) what friction may go with.

    Returns:
        The line; None with too little time, or nothing to compare.
    """
    blocks, label = np.unique(np.floor(time_s / _BLOCK_S), return_inverse=True)
    if blocks.size < _MIN_BLOCKS:
        return None
    weight = float(friction @ friction)
    if not weight > 0:
        return None
    middle = float(friction**2 @ against) / weight
    found = jackknifed(friction * (against - middle), residual, beside, label // _TOGETHER)
    return None if found is None else Slope(*found, middle, float(residual @ friction) / weight)


def any_law(friction: FloatArray, speed: FloatArray, torque_rate: FloatArray) -> FloatArray:
    """(n, k) columns of what a law of speed, an effort stamped late or early, and a constant can explain.

    The law was fitted on the same motion: where the other rises while the speeds do, as in an experiment that goes
    through the speeds while the arm warms up, the law has taken up part of the trend. What any law of speed could
    take up (hats over speed) is therefore left aside; where that leaves little, the interval is wide.
    """
    log = np.log(np.maximum(speed, 1e-6))
    knots = np.unique(np.quantile(log, np.linspace(0.0, 1.0, _KNOTS)))
    hats = [np.interp(log, knots, row) for row in np.eye(knots.size)]
    return np.column_stack([np.ones_like(speed), torque_rate, *(np.sign(friction) * hat for hat in hats)])


def jackknifed(
    column: FloatArray, target: FloatArray, others: FloatArray, cluster: IntArray
) -> tuple[float, Bounds] | None:
    """Coefficient of one column beside others, its 95 % interval from leaving stretches of time out in turn.

    A stretch that alone separates some of the others from the column weighs as it should: without it the coefficient
    moves (MacKinnon, Nielsen and Webb, J. Appl. Econometrics 38, 2023: the cluster jackknife).

    Args:
        column, target: (n,); others: (n, k).
        cluster: (n,) number of the stretch that a sample belongs to.
    """
    power = float(column @ column)
    if not power > 0:
        return None
    squares, products = _normal_equations(column, target, others, cluster)
    inverse, total = _inverse(squares.sum(axis=0)), products.sum(axis=0)
    own = 1.0 / inverse[0, 0] if inverse[0, 0] > 0 else 0.0  # what the others leave of the column
    if own < _SHARE_LEFT:
        return None
    without = _without_each(squares, products)
    share = np.einsum("i,cij,j->c", inverse[0] * own, squares, inverse[0] * own)
    freedom = max(1.0, float(share.sum() ** 2 / (share @ share)) - 1.0)
    scatter = (len(squares) - 1) / len(squares) * float(np.sum((without - without.mean()) ** 2))
    slope = float(inverse[0] @ total)
    half = float(student_quantile(freedom, 0.975)) * float(np.sqrt(scatter))
    size = float(np.sqrt(power))
    return slope / size, ((slope - half) / size, (slope + half) / size)


def held_out_slopes(column: FloatArray, target: FloatArray, others: FloatArray, fold: IntArray) -> FloatArray:
    """(f,) coefficient of one column beside others by the samples that are not of each fold.

    Args:
        column, target, others: as of :func:`jackknifed`.
        fold: (n,) number of the fold that a sample belongs to, from 0 on, none without samples.
    """
    squares, products = _normal_equations(column, target, others, fold)
    return _without_each(squares, products) / max(float(np.linalg.norm(column)), 1e-300)


def _normal_equations(
    column: FloatArray, target: FloatArray, others: FloatArray, cluster: IntArray
) -> tuple[FloatArray, FloatArray]:
    """(c, k, k) and (c, k) of each cluster, of columns of length one; the column that is asked for is the first."""
    columns = np.column_stack([column, others])
    columns /= np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
    order = np.argsort(cluster, kind="stable")
    parts = np.split(order, np.flatnonzero(np.diff(cluster[order])) + 1)
    squares = np.array([columns[rows].T @ columns[rows] for rows in parts])
    return squares, np.array([columns[rows].T @ target[rows] for rows in parts])


def _without_each(squares: FloatArray, products: FloatArray) -> FloatArray:
    """(c,) coefficient of the first column without each cluster: its share is taken off the sums of all."""
    inverse = _inverse(squares.sum(axis=0) - squares)
    return np.asarray(np.einsum("ck,ck->c", inverse[:, 0], products.sum(axis=0) - products))


def _inverse(square: FloatArray) -> FloatArray:
    """Pseudo-inverse of one symmetric matrix (k, k), or of each of a stack."""
    return np.asarray(np.linalg.pinv(square, rcond=1e-9, hermitian=True))


def load_slope(
    time_s: FloatArray, residual: FloatArray, friction: FloatArray, load: FloatArray
) -> tuple[float, Bounds] | None:
    """N·m of friction per N·m of load on the gear, sample by sample, errors alike over two seconds (t interval).

    Args:
        time_s, residual, friction: as for :func:`friction_slope`, in the order of time.
        load: (n,) size of the torque that the gear carries, N·m.
    """
    label = numbered(np.floor(time_s / _BLOCK_S).astype(np.int64))
    if label[-1] + 1 < _MIN_BLOCKS:
        return None
    along = residual * np.sign(friction)
    at = load - load.mean()
    power = float(at @ at)
    if power <= 1e-12 * at.size:
        return None
    slope = float(at @ (along - along.mean())) / power
    score: FloatArray = np.bincount(label, weights=at * (along - along.mean() - slope * at)).astype(np.float64)
    return slope, _interval(slope, score, power, 4)


def _interval(slope: float, score: FloatArray, power: float, together: int) -> Bounds:
    sums = np.add.reduceat(score, np.arange(0, score.size, together))
    freedom = max(1, sums.size - 2)
    half = float(student_quantile(freedom, 0.975)) * float(np.sqrt(np.sum(sums**2) * sums.size / freedom)) / power
    return slope - half, slope + half


def ripple(position_rad: FloatArray, residual: FloatArray, log: str) -> RippleFacts | None:
    """The strongest harmonic over position, by projection onto sine and cosine at whole cycles a turn.

    Args:
        position_rad, residual: (n,) settled samples.
        log: its name.
    """
    if position_rad.size < 500 or np.ptp(position_rad) < 0.2:
        return None
    step = max(1, position_rad.size // 20_000)
    q, r = position_rad[::step], residual[::step] - residual.mean()
    lowest = int(np.ceil(4 * np.pi / np.ptp(q)))  # two cycles over the range at least
    power = float(np.mean(r**2))
    if power <= 0 or lowest >= _MOST_CYCLES:
        return None
    cycles = np.arange(lowest, _MOST_CYCLES + 1)
    best = int(np.argmax(np.abs(wave_sums(q, r, cycles))))
    amplitude = 2.0 * float(np.abs(np.mean(r * np.exp(-1j * cycles[best] * q))))
    return RippleFacts(amplitude, float(cycles[best]), min(1.0, 0.5 * amplitude**2 / power), log)


def wave_sums(position: FloatArray, values: FloatArray, cycles: IntArray) -> NDArray[np.complex128]:
    """Sums of values · exp(-i · cycle · position) for consecutive cycles, none skipped.

    exp(-i (a + b) q) = exp(-i a q) exp(-i b q): with a in steps of sixteen and b below, the sums are one product of
    matrices. Its rows are powers, each made of the one before: two exponentials a sample are computed in place of 400.
    """
    fine = np.empty((_FINE_CYCLES + 1, position.size), dtype=np.complex128)
    coarse = np.empty((-(-cycles.size // _FINE_CYCLES), position.size), dtype=np.complex128)
    fine[0], fine[1] = 1.0, np.exp(-1j * position)
    for k in range(2, _FINE_CYCLES + 1):
        np.multiply(fine[k - 1], fine[1], out=fine[k])
    coarse[0] = np.exp(-1j * cycles[0] * position) * values
    for k in range(1, coarse.shape[0]):
        np.multiply(coarse[k - 1], fine[-1], out=coarse[k])
    return np.asarray((coarse @ fine[:-1].T).ravel()[: cycles.size])


def joint_variation(name: str, left: Settled) -> FrictionVariation:
    """Friction of one joint against time, temperature, load and position.

    Args:
        name: of the log.
        left: the joint's settled motion in it.
    """
    data = (left.time_s, left.residual, left.friction)
    thin = slice(None, None, max(1, left.time_s.size // _MOST_SAMPLES))
    beside = any_law(left.friction[thin], left.speed[thin], left.torque_rate[thin])
    compared = (left.time_s[thin], left.residual[thin], left.friction[thin], beside)
    trends, undetermined = [], []
    minutes = float(np.ptp(left.time_s)) / 60.0
    found = friction_slope(*compared, left.time_s[thin] / 60.0) if 60.0 * minutes >= _MIN_RUN_S else None
    if found is not None:
        trends.append(Trend("time", found.per_unit, found.ci95, minutes, name))
    else:
        short = 60.0 * minutes < _MIN_RUN_S
        why = f"{60 * minutes:.0f} s of motion are too short" if short else _ALONG
        undetermined.append(f"change with running time: {why}")
    if left.temperature is not None:
        span = float(np.ptp(left.temperature))
        found = friction_slope(*compared, left.temperature[thin]) if span >= _MIN_KELVIN else None
        if found is not None:
            low, high = float(left.temperature.min()), float(left.temperature.max())
            fit = TrendFit(low, high, found.mean, found.level)
            trends.append(Trend("temperature", found.per_unit, found.ci95, span, name, fit))
        else:
            why = f"it moved by {span:.2g} K only" if span < _MIN_KELVIN else _ALONG
            undetermined.append(f"change with temperature: {why}")
    span = quantile_of(left.load, 0.95) - quantile_of(left.load, 0.05)
    enough = span >= _MIN_LOAD * float(np.mean(np.abs(left.friction)))
    loaded = load_slope(*data, left.load) if enough else None
    if loaded is not None:
        trends.append(Trend("load", *loaded, span, name))
    else:
        undetermined.append(f"change with load: gravity and inertia load the joint too evenly (over {span:.2g} N·m)")
    wave = ripple(left.position, left.residual, name)
    return FrictionVariation(tuple(trends), () if wave is None else (wave,), tuple(undetermined))


def merged(parts: Sequence[dict[str, FrictionVariation]]) -> dict[str, FrictionVariation]:
    """Friction variation of several logs, joint by joint."""
    out: dict[str, FrictionVariation] = {}
    for part in parts:
        for joint, found in part.items():
            before = out.get(joint, FrictionVariation((), (), ()))
            undetermined = tuple(dict.fromkeys((*before.untold, *found.untold)))
            trends, ripples = (*before.trends, *found.trends), (*before.ripple, *found.ripple)
            out[joint] = FrictionVariation(trends, ripples, undetermined)
    return out


#: Load and ripple are said where they are shown well enough to be used: core/friction/gear/correction_fit.py.
_CODES = {"time": "friction-warm-up", "temperature": "friction-temperature"}


def friction_variation_findings(joints: Mapping[str, FrictionVariation]) -> list[Finding]:
    """Findings on trends with time and temperature whose interval excludes zero."""
    findings = []
    for joint, found in joints.items():
        for trend in found.trends:
            if trend.shown and trend.against in _CODES:
                text = f"The friction of joint '{joint}' {trend_words(trend)}."
                findings.append(Finding(_CODES[trend.against], "info", text, joint=joint))
    return findings


def trend_words(trend: Trend) -> str:
    """A trend as the end of a sentence."""
    low, high = (x or 0.0 for x in trend.ci95)
    if trend.against == "load":
        return (
            f"rises with the load on the gear by {trend.per_unit:.2g} N·m per N·m (95 %: {low:.2g} to {high:.2g}, "
            f"over {trend.span:.2g} N·m of load)"
        )
    unit = "a minute of running" if trend.against == "time" else "a kelvin"
    return (
        f"changes by {100 * trend.per_unit:.2g} % {unit} (95 %: {100 * low:.2g} to {100 * high:.2g} %, "
        f"over {trend.span:.2g} {'min' if trend.against == 'time' else 'K'})"
    )


_NEAR_K = 1.0  # beyond the fit's temperatures and not worth a word


def laws_at_temperature(
    laws: Mapping[str, FrictionModel], variation: Mapping[str, FrictionVariation], series: UniformSeries
) -> tuple[dict[str, FrictionModel], list[Finding]]:
    """Laws that follow the log's temperatures, and findings about that.

    Args:
        laws: friction by joint.
        variation: what the friction file knows; of several logs the trend with the narrowest interval counts.
        series: the log to be judged.
    """
    out = dict(laws)
    findings: list[Finding] = []
    unknown: list[str] = []
    for joint, law in laws.items():
        trend = _temperature_trend(variation.get(joint))
        if trend is None:
            continue
        heat = None if series.temperature_c is None else series.temperature_c[:, series.column(joint)]
        if heat is None or not np.isfinite(heat).any():
            unknown.append(joint)
            continue
        model = _temperature_model(trend)
        out[joint] = replace(law, temperature_model=model)
        findings += _temperature_findings(joint, trend, model, heat[np.isfinite(heat)])
    if unknown:
        names = ", ".join(f"'{joint}'" for joint in unknown)
        text = (
            f"The friction file knows how the friction of {names} goes with temperature, and this log has no "
            "temperature of it: friction was taken as calibrated."
        )
        findings.append(fact(text))
    return out, findings


def _temperature_trend(found: FrictionVariation | None) -> Trend | None:
    """The best known trend with temperature of one joint; None where none is shown, or its place is not on file."""
    shown = [t for t in (found.trends if found is not None else ()) if t.against == "temperature" and t.shown and t.fit]
    return min(shown, key=lambda t: (t.ci95[1] or 0.0) - (t.ci95[0] or 0.0), default=None)


def _temperature_model(trend: Trend) -> TemperatureModel:
    assert trend.fit is not None
    half = 0.5 * ((trend.ci95[1] or 0.0) - (trend.ci95[0] or 0.0))
    at = trend.fit
    return TemperatureModel(trend.per_unit, half / STANDARD_ERRORS_95, at.mean, at.level, (at.lowest, at.highest))


def _temperature_findings(joint: str, trend: Trend, model: TemperatureModel, heat: FloatArray) -> list[Finding]:
    low, high = model.range_c
    here = f"{heat.min():.1f} to {heat.max():.1f} °C"
    text = (
        f"The friction of joint '{joint}' is taken at its temperature, {here}: it {trend_words(trend)} in the log "
        "it was fitted on."
    )
    findings = [fact(text, joint=joint)]
    beyond = float(np.mean((heat < low - _NEAR_K) | (heat > high + _NEAR_K)))
    if beyond > 0:
        text = (
            f"Joint '{joint}' was at {here}, for {100 * beyond:.0f} % of the log outside the {low:.1f} to "
            f"{high:.1f} °C at which its friction was fitted: there, friction of the nearer end is used."
        )
        findings.append(Finding("friction-temperature-beyond", "warning", text, joint=joint))
    return findings
