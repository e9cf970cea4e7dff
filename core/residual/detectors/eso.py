"""The linear extended state observer in the momentum."""

from __future__ import annotations

from collaudit.core.numeric.kernel import double_pole
from collaudit.core.residual.detector import Detector
from collaudit.core.residual.residual import momentum_residual

DETECTOR = Detector(
    name="eso",
    equation="dp^/dt = u + d^ + 2K (p - p^), d(d^)/dt = K² (p - p^), r = -d^, so r = K²/(s + K)² tau_e",
    source="linear extended state observer in the momentum, both poles at -K (Han 2009)",
    residual=momentum_residual(double_pole),
)
