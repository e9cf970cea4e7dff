"""Linear smoothing kernels G(s) with unit gain: exact discretisation, delay, noise gain, use over stretches."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import scipy

from collaudit.core.numeric.arrays import BoolArray, FloatArray, Span, covered
from collaudit.core.numeric.filters import filtered

#: A sample more than this share of whose kernel weight is missing is missing itself.
_MISSING_SHARE = 0.05
#: Two passes of a double pole at w are down by 3 dB at this share of w: (1 + x²)² = sqrt(2).
BOTH_WAYS = math.sqrt(2.0**0.25 - 1.0)


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
