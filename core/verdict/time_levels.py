"""Shares and stretches of a log's time, by moments spread over it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from collaudit.core.numeric.arrays import BoolArray, FloatArray
from collaudit.core.numeric.runs import run_bounds


def level_at(known: FloatArray, count: float, shares: Sequence[float]) -> list[float | None]:
    """The smallest of the known values that a share of all ``count`` values does not exceed; None: too few are known.

    Args:
        known: (k,) finite values, k <= count.
        count: how many there are with the unknown ones, which exceed everything.
        shares: above 0, to 1.
    """
    places = [max(int(np.ceil(share * count - 1e-9)), 1) - 1 for share in shares]
    value = {place: float(np.partition(known, place)[place]) for place in set(places) if place < known.size}
    return [value.get(place) for place in places]


def longest_unseen(time_s: FloatArray, seen: BoolArray) -> float:
    """Longest time, s, from one seen moment (k,) to the next, or the first or last of all, with unseen ones between."""
    starts, stops = run_bounds(~seen)
    if not starts.size:
        return 0.0
    return float((time_s[np.minimum(stops, seen.size - 1)] - time_s[np.maximum(starts - 1, 0)]).max())
