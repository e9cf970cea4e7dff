"""Straight lines between the samples of several columns at once, with the digits of ``numpy.interp``.

Between which samples a place lies is found once for all columns, and mostly without a search: two clocks of the same
rate go on side by side.
"""

from __future__ import annotations

import numpy as np

from collaudit.core.numeric.arrays import FloatArray, IntArray
from collaudit.core.numeric.parallel import ordered_map
from collaudit.core.numeric.tables import blocks, table

#: Places at a time, of several columns.
_AT_ONCE = 1 << 18


def interpolated(x: FloatArray, at: FloatArray, values: FloatArray) -> FloatArray:
    """The columns of ``values`` at other places; before the first and after the last sample its value.

    Args:
        x: (m,) places in ascending order.
        at: (n,) places of the samples in ascending order.
        values: (n, c); where a neighbour is not finite, what ``numpy.interp`` gives.

    Returns:
        (m, c).
    """
    out = table(x.size, values.shape[1])
    if x.size == 0:
        return out
    first, last = np.searchsorted(x, (at[0], at[-1]))
    out[:first], out[last:] = values[0], values[-1]
    inside, between = x[first:last], out[first:last]
    for _ in ordered_map(
        lambda block: _fill(inside[block], at, values, between[block]), list(blocks(inside.size, _AT_ONCE))
    ):
        pass
    return out


def _fill(x: FloatArray, at: FloatArray, values: FloatArray, out: FloatArray) -> None:
    """Fill (m, c) of one block, all of it between the first and the last sample."""
    before, last = np.searchsorted(at, (x[0], x[-1]), "right") - 1
    near = slice(before, last + 2)  # samples around this block
    at, values = at[near], values[near]
    left = _left(x, at)
    behind, width = x - at[left], np.diff(at)
    exact = behind == 0.0
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        for column, it in zip(values.T, out.T, strict=True):
            slope = np.subtract(column[1:], column[:-1])
            slope /= width
            np.multiply(slope[left], behind, out=it)
            it += column[left]
            np.copyto(it, column[left], where=exact)
            if not np.isfinite(it.sum()):
                it[:] = np.interp(x, at, column)


def _left(x: FloatArray, at: FloatArray) -> slice | IntArray:
    """(m,) the last sample that is not beyond each place; of two clocks side by side a slice.

    Args:
        x: (m,) places, the first of them not before the first sample and before the second.
        at: (k,) the samples around them.
    """
    if x.size < at.size and (at[: x.size] <= x).all() and (x < at[1 : x.size + 1]).all():
        return slice(0, x.size)
    return np.searchsorted(at, x, "right") - 1
