"""The generalized-momentum observer."""

from __future__ import annotations

from collaudit.core.config.schema import DetectConfig
from collaudit.core.numeric.kernel import first_order
from collaudit.core.prepare.prepared import Prepared
from collaudit.core.residual.balance import balance_from_momentum
from collaudit.core.residual.detector import Detector
from collaudit.core.residual.residual import Residual, ResidualInputs, joint_residuals


def momentum_residual(prepared: Prepared, inputs: ResidualInputs, config: DetectConfig) -> Residual:
    """Residual of each joint through K/(s + K), K the observer's gain.

    Args:
        prepared: the log.
        inputs: friction laws, joints that contradict the model.
        config: gain, causality, friction interval and level.
    """
    kernel = first_order(config.observer_gain_per_s, config.causal)
    return joint_residuals(prepared, balance_from_momentum(prepared, kernel), inputs, config)


DETECTOR = Detector(
    name="momentum",
    equation="r = K [p - ∫(tau - tau_s - f + C^T dq - G - r) dt], so r = K/(s + K) tau_e",
    source="generalized-momentum observer (De Luca and Mattone 2003; Haddadin, De Luca and Albu-Schäffer 2017)",
    residual=momentum_residual,
)
