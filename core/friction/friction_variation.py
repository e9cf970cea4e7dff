"""Friction variation with running time, temperature and load on the gear; laws at the temperatures of a judged log."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Literal

import numpy as np

from collaudit.core.data.identification_result import Bounds, FrictionVariation, Trend, TrendFit
from collaudit.core.data.uniform_series import UniformSeries
from collaudit.core.findings import Finding, fact
from collaudit.core.friction.friction_model import FrictionModel
from collaudit.core.friction.motion_points import Settled
from collaudit.core.numeric.arrays import FloatArray, IntArray
from collaudit.core.torque_table.block_sums import BlockSums

Against = Literal["time", "temperature", "load"]
_MIN_RUN_MIN = 1.0
_MIN_KELVIN = 2.0
_MIN_LOAD = 0.5  # of friction's mean: a smaller span of loads shows nothing
_MOST_SAMPLES = 60_000
_NEAR_K = 1.0  # beyond the fit's temperatures and not worth a word
_ALONG = "there is too little motion at equal speeds; what went along with the speeds is in the law"
_BLOCK_S = 2.0
_KNOTS = 8
_TOGETHER = 4  # neighbouring blocks err alike
_LEAST_OWN = 0.01  # of the column's standard deviation, to be separated from a law
#: Share of friction per unit with its interval, and a point of the line: the mean of the other, and what is off there.
Slope = tuple[float, Bounds, float, float]


def joint_variation(name: str, left: Settled) -> FrictionVariation:
    """Friction of one joint against time, temperature and load.

    Args:
        name: of the log.
        left: the joint's settled motion in it.
    """
    thin = slice(None, None, max(1, left.time_s.size // _MOST_SAMPLES))
    time_s, residual, friction = left.time_s[thin], left.residual[thin], left.friction[thin]
    beside, trends, undetermined = (
        any_law(friction, left.speed[thin], left.torque_rate[thin]),
        list[Trend](),
        list[str](),
    )
    asked: list[tuple[Against, FloatArray, FloatArray, float, str]] = [
        ("time", time_s / 60.0, friction, _MIN_RUN_MIN, "min"),
        ("load", left.load[thin], np.sign(friction), _MIN_LOAD * float(np.mean(np.abs(friction))), "N·m"),
    ]
    if left.temperature is not None:
        asked.insert(1, ("temperature", left.temperature[thin], friction, _MIN_KELVIN, "K"))
    for what, against, goes, least, unit in asked:
        low, high = float(against.min()), float(against.max())
        found = friction_slope(time_s, residual, goes, beside, against) if high - low >= least else None
        if found is not None:
            fit = TrendFit(low, high, *found[2:]) if what == "temperature" else None
            trends.append(Trend(what, *found[:2], high - low, name, fit))
        else:
            why = f"it moved by {high - low:.2g} {unit} only" if high - low < least else _ALONG
            undetermined.append(f"change with {what}: {why}")
    return FrictionVariation(tuple(trends), tuple(undetermined))


def of_logs(parts: Sequence[FrictionVariation]) -> FrictionVariation:
    """Friction variation of one joint over several logs."""
    untold = dict.fromkeys(text for part in parts for text in part.untold)
    return FrictionVariation(tuple(trend for part in parts for trend in part.trends), tuple(untold))


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
        out[joint] = replace(law, temperature_trend=trend)
        findings += _temperature_findings(joint, trend, heat[np.isfinite(heat)])
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


def _temperature_findings(joint: str, trend: Trend, heat: FloatArray) -> list[Finding]:
    assert trend.fit is not None
    low, high = trend.fit.lowest, trend.fit.highest
    here = f"{heat.min():.1f} to {heat.max():.1f} °C"
    least, most = (100 * (end or 0.0) for end in trend.ci95)
    text = (
        f"The friction of joint '{joint}' is taken at its temperature, {here}: in the log it was fitted on it changes "
        f"by {100 * trend.per_unit:.2g} % a kelvin (95 %: {least:.2g} to {most:.2g} %, over {trend.span:.2g} K)."
    )
    findings = [fact(text, joint=joint)]
    beyond = float(np.mean((heat < low - _NEAR_K) | (heat > high + _NEAR_K)))
    if beyond > 0:
        text = (
            f"Joint '{joint}' was at {here}, for {100 * beyond:.0f} % of the log outside the {low:.1f} to "
            f"{high:.1f} °C at which its friction was fitted: there, friction of the nearer end is used."
        )
        findings.append(Finding("evidence-range", "warning", text, joint=joint))
    return findings


def friction_slope(
    time_s: FloatArray, residual: FloatArray, friction: FloatArray, nuisance: FloatArray, against: FloatArray
) -> Slope | None:
    """Slope of residual/friction over something else, compared at equal speeds (t interval over stretches of time).

    Args:
        time_s, residual: (n,) settled samples: time, torque that is left.
        friction: (n,) what the slope is a share of: friction as fitted, signed; its sign alone for a slope in N·m.
        nuisance: (n, k) what may be in the residual besides, from :func:`any_law`.
        against: (n,) what friction may go with.

    Returns:
        The line; None with too little time, or nothing to compare.
    """
    weight = float(friction @ friction)
    if not weight > 0:
        return None
    middle = float(friction**2 @ against) / weight
    _, label = np.unique(np.floor(time_s / _BLOCK_S), return_inverse=True)
    found = jackknifed(friction * (against - middle), residual, nuisance, label // _TOGETHER)
    return None if found is None else (*found, middle, float(residual @ friction) / weight)


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
    """Coefficient of one column beside others, its 95 % interval from stretches of time.

    A stretch that alone separates some of the others from the column weighs as it should: without it the coefficient
    moves (MacKinnon, Nielsen and Webb, J. Appl. Econometrics 38, 2023: the cluster jackknife).

    Args:
        column, target: (n,); others: (n, k).
        cluster: (n,) number of the stretch that a sample belongs to, rising.
    """
    names = ("left", "column", *map(str, range(others.shape[1])))
    sums = BlockSums.of(cluster, names, np.column_stack([target, column, others]))
    found = sums.slope(*names, least_own=_LEAST_OWN)
    return None if found is None else (found.value, (found.value - found.half, found.value + found.half))
