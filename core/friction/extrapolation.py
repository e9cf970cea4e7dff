"""What a friction curve may be wrong by above the fastest speed it was measured at."""

from __future__ import annotations

import numpy as np

from collaudit.core.friction.friction_model import FrictionModel
from collaudit.core.friction_laws.law_registry import law_named
from collaudit.core.numeric.arrays import BoolArray, FloatArray
from collaudit.core.numeric.stats import STANDARD_ERRORS_95, median_of, robust_sd

_STEP = 1e-4
#: Time, s, and strokes that tell how friction goes on above the fastest fitted speed.
_TOLD_S, _TOLD_STROKES = 2.0, 4


def extrapolation_doubt(law: FrictionModel, velocity: FloatArray) -> FloatArray:
    """(n,) half width of the 95 % interval of friction above the fastest fitted speed, N·m; 0 up to that speed.

    Two parts are added. Friction's growth beyond the range, |f(v) - f(v_max)|: no point says whether it goes on as the
    curve has it, stays, or doubles. And what the curve's own interval (first order in the parameters) grows by.

    Args:
        law: the fitted law.
        velocity: (n,) of the joint.
    """
    out = np.zeros(velocity.shape)
    fastest = law.speed_range[1]
    with np.errstate(invalid="ignore"):
        rows = np.flatnonzero(np.abs(velocity) > fastest)
    if rows.size == 0:
        return out
    v = velocity[rows]
    edge = fastest * np.sign(v)
    growth = np.abs(law.torque(v) - law.torque(edge))
    out[rows] = growth + np.maximum(half_width(law, v) - half_width(law, edge), 0.0)
    return out


def scatter_beyond(
    law: FrictionModel, velocity: FloatArray, residual_nm: FloatArray, counts: BoolArray, period_s: float
) -> float:
    """What friction above the fastest fitted speed is off by in a log (95 %), N·m, from the bulk of its residual there.

    The median of the residual along the motion is the error of the extrapolated curve, its spread what varies. Less
    than half of the time that counts may be contact. Infinite where a few strokes, or little time, would have to tell.

    Args:
        law: the fitted law.
        velocity, residual_nm: (n,) of the joint.
        counts: (n,) samples that tell something.
        period_s: sample period, s.
    """
    with np.errstate(invalid="ignore"):
        beyond = np.abs(velocity) > law.speed_range[1]
    rows = np.flatnonzero(beyond & counts & np.isfinite(residual_nm))
    strokes = np.count_nonzero(np.diff(rows) > 1) + 1
    if rows.size * period_s < _TOLD_S or strokes < _TOLD_STROKES:
        return float("inf")
    along = residual_nm[rows] * np.sign(velocity[rows])
    middle = median_of(along)
    return abs(middle) + STANDARD_ERRORS_95 * robust_sd(along - middle)


def half_width(law: FrictionModel, velocity: FloatArray) -> FloatArray:
    """(n,) half width of the curve's 95 % interval by the delta method; 0 where the fit has no covariance.

    sd(v)² = g(v)ᵀ Σ g(v) with g the gradient of the curve with respect to the parameters, times Student's t
    for the points left over (one fewer when directions share an offset, as they may in points that rely on
    the robot model).
    """
    spread = law.spread
    if spread is None or spread.covariance.shape[0] != len(law.values):
        return np.zeros(velocity.shape)
    speed, direction, curve = np.abs(velocity), np.sign(velocity), law_named(law.name).curve
    gradient = np.empty((velocity.size, len(law.values)))
    for k, (symbol, value) in enumerate(law.values.items()):
        step = _STEP * max(abs(value), 1e-3)
        ends = [curve({**law.values, symbol: value + sign * step}, speed, direction) for sign in (1.0, -1.0)]
        gradient[:, k] = (ends[0] - ends[1]) / (2.0 * step)
    variance = np.einsum("ni,ij,nj->n", gradient, spread.covariance, gradient)
    return np.asarray(spread.t * np.sqrt(np.maximum(variance, 0.0)))
