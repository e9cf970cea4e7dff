"""Filtered dynamics: eq. (5) convolved with a second-order filter, no acceleration needed."""

from __future__ import annotations

from collaudit.core.numeric.kernel import butterworth
from collaudit.core.residual.detector import Detector
from collaudit.core.residual.residual import momentum_residual

DETECTOR = Detector(
    name="filtered",
    equation="r = k * (tau - tau_s - f + C^T dq - G) - (dk/dt) * p, k the impulse response of "
    "K²/(s² + √2 K s + K²), * convolution",
    source="filtered dynamics (Hsu, Bodson, Sastry and Paden 1987)",
    residual=momentum_residual(butterworth),
)
