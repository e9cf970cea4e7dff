"""Constants and small estimators of statistics that several rooms use, each in one place.

The noise of a channel is told by how it bends from sample to sample: measured channels have one, computed ones do not.
"""

from __future__ import annotations

from dataclasses import dataclass

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
#: A signal whose steps are mostly below so many times its smaller ones is coarse.
_STEPS = 2.5
#: No sensor's noise is a smaller share of its range.
_MEASURED = 1e-6
#: Samples that a channel's noise is told from, drawn evenly.
_DRAWN = 100_000
#: Rounding of numbers that lie on a straight line, of the signal's range.
ROUNDING = 1e-9
#: Standard deviations of the second and fourth differences of white noise of 1, and the median of their sizes in them.
_SECOND, _FOURTH, _MEDIAN = 6.0**0.5, 70.0**0.5, 0.6745


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


@dataclass(frozen=True, slots=True)
class Noise:
    """The noise of a channel.

    Attributes:
        sd: standard deviation, as if it were white; of a smooth channel what is left beside its motion.
        resolution: smallest step between samples.
        range: from its smallest to its largest value.
        coarse: whether the channel mostly changes by the steps that it is written in.
    """

    sd: float
    resolution: float
    range: float
    coarse: bool

    @property
    def measured(self) -> bool:
        """Whether the channel has noise of a sensor's size: others were computed, or filtered very much."""
        return self.sd >= _MEASURED * self.range and self.sd > 0.0

    @property
    def varied(self) -> bool:
        """Whether it is measured, and its values seldom the same: they do not repeat by chance."""
        return self.measured and not self.coarse

    @property
    def tells(self) -> bool:
        """Whether it is measured, with noise above its resolution: less noise would show."""
        return self.measured and self.sd >= self.resolution


def bend_of(x: FloatArray) -> FloatArray:
    """(n,) size of x[i-1] - 2 x[i] + x[i+1]; NaN at both ends, and where a value is missing."""
    out = np.full(x.size, np.nan)
    if x.size > 2:
        out[1:-1] = np.abs(x[:-2] + x[2:] - x[1:-1] - x[1:-1])
    return out


def noise_of(x: FloatArray, bend: FloatArray, usual: BoolArray) -> Noise:
    """Noise of a channel: the smaller of what its second and its fourth differences show.

    Args:
        x, bend: (n,) channel and :func:`bend_of`.
        usual: (n,) rows at which it is told.
    """
    low, high = (float(f(x)) for f in (np.nanmin, np.nanmax))
    span = high - low if np.isfinite(high - low) else 0.0
    at = np.arange(2, x.size - 2, max(1, x.size // _DRAWN))
    steps = np.abs(x[at + 1] - x[at])
    steps = steps[np.isfinite(steps) & (steps > ROUNDING * span)]
    fourth = np.abs(x[at - 2] - 4.0 * x[at - 1] + 6.0 * x[at] - 4.0 * x[at + 1] + x[at + 2])
    sd = min(_typical(bend[at], usual[at]) / _SECOND, _typical(fourth, usual[at]) / _FOURTH)
    if steps.size < 2:
        return Noise(sd, np.inf, span, True)
    resolution = float(steps.min())
    coarse = sd < resolution or median_of(steps) < _STEPS * quantile_of(steps, 0.01)
    return Noise(sd, resolution, span, coarse)


def _typical(size: FloatArray, usual: BoolArray) -> float:
    known = size[usual & np.isfinite(size)]
    return median_of(known) / _MEDIAN if known.size else 0.0
