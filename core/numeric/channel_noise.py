"""The noise of a channel, by how it bends from sample to sample: measured channels have one, computed ones do not."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from collaudit.core.numeric.arrays import BoolArray, FloatArray
from collaudit.core.numeric.stats import median_of, quantile_of

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
