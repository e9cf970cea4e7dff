"""Constants and small estimators of statistics that several rooms use, each in one place."""

from __future__ import annotations

import numpy as np

from collaudit.core.numeric.arrays import BoolArray, FloatArray

#: Standard errors in half of a 95 % interval, rounded as usual: intervals in results are this wide.
STANDARD_ERRORS_95 = 1.96
#: The same as the quantile of the normal distribution at 97.5 %, to set against quantiles of Student's t.
NORMAL_QUANTILE_975 = 1.959964
#: Standard deviations of a normal distribution in one median absolute deviation: 1 / Φ⁻¹(3/4).
SD_PER_MAD = 1.4826
#: The same of white noise in medians of the size of its second differences, whose standard deviation is sqrt(6) of it.
NOISE_OF_BENDS = 1.0 / (6.0**0.5 * 0.6745)
#: Standard error of a median over that of a mean, of normal values: √(π / 2).
MEDIAN_SE = 1.2533
_FIRST = 4096


def interval_95(value: float, sd: float) -> tuple[float, float]:
    """The 95 % interval of an estimate with a standard error."""
    return float(value - STANDARD_ERRORS_95 * sd), float(value + STANDARD_ERRORS_95 * sd)


def robust_sd(deviation: FloatArray) -> float:
    """Standard deviation by the median absolute deviation; (n,) deviations from their centre, without NaN."""
    return SD_PER_MAD * median_of(np.abs(deviation))


def median_of(x: FloatArray) -> float:
    """Median of (n,) numbers, none of them NaN; NaN of none."""
    return float(np.median(x)) if x.size else float("nan")


def weighted_median(x: FloatArray, weight: FloatArray) -> float:
    """The number of (n,) at which the weights (n,), none negative, of those below reach half of all; n > 0."""
    return float(np.quantile(x, 0.5, method="inverted_cdf", weights=weight))


def quantile_of(x: FloatArray, share: float) -> float:
    """Quantile of (n,) numbers, n > 0, none of them NaN, at one share of them."""
    return float(np.quantile(x, share))


def smallest_step(x: FloatArray) -> float:
    """The smallest step that (n,) numbers are written in, NaN aside; 0 where they are all alike."""
    gaps = np.diff(np.unique(x[np.isfinite(x)]))
    gaps = gaps[gaps > 1e-9]
    return quantile_of(gaps, 0.05) if gaps.size else 0.0


def varies(x: FloatArray) -> BoolArray:
    """(j,) whether a column of (n, j) numbers has two that differ; NaN is none."""
    low, high = np.nanmin(x, axis=0, initial=np.inf), np.nanmax(x, axis=0, initial=-np.inf)
    return np.asarray(low < high)


def parabola_minimum(before: FloatArray, at: FloatArray, after: FloatArray) -> FloatArray:
    """Where the parabola through three values has its minimum, in steps from the middle one; 0 where it has none.

    Args:
        before, at, after: values one step before, at and after the middle, of any shape that they share.
    """
    bend = before - 2.0 * at + after
    return np.asarray(np.where(bend > 0, 0.5 * (before - after) / np.where(bend > 0, bend, 1.0), 0.0))


def few_values(x: FloatArray, most: int) -> FloatArray | None:
    """The different values of (n,) numbers, rising; None where they are more than so many, to 1e-9."""
    if np.unique(np.round(x[:_FIRST], 9)).size > most:  # that shows at once
        return None
    values = np.unique(np.round(x, 9))
    return values if values.size <= most else None
