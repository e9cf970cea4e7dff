"""Where in one series another is most alike: the place of a motion in a second recording."""

from __future__ import annotations

import numpy as np

from collaudit.core.numeric.arrays import BoolArray, FloatArray


def nearest_stretch(short: FloatArray, whole: FloatArray, allowed: BoolArray | None = None) -> tuple[int, float] | None:
    """The stretch of ``whole`` whose values differ least from ``short``, by the root of their mean squared distance.

    With Σ(w - s)² = Σw² - 2 Σ w s + Σs² it takes a convolution a column.

    Args:
        short: (m, j) values.
        whole: (n, j) values at the same steps; a stretch with NaN is none.
        allowed: (n - m + 1,) which starts count; None: all.

    Returns:
        Its first row and the distance; None where there is none.
    """
    length, count = short.shape[0], whole.shape[0] - short.shape[0] + 1
    if count < 1:
        return None
    missing = ~np.isfinite(whole)
    known = np.where(missing, 0.0, whole)
    squares = np.full(count, float(np.sum(short**2)))
    for own, other in zip(short.T, known.T, strict=True):
        squares += np.convolve(other**2, np.ones(length), "valid") - 2.0 * np.convolve(other, own[::-1], "valid")
    holes = np.convolve(missing.any(axis=1).astype(np.float64), np.ones(length), "valid") > 0.5
    squares[holes if allowed is None else holes | ~allowed] = np.inf
    best = int(np.argmin(squares))
    if not np.isfinite(squares[best]):
        return None
    return best, float(np.sqrt(max(squares[best], 0.0) / length))
