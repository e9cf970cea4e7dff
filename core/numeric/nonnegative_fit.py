"""Least squares whose unknowns may not be negative, as ``scipy.optimize.nnls`` computes them."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np

from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.numeric.compiled_scipy import compiled_function

_STEPS_PER_UNKNOWN = 3  # as scipy.optimize.nnls allows


def nonnegative_fit(a: FloatArray, b: FloatArray) -> FloatArray:
    """(n,) x that makes \\|a x - b\\| smallest with no x below 0 (C. L. Lawson, R. J. Hanson).

    Args:
        a: (m, n) columns.
        b: (m,) right-hand side.

    Raises:
        RuntimeError: no solution after three steps an unknown.
    """
    compiled = _compiled()
    if compiled is None:
        from scipy.optimize import nnls

        return np.asarray(nnls(a, b)[0])
    a, b = (np.ascontiguousarray(x, dtype=np.float64) for x in (a, b))
    if not (np.isfinite(a).all() and np.isfinite(b).all()):
        raise ValueError("array must not contain infs or NaNs")
    x, _, outcome = compiled(a, b, _STEPS_PER_UNKNOWN * a.shape[1])
    if outcome == 3:
        raise RuntimeError("Maximum number of iterations reached.")
    return np.asarray(x)


@functools.cache
def _compiled() -> Any | None:
    return compiled_function("optimize/_slsqplib", "nnls", _agrees)


def _agrees(function: Any) -> bool:
    """Whether it finds the nearest non-negative point: (2, 0) for (2, -1)."""
    x, distance, outcome = function(np.eye(2), np.array([2.0, -1.0]), 6)
    return bool(np.array_equal(x, [2.0, 0.0])) and distance == 1.0 and outcome != 3
