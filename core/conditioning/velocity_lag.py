"""By how much a logged velocity is later than the derivative of its position, as one that the drive filters is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil, sqrt

import numpy as np

from collaudit.core.numeric.arrays import FloatArray, IntArray, Span

#: Fewer samples than this are nothing; a lag of 2.7 ms left alone doubles the residual of fast joints.
SAMPLES = 0.25
#: A velocity that is later than this was filtered so heavily that moving it ahead does not bring it back.
_HEAVY_S = 0.005
_BLOCKS = 20
_STUDENT = 2.093  # of 19 degrees of freedom, 95 %
_MIN_BLOCKS = 4.0  # that carry the knowledge


@dataclass(frozen=True, slots=True)
class Lag:
    """How late one joint's logged velocity is.

    Attributes:
        seconds: to first order; negative when it is early.
        ci95: its interval, s.
        weight: what the joint's motion tells, (rad/s²)²: a mean over joints is weighted by it.
    """

    seconds: float
    ci95: tuple[float, float]
    weight: float

    def matters(self, period_s: float) -> bool:
        """Whether the velocity is late for certain, and by enough to show in a residual."""
        return self.ci95[0] > 0 and self.seconds >= SAMPLES * period_s

    def heavy(self, period_s: float) -> bool:
        """Whether the velocity is so late that the derivative of position is the better one."""
        return self.matters(period_s) and self.seconds >= _HEAVY_S


def lag_rows(segments: Sequence[Span], period_s: float, bandwidth_hz: float) -> IntArray:
    """Samples to compare at: four in a period of the filter, none where it settles at the ends of a stretch."""
    step = max(1, int(0.25 / (bandwidth_hz * period_s)))
    margin = ceil(0.5 / (bandwidth_hz * period_s)) + 1
    parts = [np.arange(span.start + margin, span.stop - margin, step, dtype=np.int64) for span in segments]
    return np.concatenate(parts) if parts else np.zeros(0, dtype=np.int64)


def velocity_lag(
    logged: FloatArray, derived: FloatArray, rows: IntArray, period_s: float, slowest: float
) -> Lag | None:
    """Regress what the logged velocity lacks on the acceleration: v(t - lag) = v - lag·a, in blocks of time.

    Args:
        logged: (n,) logged velocity, low-passed.
        derived: (n,) derivative of position, low-passed alike.
        rows: from :func:`lag_rows`.
        period_s: sample period, s.
        slowest: slower motion is left out.

    Returns:
        The lag with an interval from the scatter between blocks; None with too little motion.
    """
    v = derived[rows]
    a = (derived[rows + 1] - derived[rows - 1]) / (2.0 * period_s)
    behind = v - logged[rows]
    use = np.isfinite(behind + a) & (np.abs(v) > slowest)
    if np.count_nonzero(use) < 2 * _BLOCKS:
        return None
    behind, a = behind[use], a[use]
    starts = np.arange(_BLOCKS) * a.size // _BLOCKS
    power = np.add.reduceat(a * a, starts)
    weight = float(power.sum())
    if weight <= 0 or weight**2 < _MIN_BLOCKS * float(power @ power):
        return None
    product = np.add.reduceat(behind * a, starts)
    lag = float(product.sum()) / weight
    scatter = float(np.sum((product - lag * power) ** 2)) * _BLOCKS / (_BLOCKS - 1)
    half = _STUDENT * sqrt(scatter) / weight
    return Lag(lag, (lag - half, lag + half), weight)


def ahead(velocity: FloatArray, lag_s: float, segments: Sequence[Span], period_s: float) -> FloatArray:
    """(n,) a velocity moved ahead by its lag, straight between samples; the last value holds at a stretch's end."""
    out = np.full_like(velocity, np.nan)
    for span in segments:
        at = np.arange(len(span), dtype=np.float64)
        out[span.slice] = np.interp(at + lag_s / period_s, at, velocity[span.slice])
    return out


def pooled_s(lags: Sequence[Lag | None]) -> float | None:
    """Lag of all joints together, s; None where no joint tells one."""
    told = [lag for lag in lags if lag is not None]
    weight = sum(lag.weight for lag in told)
    return sum(lag.weight * lag.seconds for lag in told) / weight if weight > 0 else None
