"""Fitting a law whose weights a ridge holds small, such as the data-driven one."""

from __future__ import annotations

import numpy as np

from collaudit.core.friction import least_squares as ls
from collaudit.core.friction.fit_quality import Quality
from collaudit.core.friction.law_candidates import Candidate
from collaudit.core.friction_laws.friction_law import RidgeLaw
from collaudit.core.numeric.arrays import FloatArray

_RIDGES = np.geomspace(1e-4, 1e6, 31)


def fit_ridge_law(data: ls.Points, law: RidgeLaw, ridge: float | None = None) -> Candidate:
    """Fit a ridge law; the ridge on its weights is the one with the smallest leave-one-out error.

    Leave-one-out errors of a ridge fit are r_i/(1 - h_ii) with h the hat matrix (Allen, Technometrics 16, 1974).

    Args:
        data: the points.
        law: the law.
        ridge: to use a ridge found before, as in fits with speeds held out.

    Returns:
        The fit; its parameter count is the trace of the hat matrix.
    """
    layout = law.layout(data.speed)
    columns = law.columns(data.speed, layout)
    design = data.columns(np.ones(data.n), data.speed, *columns.T)
    free, weights = 2, columns.shape[1]
    penalty = np.zeros(design.shape[1])
    penalty[free : free + weights] = 1.0
    tried = [float(r) for r in _RIDGES] if ridge is None else [ridge]
    errors = [_left_out(design, data.target, r * penalty) for r in tried]
    best = tried[int(np.argmin(errors))]
    gram = design.T @ design + np.diag(best * penalty)
    inverse = np.linalg.pinv(gram, hermitian=True)
    estimate = inverse @ design.T @ data.target
    rest = data.target - design @ estimate
    count = float(np.trace(inverse @ design.T @ design)) - (data.offset is not None)
    sum_squares = float(rest @ rest)
    quality = Quality.of(sum_squares, max(1, round(data.n - count)), data)
    fitted = ["A", "D", *(f"W{k}" for k in range(1, weights + 1))]
    k = len(fitted)
    values = dict(zip(fitted, (float(x) for x in estimate[:k]), strict=True)) | layout
    covariance = np.zeros((len(values), len(values)))
    covariance[:k, :k] = quality.scale * inverse[:k, :k]
    return Candidate(
        law=law,
        values=values,
        ci95=dict.fromkeys(values),
        covariance=covariance,
        predicted=law.curve(values, data.speed, data.direction),
        sum_squares=sum_squares,
        parameters=count,
        c_interval=(None, None),
        reasons=(),
        jacobian=None,
        ridge=best,
    )


def _left_out(design: FloatArray, target: FloatArray, penalty: FloatArray) -> float:
    inverse = np.linalg.pinv(design.T @ design + np.diag(penalty), hermitian=True)
    rest = target - design @ (inverse @ (design.T @ target))
    leverage = np.einsum("ni,ij,nj->n", design, inverse, design, optimize=True)
    return float(np.mean((rest / np.maximum(1.0 - leverage, 1e-6)) ** 2))
