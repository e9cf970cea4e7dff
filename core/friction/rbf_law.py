"""The data-driven law: Coulomb + viscous and Gaussian bumps over the logarithm of speed, ridge-regularised."""

from __future__ import annotations

import numpy as np

from collaudit.core.friction import least_squares as ls
from collaudit.core.friction.fit_quality import Quality
from collaudit.core.friction.friction_laws import RBF, rbf_columns, rbf_curve
from collaudit.core.friction.law_candidates import Candidate
from collaudit.core.numeric.arrays import FloatArray

_MOST_CENTRES = 8
_RIDGES = np.geomspace(1e-4, 1e6, 31)


def fit_rbf(data: ls.Points, ridge: float | None = None) -> tuple[Candidate, float]:
    """Fit the data-driven law; the ridge on its weights is the one with the smallest leave-one-out error.

    Leave-one-out errors of a ridge fit are r_i/(1 - h_ii) with h the hat matrix (Allen, Technometrics 16, 1974).

    Args:
        data: the points.
        ridge: to use a ridge found before, as in fits with speeds held out.

    Returns:
        The fit (its parameter count is the trace of the hat matrix) and the ridge.
    """
    centres = np.geomspace(data.speed.min(), data.speed.max(), max(3, min(_MOST_CENTRES, data.n // 3)))
    width = float(np.log(centres[1] / centres[0]))
    bumps = rbf_columns(data.speed, centres, width)
    design = data.columns(np.ones(data.n), data.speed, *bumps.T)
    penalty = np.zeros(design.shape[1])
    penalty[2 : 2 + centres.size] = 1.0
    tried = [float(r) for r in _RIDGES] if ridge is None else [ridge]
    errors = [_left_out(design, data.target, r * penalty) for r in tried]
    best = tried[int(np.argmin(errors))]
    gram = design.T @ design + np.diag(best * penalty)
    inverse = np.linalg.pinv(gram, hermitian=True)
    estimate = inverse @ design.T @ data.target
    rest = data.target - design @ estimate
    count = float(np.trace(inverse @ design.T @ design)) - (data.offset is not None)
    sum_squares = float(rest @ rest)
    quality = Quality.of(sum_squares, max(1, round(data.n - count)))
    values = _values(estimate, centres, width)
    fitted = [s for s in values if s in ("A", "D") or s.startswith("W")]
    order = list(values)
    covariance = np.zeros((len(order), len(order)))
    rows = [order.index(s) for s in fitted]
    k = len(fitted)
    covariance[np.ix_(rows, rows)] = quality.scale * inverse[:k, :k]
    candidate = Candidate(
        model=RBF,
        values=values,
        ci95=dict.fromkeys(order),
        covariance=covariance,
        predicted=rbf_curve(values, data.speed),
        sum_squares=sum_squares,
        parameters=count,
        c_interval=(None, None),
        reasons=(),
        jacobian=None,
    )
    return candidate, best


def _values(estimate: FloatArray, centres: FloatArray, width: float) -> dict[str, float]:
    values = {"A": float(estimate[0]), "D": float(estimate[1])}
    values |= {f"W{k}": float(w) for k, w in enumerate(estimate[2 : 2 + centres.size], 1)}
    values |= {f"v{k}": float(v) for k, v in enumerate(centres, 1)}
    return values | {"w": width}


def _left_out(design: FloatArray, target: FloatArray, penalty: FloatArray) -> float:
    inverse = np.linalg.pinv(design.T @ design + np.diag(penalty), hermitian=True)
    rest = target - design @ (inverse @ (design.T @ target))
    leverage = np.einsum("ni,ij,nj->n", design, inverse, design, optimize=True)
    return float(np.mean((rest / np.maximum(1.0 - leverage, 1e-6)) ** 2))
