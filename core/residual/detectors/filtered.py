"""Filtered dynamics: eq. (5) convolved with a second-order filter, no acceleration needed."""

from __future__ import annotations

from collaudit.core.config.schema import DetectConfig
from collaudit.core.numeric.kernel import butterworth
from collaudit.core.prepare.prepared import Prepared
from collaudit.core.residual.balance import balance_from_momentum
from collaudit.core.residual.detector import Detector
from collaudit.core.residual.residual import Residual, ResidualInputs, joint_residuals


def filtered_residual(prepared: Prepared, inputs: ResidualInputs, config: DetectConfig) -> Residual:
    """Residual of each joint through K²/(s² + √2 K s + K²), K the observer's gain.

    Args:
        prepared: the log.
        inputs: friction laws, joints that contradict the model.
        config: gain, causality, friction interval and level.
    """
    kernel = butterworth(config.observer_gain_per_s, config.causal)
    return joint_residuals(prepared, balance_from_momentum(prepared, kernel), inputs, config)


DETECTOR = Detector(
    name="filtered",
    equation="r = k * (tau - tau_s - f + C^T dq - G) - (dk/dt) * p, k the impulse response of "
    "K²/(s² + √2 K s + K²), * convolution",
    source="filtered dynamics (Hsu, Bodson, Sastry and Paden 1987)",
    residual=filtered_residual,
)
