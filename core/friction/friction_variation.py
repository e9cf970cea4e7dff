"""Friction variation with running time, temperature and load on the gear; laws at the temperatures of a judged log."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Literal

import numpy as np

from collaudit.core.data.identification_result import FrictionVariation, Trend, TrendFit
from collaudit.core.data.uniform_series import UniformSeries
from collaudit.core.findings import Finding, fact
from collaudit.core.friction.friction_model import FrictionModel
from collaudit.core.friction.motion_points import Settled
from collaudit.core.friction.slopes import any_law, friction_slope
from collaudit.core.numeric.arrays import FloatArray

Against = Literal["time", "temperature", "load"]
_MIN_RUN_MIN = 1.0
_MIN_KELVIN = 2.0
_MIN_LOAD = 0.5  # of friction's mean: a smaller span of loads shows nothing
_MOST_SAMPLES = 60_000
_NEAR_K = 1.0  # beyond the fit's temperatures and not worth a word
_ALONG = "there is too little motion at equal speeds; what went along with the speeds is in the law"


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


def merged(parts: Sequence[dict[str, FrictionVariation]]) -> dict[str, FrictionVariation]:
    """Friction variation of several logs, joint by joint."""
    out: dict[str, FrictionVariation] = {}
    for part in parts:
        for joint, found in part.items():
            before = out.get(joint, FrictionVariation((), ()))
            undetermined = tuple(dict.fromkeys((*before.untold, *found.untold)))
            out[joint] = FrictionVariation((*before.trends, *found.trends), undetermined)
    return out


def friction_variation_findings(joints: Mapping[str, FrictionVariation]) -> list[Finding]:
    """Trends with time and temperature whose interval excludes zero.

    Load and ripple are said where they are shown well enough to be used: core/friction/gear_corrections.py.
    """
    findings = []
    for joint, found in joints.items():
        for trend in found.trends:
            if trend.shown and trend.against in ("time", "temperature"):
                text = f"The friction of joint '{joint}' {trend_words(trend)}."
                findings.append(fact(text, joint=joint))
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
        findings.append(Finding("evidence-range", "warning", text, joint=joint))
    return findings
