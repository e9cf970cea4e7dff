"""What friction can be: a value while a joint slides, an interval while it rests or its bristles still turn over.

After a reversal friction runs from one breakaway value towards its steady one as the joint travels. How far that
takes differs between arms and is not in a log, so the friction after a travel d is only known to lie between a
stiff joint's (steady at once) and a soft one's (eq. (7) integrated over the travel: an exponential in d).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from collaudit.core.friction.model import FrictionModel
from collaudit.core.series import BoolArray, FloatArray, UniformSeries

#: The interval has shrunk to e^-5 of itself where ``reversal_travel_rad`` ends it.
_TRAVEL_CONSTANTS = 5.0
#: Friction is trusted this far below the slowest speed it was measured at: what a section's speed may vary by.
_BELOW_RANGE = 0.95


@dataclass(frozen=True, slots=True, eq=False)
class FrictionBand:
    """Friction of one joint over time, N·m.

    Attributes:
        sliding_nm: (n,) steady friction at the velocity.
        low_nm, high_nm: (n,) bounds; equal to ``sliding_nm`` where ``steady``.
        steady: (n,) the joint has slid far enough since it rested, reversed or came into view.
        level_sd: standard error that a trend with temperature leaves in the level, as a share.
    """

    sliding_nm: FloatArray
    low_nm: FloatArray
    high_nm: FloatArray
    steady: BoolArray
    level_sd: float = 0.0


def friction_band(
    series: UniformSeries, j: int, velocity: FloatArray, law: FrictionModel, slow: float | None, travel_rad: float
) -> FrictionBand:
    """Bounds of one joint's friction.

    Args:
        series: where the joint was.
        j: its column.
        velocity: (n,) at which friction is taken.
        law: the fitted law.
        slow: below this speed the joint is taken to rest; just below the slowest fitted speed when None.
        travel_rad: travel after which friction is steady.
    """
    sliding = law.torque(velocity)
    resting = np.abs(velocity) < (slow or _BELOW_RANGE * law.speed_range[0])
    travel = _travel(series, j, velocity, resting)
    steady = ~resting & (travel >= travel_rad) & np.isfinite(sliding)
    low, high = sliding.copy(), sliding.copy()
    k = np.flatnonzero(~steady)
    size = np.abs(sliding[k])
    hold = np.maximum(law.hold, size)
    left = np.exp(-_TRAVEL_CONSTANTS * travel[k] / travel_rad) if travel_rad > 0 else np.zeros_like(size)
    along_low = np.where(resting[k], -hold, size - (size + hold) * left)
    along_high = np.where(resting[k], hold, size + (hold - size) * left)
    forward = velocity[k] >= 0
    low[k] = np.where(forward, along_low, -along_high)
    high[k] = np.where(forward, along_high, -along_low)
    heat = None if law.warmth is None or series.temperature_c is None else series.temperature_c[:, j]
    if law.warmth is None or heat is None:
        return FrictionBand(sliding, low, high, steady)
    share = law.warmth.share(heat)
    return FrictionBand(share * sliding, share * low, share * high, steady, law.warmth.doubt(heat))


def _travel(series: UniformSeries, j: int, velocity: FloatArray, resting: BoolArray) -> FloatArray:
    """(n,) way since the joint last rested or reversed, or since the start of the stretch."""
    out = np.zeros(velocity.size)
    for segment in series.segments:
        if len(segment) == 0:
            continue
        position, v = series.position_rad[segment.slice, j], velocity[segment.slice]
        anew = resting[segment.slice].copy()
        anew[0] = True
        anew[1:] |= v[1:] * v[:-1] < 0
        way = np.cumsum(np.nan_to_num(np.abs(np.diff(position, prepend=position[0]))))
        last = np.maximum.accumulate(np.where(anew, np.arange(anew.size), 0))
        out[segment.slice] = way - way[last]
    return out
