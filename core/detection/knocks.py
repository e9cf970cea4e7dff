"""Knocks shorter than the persistence: near misses by impulse.

A blow of 12 ms never lasts n samples, and the kernel of a detector lowers its peak. What a kernel of unit gain keeps is
the impulse, torque times time. A torque of gamma for n samples has the impulse gamma·n·T: a short excursion of the
residual that reaches a share of it is nearly a collision, however brief it was.
"""

from __future__ import annotations

from math import ceil

import numpy as np

from collaudit.core.detection.rule import Event, Level
from collaudit.core.numeric.arrays import BoolArray, FloatArray, Span
from collaudit.core.numeric.runs import run_bounds
from collaudit.core.numeric.stats import SD_PER_MAD, median_of

#: A kernel leaves nearly all of a short knock within this many of its settling times.
_SETTLING_TIMES = 1.4
#: Impulses count from so many robust standard deviations of those of the log: ripple is no series of knocks.
_SDS = 6.0


def knock_width(n: int, settle_s: float, period_s: float) -> int:
    """Samples within which a knock of fewer than ``n`` samples lies once it has passed a kernel."""
    return max(n, ceil(_SETTLING_TIMES * settle_s / period_s - 1e-9))


def knocks(
    residual: FloatArray, evidence: BoolArray, gamma: Level, n: int, width: int, share: float
) -> list[tuple[Event, float]]:
    """Excursions within ``width`` samples whose impulse is at least ``share`` of gamma·n·T.

    Counted is what stands above the mean of the n samples before and the n samples after, and half as much of it above
    either: a torque that is there anyway, or that comes and stays, is no knock.

    Args:
        residual: (m,) N·m, through the detector's kernel.
        evidence: (m,) samples that may count; all of a knock and of the samples beside it must.
        gamma: threshold, N·m; one number, or (m,).
        n: persistence, samples.
        width: samples, of :func:`knock_width`.
        share: of the impulse gamma·n·T.

    Returns:
        Each excursion, with its impulse over gamma·n·T.
    """
    ratio = _impulse_ratio(residual, evidence, gamma, n, width)
    known = ratio[ratio > 0.0]
    if known.size == 0:
        return []
    starts, stops = run_bounds(ratio >= max(share, _SDS * SD_PER_MAD * median_of(known)))
    out: list[tuple[Event, float]] = []
    for a, b in zip(starts, stops, strict=True):
        best = int(a) + int(np.argmax(ratio[a:b]))
        out.append((_event(residual, best, width), float(ratio[best])))
    return out


def _impulse_ratio(residual: FloatArray, evidence: BoolArray, gamma: Level, n: int, width: int) -> FloatArray:
    """(m,) impulse of ``width`` samples from each on, over gamma·n·T; 0 where they, or those beside, do not count."""
    out = np.zeros(residual.size)
    count = residual.size - width - 2 * n + 1
    if count <= 0:
        return out
    usable, reach = evidence & np.isfinite(residual), width + 2 * n
    total = np.append(0.0, np.cumsum(np.where(usable, residual, 0.0)))
    lost = np.append(0, np.cumsum(~usable))
    level = gamma if isinstance(gamma, float) else gamma[n : n + count]
    counts = (lost[reach:] == lost[:-reach]) & np.greater(level, 0.0)
    with np.errstate(invalid="ignore", divide="ignore"):
        ratio = np.maximum(_impulse(total, n, width), 0.0) / (n * level)
    out[n : n + count] = np.where(counts, ratio, 0.0)
    return out


def _impulse(total: FloatArray, n: int, width: int) -> FloatArray:
    """(m,) impulse of ``width`` samples above those beside, from running sums (m + width + 2 n,)."""
    count = total.size - width - 2 * n
    start, stop = total[n : n + count], total[n + width : n + width + count]
    inside, before, after = stop - start, start - total[:count], total[width + 2 * n :] - stop
    sign = np.copysign(1.0, inside)  # a push downwards is turned up
    inside, before, after = sign * inside, sign * (before / n), sign * (after / n)
    middle, higher = np.maximum(0.5 * (before + after), 0.0), np.maximum(np.maximum(before, after), 0.0)
    return np.asarray(np.minimum(inside - width * middle, 2.0 * (inside - width * higher)))


def _event(residual: FloatArray, start: int, width: int) -> Event:
    """The part of an excursion that is at least half as high as its peak."""
    part = residual[start : start + width]
    size = np.abs(part)
    top = int(np.argmax(size))
    low = np.flatnonzero(size < 0.5 * size[top])
    first = int(low[low < top].max(initial=-1)) + 1
    last = int(low[low > top].min(initial=width))
    return Event(Span(start + first, start + last), start + last - 1, last - first, float(part[top]))
