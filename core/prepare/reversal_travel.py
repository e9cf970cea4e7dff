"""How far a joint has travelled since it last rested or reversed: over the first hundredth of a radian its gear turns.

Sections, coupled axes and the residual ask the same: what is not settled is no evidence for the friction of sliding.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from collaudit.core.numeric.arrays import BoolArray, FloatArray, Span, run_bounds

#: Travel until friction is steady, rad (m if prismatic): presliding of gears ends within a few thousandths of a radian.
REVERSAL_TRAVEL_RAD = 0.01


def settled(
    segments: Sequence[Span], position: FloatArray, velocity: FloatArray, rest_rad_s: float
) -> tuple[BoolArray, FloatArray]:
    """(n,) whether a joint moves and has travelled far enough, and its way since it last rested or reversed.

    Both also count from the start of a stretch.

    Args:
        segments: stretches without a gap.
        position, velocity: (n,) of the joint, or of an axis that several turn.
        rest_rad_s: speed below which it rests.
    """
    steady, travel = np.zeros(velocity.size, dtype=np.bool_), np.zeros(velocity.size)
    for segment in segments:
        if len(segment) == 0:
            continue
        s = segment.slice
        direction = np.sign(_last_known(velocity[s]))  # an unknown velocity is no reversal, and hides none
        place = _last_known(position[s])
        resting = np.abs(velocity[s]) < rest_rad_s  # an unknown velocity does not rest
        starts = np.flatnonzero(resting | np.concatenate(([True], direction[1:] * direction[:-1] < 0)))
        travel[s] = np.nan_to_num(np.abs(place - np.repeat(place[starts], np.diff(starts, append=place.size))))
        steady[s] = (travel[s] >= REVERSAL_TRAVEL_RAD) & ~resting
    return steady, travel


def sliding(
    segments: Sequence[Span], position: FloatArray, velocity: FloatArray, rest_rad_s: float, margin: int
) -> BoolArray:
    """(n,) whether friction slides: a joint is settled, and will travel as far, for ``margin`` samples to either side.

    Friction that still turns about comes later than the motion, as does an effort that is stamped late. Of a stroke as
    much is left out at its end as at its beginning: else what the model lacks would look early.

    Args:
        segments, position, velocity, rest_rad_s: as of :func:`settled`.
        margin: samples.
    """
    back = [Span(velocity.size - span.stop, velocity.size - span.start) for span in reversed(segments)]
    moves = settled(segments, position, velocity, rest_rad_s)[0]
    moves &= settled(back, position[::-1], velocity[::-1], rest_rad_s)[0][::-1]
    return one_way(np.where(moves, velocity, 0.0), 0.0, margin)


def one_way(velocity: FloatArray, rest_rad_s: float, margin: int) -> BoolArray:
    """(n,) whether a joint moves one way, faster than it rests, for ``margin`` samples before and after."""
    out = np.zeros(velocity.size, dtype=np.bool_)
    for mask in (velocity > rest_rad_s, velocity < -rest_rad_s):
        for start, stop in zip(*run_bounds(mask), strict=True):
            out[start + margin : max(start + margin, stop - margin)] = True
    return out


def _last_known(x: FloatArray) -> FloatArray:
    """(n,) values with what is unknown replaced by the last known value before it."""
    if np.isfinite(x.sum()):
        return x
    known = np.isfinite(x)
    return np.asarray(x[np.maximum.accumulate(np.where(known, np.arange(x.size), 0))])
