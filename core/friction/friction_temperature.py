"""Friction laws at the temperatures of the log that is judged, by the trends that a fit has shown."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from collaudit.core.data.identification_result import FrictionVariation, Trend
from collaudit.core.data.uniform_series import UniformSeries
from collaudit.core.findings import Finding, fact
from collaudit.core.friction.friction_model import FrictionModel, TemperatureModel
from collaudit.core.friction.friction_variation import trend_words
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.numeric.stats import STANDARD_ERRORS_95

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
