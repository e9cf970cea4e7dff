"""The linear extended state observer in the momentum."""

from __future__ import annotations

from collaudit.core.config.schema import DetectConfig
from collaudit.core.numeric.kernel import double_pole
from collaudit.core.prepare.prepared import Prepared
from collaudit.core.residual.balance import balance_from_momentum
from collaudit.core.residual.detector import Detector
from collaudit.core.residual.residual import Residual, ResidualInputs, joint_residuals


def eso_residual(prepared: Prepared, inputs: ResidualInputs, config: DetectConfig) -> Residual:
    """Residual of each joint through K²/(s + K)², K the observer's gain.

    Args:
        prepared: the log.
        inputs: friction laws, joints that contradict the model.
        config: gain, causality, friction interval and level.
    """
    kernel = double_pole(config.observer_gain_per_s, config.causal)
    return joint_residuals(prepared, balance_from_momentum(prepared, kernel), inputs, config)


DETECTOR = Detector(
    name="eso",
    equation="dp^/dt = u + d^ + 2K (p - p^), d(d^)/dt = K² (p - p^), r = -d^, so r = K²/(s + K)² tau_e",
    source="linear extended state observer in the momentum, both poles at -K (Han 2009)",
    residual=eso_residual,
)
