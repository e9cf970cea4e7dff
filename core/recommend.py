"""Recommended gamma and n, from collision-free residuals, with the evidence they rest on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil, log

import numpy as np

from collaudit.core.result import RecommendedRule
from collaudit.core.runs import run_bounds
from collaudit.core.series import BoolArray, FloatArray

MARGIN = 1.25
_STEP_NM = 0.1
_MIN_CLEAN_S = 10.0
_ENOUGH_HOURS = 1.0
_ZERO_EVENTS_95 = -log(0.05)  # one-sided 95 % Poisson bound on the mean when nothing was seen


@dataclass(frozen=True, slots=True, eq=False)
class CleanResidual:
    """Residual of one joint on one log, and the samples that count as collision-free evidence.

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


def sustained_level(data: CleanResidual, n: int) -> float | None:
    """The largest level that |residual| stays above for n clean samples in a row, N·m.

    It is the maximum over all windows of n samples of the smallest |residual| inside: rule (6) with this
    n fires on clean data exactly when gamma is below it. None when no window fits.
    """
    from scipy.ndimage import minimum_filter1d

    best: float | None = None
    magnitude = np.abs(data.residual_nm)
    starts, stops = run_bounds(data.clean)
    for a, b in zip(starts, stops, strict=True):
        if b - a >= n:
            lowest = minimum_filter1d(magnitude[a:b], n, mode="nearest")
            centre = lowest[n // 2 : (b - a) - (n - 1 - n // 2)]
            best = max(best or 0.0, float(centre.max()))
    return best


def recommend_rule(data: Sequence[CleanResidual], persistence_s: float) -> RecommendedRule:
    """Recommend gamma for one joint at a persistence, over all its logs.

    gamma = 1.25 x the largest level sustained for n samples in the clean data, rounded up to 0.1 N·m. On
    the data it rests on it gives no alarm; what that says about other data is the Poisson bound.

    Args:
        data: residuals of one joint, one entry a log.
        persistence_s: persistence, s.
    """
    from collaudit.core.detection import persistence_samples

    counts = [persistence_samples(persistence_s, d.period_s) for d in data]
    n = max(counts, default=1)
    seconds = sum(_judgeable(d, c) * d.period_s for d, c in zip(data, counts, strict=True))
    hours = seconds / 3600.0
    missing = _missing(hours, sum(d.left_out_s for d in data))
    if seconds < _MIN_CLEAN_S:
        why = (
            f"only {seconds:.3g} s of judged, collision-free motion in stretches of n = {n} samples and longer "
            f"(at least {_MIN_CLEAN_S:g} s are needed)"
        )
        return RecommendedRule(None, n, None, None, hours, None, None, (), (why, *missing))
    largest = _largest(data, counts) or 0.0
    gamma = _round_up(MARGIN * largest)
    others = []
    for factor in (0.5, 2.0, 4.0):
        other = [persistence_samples(factor * persistence_s, d.period_s) for d in data]
        level = _largest(data, other)
        if level is not None:
            others.append((max(other), _round_up(MARGIN * level)))
    return RecommendedRule(
        gamma_nm=gamma,
        n=n,
        largest_clean_nm=largest,
        margin=gamma / largest if largest > 0 else None,
        clean_hours=hours,
        false_alarms_per_hour=0.0,
        false_alarms_per_hour_upper95=_ZERO_EVENTS_95 / hours,
        alternatives=tuple(others),
        missing=missing,
    )


def _judgeable(data: CleanResidual, n: int) -> int:
    """Clean samples in stretches in which the rule can fire."""
    starts, stops = run_bounds(data.clean)
    length = stops - starts
    return int(length[length >= n].sum())


def _largest(data: Sequence[CleanResidual], counts: Sequence[int]) -> float | None:
    """The largest sustained level over all logs, each at its own n; None when no window fits anywhere."""
    levels = [sustained_level(d, c) for d, c in zip(data, counts, strict=True)]
    return max((level for level in levels if level is not None), default=None)


def _round_up(level: float) -> float:
    return round(max(1, ceil(level / _STEP_NM - 1e-9)) * _STEP_NM, 6)


def _missing(hours: float, left_out_s: float) -> tuple[str, ...]:
    """What would make the recommendation firmer."""
    missing = []
    if left_out_s > 0:
        missing.append(
            f"certainty about {left_out_s:.3g} s around alarms, left out as collisions: if nothing was hit there, "
            "this gamma is too low"
        )
    if hours == 0:
        missing.append("collision-free motion")
    elif hours < _ENOUGH_HOURS:
        missing.append(
            f"more collision-free motion: it rests on {hours * 60:.3g} min, so up to "
            f"{_ZERO_EVENTS_95 / hours:.3g} false alarms an hour cannot be excluded (95 %)"
        )
    return tuple(missing)
