"""The generalized-momentum observer."""

from __future__ import annotations

from collaudit.core.numeric.kernel import first_order
from collaudit.core.residual.detector import Detector
from collaudit.core.residual.residual import momentum_residual

DETECTOR = Detector(
    name="momentum",
    equation="r = K [p - ∫(tau - tau_s - f + C^T dq - G - r) dt], so r = K/(s + K) tau_e",
    source="generalized-momentum observer (De Luca and Mattone 2003; Haddadin, De Luca and Albu-Schäffer 2017)",
    residual=momentum_residual(first_order),
)
