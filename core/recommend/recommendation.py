"""Recommended gamma and n, from contact-free residuals, with the evidence they rest on."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import ceil, log

import numpy as np

from collaudit.core.data.audit_result import RecommendedRule
from collaudit.core.detection.rule import persistence_samples
from collaudit.core.findings import Finding
from collaudit.core.numeric.arrays import BoolArray, FloatArray
from collaudit.core.numeric.runs import run_bounds
from collaudit.core.recommend.clean_tail import BLOCK_S, CleanTail, clean_tail

MARGIN = 1.25
#: Hours of motion of a joint between two false alarms that a recommendation promises, at 95 % confidence.
TARGET_H = 10.0
_STEP_NM = 0.1
_MIN_CLEAN_S = 10.0
_ENOUGH_HOURS = 1.0
_ZERO_EVENTS_95 = -log(0.05)  # one-sided 95 % Poisson bound on the mean when nothing was seen


@dataclass(frozen=True, slots=True, eq=False)
class CleanResidual:
    """Residual of one joint on one log, and the samples that count as contact-free evidence.

    Attributes:
        residual_nm: (n,).
        clean: (n,) judged samples away from collisions.
        period_s: sample period, s.
        left_out_s: judged seconds left out because they lie around collisions.
    """

    residual_nm: FloatArray
    clean: BoolArray
    period_s: float
    left_out_s: float = 0.0


def sustained_peaks(data: CleanResidual, n: int, block_s: float = BLOCK_S) -> FloatArray:
    """(b,) the largest level that |residual| stays above for n clean samples in a row, in each block of time, N·m.

    It is the maximum over all windows of n samples of the smallest |residual| inside: rule (6) with this n fires in a
    block of clean data exactly when gamma is below it. Blocks in which no window fits are left out.
    """
    from scipy.ndimage import minimum_filter1d

    level = np.full(data.residual_nm.size, -np.inf)
    magnitude = np.abs(data.residual_nm)
    starts, stops = run_bounds(data.clean)
    for a, b in zip(starts, stops, strict=True):
        if b - a >= n:
            level[a + n // 2 : b - (n - 1 - n // 2)] = minimum_filter1d(magnitude[a:b], n, mode="nearest")[
                n // 2 : (b - a) - (n - 1 - n // 2)
            ]
    length = max(1, round(block_s / data.period_s))
    if level.size == 0:
        return level
    peaks: FloatArray = np.maximum.reduceat(level, np.arange(0, level.size, length))
    return peaks[np.isfinite(peaks)]


def recommend_rule(data: Sequence[CleanResidual], persistence_s: float) -> RecommendedRule:
    """Recommend gamma for one joint at a persistence, over all its logs.

    gamma is 1.25 x the largest level sustained for n samples in the clean data, or the level that the tail of the
    sustained peaks reaches once in ``TARGET_H`` hours (at 95 % confidence in its scale), whichever is higher, rounded
    up to 0.1 N·m. On the data it rests on it gives no alarm; what that alone says about other data is the Poisson
    bound.

    Args:
        data: residuals of one joint, one entry a log.
        persistence_s: persistence, s.
    """
    counts = [persistence_samples(persistence_s, d.period_s) for d in data]
    n = max(counts, default=1)
    seconds = sum(_judgeable(d, c) * d.period_s for d, c in zip(data, counts, strict=True))
    hours = seconds / 3600.0
    missing = _missing(hours, sum(d.left_out_s for d in data))
    if seconds < _MIN_CLEAN_S:
        why = (
            f"only {seconds:.3g} s of judged, contact-free motion in stretches of n = {n} samples and longer "
            f"(at least {_MIN_CLEAN_S:g} s are needed)"
        )
        return RecommendedRule(None, n, None, None, hours, None, None, (), (why, *missing))
    peaks = _peaks(data, counts)
    largest, tail = float(peaks.max()), clean_tail(peaks, hours)
    if tail is None:
        missing = (*missing, "a minute of contact-free motion at least, to estimate the tail of the residual")
    gamma = _gamma(peaks, tail)
    others = []
    for factor in (0.5, 2.0, 4.0):
        other = [persistence_samples(factor * persistence_s, d.period_s) for d in data]
        at_other = _peaks(data, other)
        if at_other.size:
            judged_h = sum(_judgeable(d, c) * d.period_s for d, c in zip(data, other, strict=True)) / 3600.0
            others.append((max(other), _gamma(at_other, clean_tail(at_other, judged_h))))
    return RecommendedRule(
        gamma_nm=gamma,
        n=n,
        largest_clean_nm=largest,
        margin=gamma / largest if largest > 0 else None,
        clean_hours=hours,
        false_alarms_per_hour=None if tail is None else tail.rate_per_hour(gamma),
        false_alarms_per_hour_upper95=_ZERO_EVENTS_95 / hours,
        alternatives=tuple(others),
        missing=missing,
    )


def _peaks(data: Sequence[CleanResidual], counts: Sequence[int]) -> FloatArray:
    """Sustained peaks over all logs, each at its own n."""
    return np.concatenate([np.empty(0), *(sustained_peaks(d, c) for d, c in zip(data, counts, strict=True))])


def _gamma(peaks: FloatArray, tail: CleanTail | None) -> float:
    seldom = 0.0 if tail is None else tail.level_at(1.0 / TARGET_H)
    return _round_up(max(MARGIN * float(peaks.max()), seldom))


def _judgeable(data: CleanResidual, n: int) -> int:
    """Clean samples in stretches in which the rule can fire."""
    starts, stops = run_bounds(data.clean)
    length = stops - starts
    return int(length[length >= n].sum())


def _round_up(level: float) -> float:
    return round(max(1, ceil(level / _STEP_NM - 1e-9)) * _STEP_NM, 6)


def _missing(hours: float, left_out_s: float) -> tuple[str, ...]:
    """What would make the recommendation firmer."""
    missing = []
    if left_out_s > 0:
        missing.append(
            f"confirmation that the {left_out_s:.3g} s around alarms, left out here, were contacts: if nothing was hit "
            "there, this gamma is too low"
        )
    if hours == 0:
        missing.append("contact-free motion")
    elif hours < _ENOUGH_HOURS:
        missing.append(
            f"more contact-free motion: it is supported by {hours * 60:.3g} min, which alone cannot exclude up to "
            f"{_ZERO_EVENTS_95 / hours:.3g} false alarms an hour (95 %)"
        )
    return tuple(missing)


def little_data_findings(recommended: Mapping[str, RecommendedRule]) -> list[Finding]:
    """Joints for which the clean data do not support a threshold, and what is missing."""
    return [
        Finding(
            "recommend-little-data", "info", f"No threshold is recommended for joint '{joint}': {missing}", joint=joint
        )
        for joint, rule in recommended.items()
        if rule.gamma_nm is None
        for missing in rule.missing[:1]
    ]
