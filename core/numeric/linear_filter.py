"""Recursive filters along rows, as ``scipy.signal.lfilter`` computes them."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np

from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.numeric.compiled_scipy import compiled_function


def linear_filter(b: FloatArray, a: FloatArray, x: FloatArray, state: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Run a recursive filter along the rows of an array: ``scipy.signal.lfilter`` with ``axis=-1`` and ``zi``.

    Args:
        b, a: (k,) numerator and (m,) denominator of a filter in z.
        x: (j, n) rows.
        state: (j, max(k, m) - 1) state before the first column.

    Returns:
        (j, n) result, and (j, max(k, m) - 1) state after the last column.
    """
    compiled = _compiled() if len(a) > 1 else None
    if compiled is None:
        from scipy.signal import lfilter

        result, after = lfilter(b, a, x, axis=-1, zi=state)
    else:
        result, after = compiled(b, a, x, -1, state)
    return np.asarray(result), np.asarray(after)


@functools.cache
def _compiled() -> Any | None:
    return compiled_function("signal/_sigtools", "_linear_filter", _agrees)


def _agrees(function: Any) -> bool:
    """Whether it computes y_k = sum of b_m x_(k-m) less the sum of a_m y_(k-m), m > 0, and carries its state on."""
    b, a, x = np.array([0.5, 0.25, -0.125]), np.array([1.0, -0.5, 0.25]), np.array([[1.0, -2.0, 3.0, 0.5, 4.0]])
    y = np.zeros(5)
    for k in range(5):
        y[k] = sum(b[m] * x[0, k - m] - (a[m] * y[k - m] if m else 0.0) for m in range(min(k, 2) + 1))
    first, state = function(b, a, x[:, :2].copy(), -1, np.zeros((1, 2)))
    second, _ = function(b, a, x[:, 2:].copy(), -1, state)
    return bool(np.array_equal(np.hstack([first, second])[0], y))
