"""The 95 % band of a fitted friction curve."""

from __future__ import annotations

import numpy as np

from collaudit.core.data.friction_result import FrictionFit
from collaudit.core.friction.friction_model import FrictionModel, half_width
from collaudit.core.numeric.arrays import FloatArray


def curve(law: FrictionModel, speed: FloatArray) -> FloatArray:
    """Friction in motion at speeds v ≥ 0; at 0 its limit from above."""
    return law.torque(np.maximum(speed, 1e-12))


def band(fit: FrictionFit, speed: FloatArray) -> tuple[FloatArray, FloatArray] | None:
    """Pointwise 95 % band of the curve, to first order in the parameters (delta method).

    Args:
        fit: the fit; its covariance is in the order of its parameters.
        speed: (n,) speeds, positive.

    Returns:
        Lower and upper edge (n,), or None when the fit has no curve or no covariance.
    """
    law = FrictionModel.of(fit)
    if law is None or law.spread is None:
        return None
    half = half_width(law, np.maximum(speed, 1e-12))
    middle = curve(law, speed)
    return middle - half, middle + half
