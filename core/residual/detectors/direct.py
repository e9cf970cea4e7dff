"""The direct residual: eq. (5), its sides filtered alike."""

from __future__ import annotations

import math

from collaudit.core.config.schema import DetectConfig
from collaudit.core.numeric.kernel import BOTH_WAYS, Kernel, butterworth, double_pole
from collaudit.core.prepare.prepared import Prepared
from collaudit.core.residual.balance import balance_from_acceleration
from collaudit.core.residual.detector import Detector
from collaudit.core.residual.residual import Residual, ResidualInputs, joint_residuals


def direct_kernel(bandwidth_hz: float, causal: bool) -> Kernel:
    """Unit gain, -3 dB at ``bandwidth_hz``: a Butterworth filter, offline two passes of a double pole."""
    omega = 2.0 * math.pi * bandwidth_hz
    return butterworth(omega, True) if causal else double_pole(omega / BOTH_WAYS, False)


def direct_residual(prepared: Prepared, inputs: ResidualInputs, config: DetectConfig) -> Residual:
    """Residual of each joint, through a kernel as narrow as the filter of the signals.

    Args:
        prepared: the log.
        inputs: friction laws, joints that contradict the model.
        config: causality, friction interval and level.
    """
    kernel = direct_kernel(prepared.series.bandwidth_hz, config.causal)
    return joint_residuals(prepared, balance_from_acceleration(prepared, kernel), inputs, config)


DETECTOR = Detector(
    name="direct",
    equation="r = G(s) [tau - tau_s - (M ddq + C dq + f + G)], G as narrow as the filter of dq and ddq",
    source="inverse dynamics, both sides filtered alike",
    residual=direct_residual,
)
