"""Constants and small estimators of statistics that several rooms use, each in one place."""

from __future__ import annotations

import numpy as np

from collaudit.core.numeric.arrays import FloatArray

#: Standard errors in half of a 95 % interval, rounded as usual: intervals in results are this wide.
STANDARD_ERRORS_95 = 1.96
#: The same as the quantile of the normal distribution at 97.5 %, to set against quantiles of Student's t.
NORMAL_QUANTILE_975 = 1.959964
#: Standard deviations of a normal distribution in one median absolute deviation: 1 / Φ⁻¹(3/4).
SD_PER_MAD = 1.4826
#: Standard error of a median over that of a mean, of many normal values: sqrt(π/2).
MEDIAN_INEFFICIENCY = 1.2533
#: Huber's bound in standard deviations: 95 % of the efficiency of least squares on normal errors.
HUBER_BOUND = 1.345


def robust_sd(deviation: FloatArray) -> float:
    """Standard deviation by the median absolute deviation; (n,) deviations from their centre, without NaN."""
    return SD_PER_MAD * median_of(np.abs(deviation))


def median_of(x: FloatArray) -> float:
    """``np.median`` of (n,) numbers, none of them NaN; their order is lost.

    NumPy partitions at three places, which takes three times as long as at one.
    """
    if x.size == 0:
        return float("nan")
    low, high = _in_order(x, (x.size - 1) // 2)
    return low if x.size % 2 else 0.5 * (low + high)


def quantile_of(x: FloatArray, share: float) -> float:
    """``np.quantile`` of (n,) numbers, n > 0, none of them NaN, at one share of them; their order is lost."""
    place = (x.size - 1) * share
    low, high = _in_order(x, int(place))
    part, gap = place - int(place), high - low
    return low + gap * part if part < 0.5 else high - gap * (1.0 - part)  # NumPy's order of operations


def _in_order(x: FloatArray, place: int) -> tuple[float, float]:
    """The values at a place and at the next in rising order; the last one twice."""
    x.partition(place)
    low = float(x[place])
    return low, float(x[place + 1 :].min()) if place + 1 < x.size else low


def parabola_minimum(before: FloatArray, at: FloatArray, after: FloatArray) -> FloatArray:
    """Where the parabola through three values has its minimum, in steps from the middle one; 0 where it has none.

    Args:
        before, at, after: values one step before, at and after the middle, of any shape that they share.
    """
    bend = before - 2.0 * at + after
    return np.asarray(np.where(bend > 0, 0.5 * (before - after) / np.where(bend > 0, bend, 1.0), 0.0))
