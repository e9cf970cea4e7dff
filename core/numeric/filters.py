"""Filters over gap-free stretches, and linear smoothing kernels G(s) with unit gain: discretisation, delay, noise gain.

SciPy loads ``scipy.signal`` at the first one.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import scipy

from collaudit.core.numeric.arrays import BoolArray, FloatArray, Span, covered
from collaudit.core.numeric.parallel import each

#: Two passes of a second-order Butterworth filter shift its -3 dB point by (sqrt(2) - 1)^(1/4).
_TWO_PASS = (math.sqrt(2.0) - 1.0) ** 0.25
#: tan(π f T) of a corner at 0.95 of the Nyquist frequency: above it there is nothing to remove.
_NOTHING_ABOVE = math.tan(0.475 * math.pi)
#: Periods of the -3 dB frequency after which the filter's response to an impulse is below 1e-14 of its peak.
_REACH_PERIODS = 10.0
#: Standard deviations of a Gaussian window after which nothing is left.
_WINDOW_REACH = 4.0
#: A sample more than this share of whose kernel weight is missing is missing itself.
_MISSING_SHARE = 0.05
#: Two passes of a double pole at w are down by 3 dB at this share of w: (1 + x²)² = sqrt(2).
BOTH_WAYS = math.sqrt(2.0**0.25 - 1.0)


def default_bandwidth_hz(period_s: float) -> float:
    """20 Hz, or a fifth of the sample rate where that is lower.

    20 Hz keeps contacts of 25 ms (an impulse is widened to about 22 ms) and holds the noise of a
    differentiated 500 Hz velocity below 0.5 rad/s².
    """
    return min(20.0, 0.2 / period_s)


def low_pass(x: FloatArray, segments: Sequence[Span], period_s: float, bandwidth_hz: float) -> FloatArray:
    """Low-pass each stretch without delay: a second-order Butterworth filter forward and backward.

    Both passes together have the gain 1 / (1 + (tan(π f T) / tan(π f_c T))⁴), with f_c where one of them is at -3 dB.
    Each stretch is continued by its point reflection at both ends, until nothing is left of how the recursion begins.

    Args:
        x: (n,) or (n, j); NaN inside a stretch is bridged for the filter and stays NaN in the result.
        segments: gap-free stretches; outside them the result is NaN.
        period_s: sample period, s.
        bandwidth_hz: -3 dB frequency of both passes together, Hz.
    """
    corner = math.tan(min(math.pi * bandwidth_hz * period_s, 1.5)) / _TWO_PASS  # tan(π f_c T)
    if corner >= _NOTHING_ABOVE:
        return by_stretch(x, segments, lambda part: part)
    b, a = scipy.signal.butter(2, 2.0 / math.pi * math.atan(corner))
    reach = math.ceil(_REACH_PERIODS / (bandwidth_hz * period_s))

    def smooth(part: FloatArray) -> FloatArray:
        continued = np.pad(_bridged(part), reach, mode="reflect", reflect_type="odd")
        out = scipy.signal.filtfilt(b, a, continued, padlen=0)[reach:-reach]
        return np.where(np.isfinite(part), out, np.nan)

    return by_stretch(x, segments, smooth)


def window_reach(deviation: float) -> int:
    """Samples to either side that a Gaussian window with this standard deviation, in samples, reaches."""
    return math.ceil(_WINDOW_REACH * deviation)


def gaussian_smoothed(x: FloatArray, deviation: float) -> FloatArray:
    """(n,) smoothed by a Gaussian window, as if the first and last value had lasted.

    Args:
        x: (n,) values.
        deviation: standard deviation of the window, samples; 0 changes nothing.
    """
    if deviation == 0.0:
        return x
    reach = window_reach(deviation)
    weight = np.exp(-0.5 * np.square(np.arange(-reach, reach + 1) / deviation))
    lasting = np.concatenate([np.full(reach, x[0]), x, np.full(reach, x[-1])])
    return np.convolve(lasting, weight / weight.sum(), mode="valid")


def differentiate(x: FloatArray, segments: Sequence[Span], period_s: float) -> FloatArray:
    """Central differences of (n,) or (n, j) inside each stretch, one-sided at its ends, NaN outside."""
    return by_stretch(x, segments, lambda part: np.gradient(part, period_s) if part.size > 1 else np.full(1, np.nan))


def filtered(b: FloatArray, a: FloatArray, x: FloatArray, segments: Sequence[Span], *, both_ways: bool) -> FloatArray:
    """Run a recursive filter over each stretch, starting settled at its first value.

    Args:
        b, a: numerator and denominator of a filter in z.
        x: (n, j); values that are not finite inside a stretch are bridged by straight lines.
        segments: gap-free stretches.
        both_ways: forward and then backward, without delay (``scipy.signal.filtfilt``); else forward only.

    Returns:
        (n, j) result, NaN outside the stretches.
    """
    settled = scipy.signal.lfilter_zi(b, a)

    def run(part: FloatArray) -> FloatArray:
        whole = _bridged(part)
        if both_ways:
            return np.asarray(scipy.signal.filtfilt(b, a, whole, padlen=0))
        return np.asarray(scipy.signal.lfilter(b, a, whole, zi=settled * whole[0])[0])

    return by_stretch(x, segments, run)


def by_stretch(x: FloatArray, segments: Sequence[Span], run: Callable[[FloatArray], FloatArray]) -> FloatArray:
    """(n,) or (n, j) what ``run`` makes of each stretch of each column; NaN outside the stretches."""
    out = np.full(x.shape, np.nan, order="F")
    results, columns = np.atleast_2d(out.T), np.atleast_2d(x.T)

    def one(c: int) -> None:
        for span in segments:
            if len(span):
                results[c, span.slice] = run(columns[c, span.slice])

    each(one, range(len(columns)))
    return out


def _bridged(part: FloatArray) -> FloatArray:
    """A stretch (m,) with missing values on straight lines between their neighbours; zeros where all are missing."""
    known = np.flatnonzero(np.isfinite(part))
    if known.size == part.size:
        return part
    return np.interp(np.arange(part.size), known, part[known]) if known.size else np.zeros(part.size)


@dataclass(frozen=True, slots=True)
class Kernel:
    """A low-pass G(s) = d0 / (… + d1 s + d0), with G(0) = 1.

    Attributes:
        denominator: coefficients in falling powers of s: …, d1, d0.
        causal: run forward only, with its delay; else forward and backward, without one.
    """

    denominator: tuple[float, ...]
    causal: bool

    @property
    def delay_s(self) -> float:
        """Group delay at zero frequency, s: d1 / d0; 0 when run both ways."""
        return self.denominator[-2] / self.denominator[-1] if self.causal else 0.0

    @property
    def settle_s(self) -> float:
        """Time after which the start of a stretch weighs less than about 5 %, s."""
        return 3.0 * self.denominator[-2] / self.denominator[-1]

    def noise_gain(self, period_s: float) -> float:
        """Standard deviation of the output for white noise of one at the input, sampled every ``period_s``."""
        pulse, _ = self.push_response(1, period_s, settled=8.0)
        return float(np.sqrt(np.sum(pulse**2)))

    def push_response(self, samples: int, period_s: float, settled: float = 4.0) -> tuple[FloatArray, int]:
        """(w,) what passes of a rectangular push of height 1 and so many samples, and at which of them it begins.

        Before and after the push the kernel has ``settled`` times its settling time.
        """
        around = max(16, math.ceil(settled * self.settle_s / period_s))
        push = np.zeros((samples + 2 * around, 1))
        push[around : around + samples] = 1.0
        return self.apply(push, [Span(0, len(push))], period_s)[:, 0], around

    def apply(self, x: FloatArray, segments: Sequence[Span], period_s: float) -> FloatArray:
        """Smooth each stretch, starting settled at its first value.

        Args:
            x: (n, j); NaN inside a stretch is bridged, and is NaN where it weighs more than 5 %.
            segments: gap-free stretches; outside them the result is NaN.
            period_s: sample period, s.
        """
        return self._known(self.denominator[-1:], x, segments, period_s)

    def slope(self, x: FloatArray, segments: Sequence[Span], period_s: float) -> FloatArray:
        """The smoothed time derivative s·G(s) x without differentiating: what needs no acceleration.

        Raises:
            ValueError: the kernel is not causal, where this is not a filter of its own.
        """
        if not self.causal:
            raise ValueError("a smoothed derivative needs a causal kernel")
        return self._known((self.denominator[-1], 0.0), x, segments, period_s)

    def _known(
        self, numerator: tuple[float, ...], x: FloatArray, segments: Sequence[Span], period_s: float
    ) -> FloatArray:
        """Filtered; missing where the missing values weigh too much."""
        out = self._filtered(numerator, x, segments, period_s)
        missing = ~np.isfinite(x) & covered(segments, len(x))[:, None]
        out[self.reach(missing, segments, period_s)] = np.nan
        return out

    def _filtered(
        self, numerator: tuple[float, ...], x: FloatArray, segments: Sequence[Span], period_s: float
    ) -> FloatArray:
        held = _held(numerator, self.denominator, period_s)
        return filtered(*held, x, segments, both_ways=not self.causal)

    def reach(self, mask: BoolArray, segments: Sequence[Span], period_s: float) -> BoolArray:
        """(n, j) samples in whose kernel the marked samples weigh more than 5 %."""
        if not mask.any():
            return mask
        weight = self._filtered(self.denominator[-1:], mask.astype(np.float64), segments, period_s)
        return np.asarray(mask | (np.abs(weight) > _MISSING_SHARE))  # NaN outside the stretches is not


@lru_cache(maxsize=64)
def _held(
    numerator: tuple[float, ...], denominator: tuple[float, ...], period_s: float
) -> tuple[FloatArray, FloatArray]:
    """Coefficients in z, exact for inputs that are straight between samples (first-order hold); asked for often."""
    b, a, _ = scipy.signal.cont2discrete((np.array(numerator), np.array(denominator)), period_s, method="foh")
    b = b[0]
    b.flags.writeable = a.flags.writeable = False
    return b, a


def first_order(gain_per_s: float, causal: bool) -> Kernel:
    """K / (s + K)."""
    return Kernel((1.0, gain_per_s), causal)


def butterworth(omega_per_s: float, causal: bool) -> Kernel:
    """w² / (s² + sqrt(2) w s + w²)."""
    return Kernel((1.0, math.sqrt(2.0) * omega_per_s, omega_per_s**2), causal)


def double_pole(omega_per_s: float, causal: bool) -> Kernel:
    """w² / (s + w)²."""
    return Kernel((1.0, 2.0 * omega_per_s, omega_per_s**2), causal)
