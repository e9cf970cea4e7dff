"""The 95 % band of a fitted friction curve."""

from __future__ import annotations

import numpy as np

from collaudit.core.friction.model import FrictionModel
from collaudit.core.result import FrictionFit
from collaudit.core.series import FloatArray

_LEVEL = 0.975


def curve(law: FrictionModel, speed: FloatArray) -> FloatArray:
    """Friction in motion at speeds v ≥ 0; at 0 its limit from above, A + B."""
    return law.torque(np.maximum(speed, 1e-12))


def band(fit: FrictionFit, law: FrictionModel, speed: FloatArray) -> tuple[FloatArray, FloatArray] | None:
    """Pointwise 95 % band of the curve, to first order in the parameters (delta method).

    sd(v)² = g(v)ᵀ Σ g(v) with g the gradient of eq. (11) with respect to A, B, C, D, times Student's t for
    the points left over (one fewer when directions share an offset, as they may in points that rest on the
    model's torque).

    Args:
        fit: the fit; its covariance is in the order of its parameters.
        law: its curve.
        speed: (n,) speeds, positive.

    Returns:
        Lower and upper edge (n,), or None when the fit has no covariance.
    """
    if fit.covariance is None:
        return None
    from scipy.special import stdtrit

    decay = np.exp(-law.c * speed)
    gradient = {"A": np.ones_like(speed), "B": decay, "C": -law.b * speed * decay, "D": speed}
    columns = np.stack([gradient[name[0]] for name in fit.parameters], axis=1)
    variance = np.einsum("ni,ij,nj->n", columns, np.asarray(fit.covariance), columns)
    shared_offset = any(point.source == "model" for point in fit.points)
    freedom = max(1, fit.n_points - len(fit.parameters) - shared_offset)
    half = float(stdtrit(freedom, _LEVEL)) * np.sqrt(np.maximum(variance, 0.0))
    middle = curve(law, speed)
    return middle - half, middle + half
