"""The 95 % band of a fitted friction curve."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from collaudit.core.data.friction_result import FrictionFit
from collaudit.core.friction.friction_model import FrictionModel
from collaudit.core.numeric.arrays import FloatArray

_LEVEL = 0.975
_STEP = 1e-4


def curve(law: FrictionModel, speed: FloatArray) -> FloatArray:
    """Friction in motion at speeds v ≥ 0; at 0 its limit from above."""
    return law.torque(np.maximum(speed, 1e-12))


def band(fit: FrictionFit, speed: FloatArray) -> tuple[FloatArray, FloatArray] | None:
    """Pointwise 95 % band of the curve, to first order in the parameters (delta method).

    sd(v)² = g(v)ᵀ Σ g(v) with g the gradient of the curve with respect to the parameters, times Student's t
    for the points left over (one fewer when directions share an offset, as they may in points that rest on
    the model's torque).

    Args:
        fit: the fit; its covariance is in the order of its parameters.
        speed: (n,) speeds, positive.

    Returns:
        Lower and upper edge (n,), or None when the fit has no curve or no covariance.
    """
    law = FrictionModel.of(fit)
    if law is None or fit.covariance is None:
        return None
    from scipy.special import stdtrit

    covariance = np.asarray(fit.covariance)
    gradient = np.stack([_slope(fit, name, speed) for name in fit.parameters], axis=1)
    variance = np.einsum("ni,ij,nj->n", gradient, covariance, gradient)
    shared_offset = any(point.source == "model" for point in fit.points)
    freedom = max(1, fit.n_points - len(fit.parameters) - shared_offset)
    half = float(stdtrit(freedom, _LEVEL)) * np.sqrt(np.maximum(variance, 0.0))
    middle = curve(law, speed)
    return middle - half, middle + half


def _slope(fit: FrictionFit, name: str, speed: FloatArray) -> FloatArray:
    """Derivative of the curve with respect to one parameter, by central differences: it holds for any law."""
    step = _STEP * max(abs(fit.parameters[name]), 1e-3)
    ends = []
    for value in (fit.parameters[name] + step, fit.parameters[name] - step):
        moved = FrictionModel.of(replace(fit, parameters={**fit.parameters, name: value}))
        assert moved is not None
        ends.append(curve(moved, speed))
    return np.asarray((ends[0] - ends[1]) / (2 * step))
