"""Strokes in which a contact begins or ends, at speeds that the joint drives nowhere else.

A regression that meets a speed in one stroke only takes the torque of that stroke for friction at that speed. Where a
contact covers most of such a stroke, its short free rest lies far off instead, and the contact is kept. Two levels of
torque at one speed, and no other stroke that tells which of them is friction: both are left out.
"""

from __future__ import annotations

import numpy as np

from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray
from collaudit.core.numeric.blocks import blocks
from collaudit.core.numeric.runs import run_bounds, spread_over_unknown

#: Speeds in such neighbouring bands are alike: a ratio.
_ALIKE = 1.3
#: So long must other strokes have driven such speeds to tell friction at them, s.
_TOLD_S = 0.25


def untold_beside(rows: IntArray, speed: FloatArray, far: BoolArray, period_s: float, unknown_s: float) -> BoolArray:
    """(m,) samples that go on at the speed of far-off ones, where no other stroke drives it; the unknown beside them.

    Args:
        rows: (n,) samples at which the joint tells something, rising; a stroke is a run of them.
        speed: (n,) of the joint, positive.
        far: (m,) of all samples, those that lie far off in this joint.
        period_s: of the samples.
        unknown_s: samples at which the joint tells nothing go with them, where they adjoin and last no longer.
    """
    out = np.zeros(far.size, dtype=bool)
    stroke = np.cumsum(np.diff(rows, prepend=rows[:1]) > 1).astype(np.int64)
    off = far[rows]
    if not off.any():
        return out
    band = np.empty(speed.size, dtype=np.int64)
    for block in blocks(band.size):
        band[block] = np.floor(np.log(np.maximum(speed[block], 1e-9)) / np.log(_ALIKE))
    band -= band.min()
    bands = int(band.max()) + 3
    place = (stroke * bands + band + 1)[~off]
    size = (int(stroke[-1]) + 1) * bands
    told = np.bincount(place, np.full(place.size, period_s), size).reshape(-1, bands)
    told = told[:, :-2] + told[:, 1:-1] + told[:, 2:]
    elsewhere = told.sum(axis=0)[band] - told[stroke, band]
    lone = ~off & (elsewhere < _TOLD_S) & _going_on(stroke, speed, off)
    out[rows[lone]] = True
    known = np.zeros(far.size, dtype=bool)
    known[rows] = True
    return spread_over_unknown(out, known, round(unknown_s / period_s))


def _going_on(stroke: IntArray, speed: FloatArray, off: BoolArray) -> BoolArray:
    """(n,) samples from which a far-off one is reached within the stroke and without a change of speed."""
    out = np.zeros(off.size, dtype=bool)
    for a, b in zip(*run_bounds(off), strict=True):
        first, last = np.searchsorted(stroke, stroke[a], "left"), np.searchsorted(stroke, stroke[b - 1], "right")
        before, after = _alike(speed[first:a][::-1], speed[a]), _alike(speed[b:last], speed[b - 1])
        out[a - before : a] = True
        out[b : b + after] = True
    return out


def _alike(speed: FloatArray, start: float) -> int:
    """How many samples, from the first on, are as fast as this."""
    apart = np.abs(np.log(np.maximum(speed, 1e-9) / max(start, 1e-9))) > np.log(_ALIKE)
    return int(np.argmax(apart)) if apart.any() else speed.size
