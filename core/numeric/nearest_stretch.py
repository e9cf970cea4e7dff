"""Where in one series another is most alike: the place of a motion in a second recording."""

from __future__ import annotations

import numpy as np

from collaudit.core.numeric.arrays import BoolArray, FloatArray


def stretch_distances(short: FloatArray, whole: FloatArray) -> FloatArray:
    """(n - m + 1,) how far each stretch of ``whole`` is from ``short``: the root of their mean squared distance.

    With Σ(w - s)² = Σw² - 2 Σ w s + Σs² it takes a convolution a column.

    Args:
        short: (m, j) values.
        whole: (n, j) values at the same steps, n >= m; a stretch with NaN is infinitely far.
    """
    length = short.shape[0]
    missing = ~np.isfinite(whole)
    known = np.where(missing, 0.0, whole)
    squares = np.full(whole.shape[0] - length + 1, float(np.sum(short**2)))
    for own, other in zip(short.T, known.T, strict=True):
        squares += np.convolve(other**2, np.ones(length), "valid") - 2.0 * np.convolve(other, own[::-1], "valid")
    holes = np.convolve(missing.any(axis=1).astype(np.float64), np.ones(length), "valid") > 0.5
    squares[holes] = np.inf
    return np.asarray(np.sqrt(np.maximum(squares, 0.0) / length))


def nearest_stretch(short: FloatArray, whole: FloatArray, allowed: BoolArray | None = None) -> tuple[int, float] | None:
    """The stretch of ``whole`` whose values differ least from ``short``.

    Args:
        short, whole: as of :func:`stretch_distances`.
        allowed: (n - m + 1,) which starts count; None: all.

    Returns:
        Its first row and the distance; None where there is none.
    """
    if whole.shape[0] < short.shape[0]:
        return None
    distance = stretch_distances(short, whole)
    if allowed is not None:
        distance[~allowed] = np.inf
    best = int(np.argmin(distance))
    return (best, float(distance[best])) if np.isfinite(distance[best]) else None
