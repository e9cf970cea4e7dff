"""What friction can be: a value while a joint slides, an interval while it rests or its bristles still turn over.

After a reversal friction runs from one breakaway value towards its steady one as the joint travels. How far that
takes differs between arms and is not in a log, so friction is known to lie between the two until the joint has
travelled ``REVERSAL_TRAVEL_RAD``: a gear's hysteresis does not fade before it is through.

What the residual takes off besides friction over speed: the load on the gear, and ripple over position.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from collaudit.core.data.joint_log import MOVING_RAD_S, UniformSeries
from collaudit.core.friction.friction_model import (
    UNKNOWN_BREAKAWAY,
    FrictionModel,
    temperature_doubt,
    temperature_share,
)
from collaudit.core.friction.gear_ripple import ripple_torque
from collaudit.core.numeric.arrays import BoolArray, FloatArray
from collaudit.core.numeric.filters import Kernel
from collaudit.core.numeric.stats import median_of, robust_sd
from collaudit.core.prepare.prepared import Prepared
from collaudit.core.torque_table.log_samples import REVERSAL_TRAVEL_RAD, settled

#: Friction is trusted this far below the slowest speed it was measured at: what a section's speed may vary by.
_BELOW_RANGE = 0.95


@dataclass(frozen=True, slots=True, eq=False)
class FrictionBounds:
    """Friction of one joint over time, N·m.

    Attributes:
        sliding_nm: (n,) steady friction at the velocity.
        steady: (n,) the joint has slid far enough since it rested, reversed or came into view.
        low_nm, high_nm: (n,) its bounds; ``sliding_nm`` where it is steady.
        level_sd: standard error that a trend with temperature leaves in the level, as a share.
    """

    sliding_nm: FloatArray
    steady: BoolArray
    low_nm: FloatArray
    high_nm: FloatArray
    level_sd: float = 0.0


def friction_bounds(
    series: UniformSeries,
    j: int,
    velocity: FloatArray,
    law: FrictionModel,
    load_nm: FloatArray | None = None,
) -> FrictionBounds:
    """Bounds of one joint's friction.

    Args:
        series: where the joint was.
        j: its column.
        velocity: (n,) at which friction is taken.
        law: the fitted law.
        load_nm: (n,) size of the torque on the gear, for a law that goes with it; None to leave that out.
    """
    slowest = _BELOW_RANGE * law.speed_range[0]
    steady, travel = settled(series.segments, series.position_rad[:, j], velocity, min(MOVING_RAD_S, slowest))
    steady &= np.abs(velocity) >= slowest
    sliding = law.sliding(velocity, load_nm, None)
    if not np.isfinite(sliding.sum()):
        steady &= np.isfinite(sliding)
    low, high = sliding.copy(), sliding.copy()
    k = np.flatnonzero(~steady)
    low[k], high[k] = loose_bounds(law, velocity[k], sliding[k], travel[k], slowest)
    trend = law.temperature_trend
    if trend is None or series.temperature_c is None:
        return FrictionBounds(sliding, steady, low, high)
    heat = series.temperature_c[:, j]
    share = temperature_share(trend, heat)
    return FrictionBounds(share * sliding, steady, share * low, share * high, temperature_doubt(trend, heat))


def loose_bounds(
    law: FrictionModel,
    velocity: FloatArray,
    sliding: FloatArray,
    travel: FloatArray,
    slowest: float,
) -> FloatArray:
    """(2, k) lower and upper bound of friction where it is not steady.

    Args:
        law: the fitted law.
        velocity, sliding, travel: (k,) of the joint, steady friction at it, way since it last rested or reversed.
        slowest: below this speed steady friction is a range itself.
    """
    forward, size = velocity >= 0, np.abs(sliding)
    hold = np.maximum(law.hold, size)
    slow, at_slowest = np.abs(velocity) < slowest, np.abs(law.torque(np.where(forward, slowest, -slowest)))
    least = np.where(slow, np.minimum(size, at_slowest / UNKNOWN_BREAKAWAY), size)
    most = np.where(slow, hold, size)
    turning = travel <= REVERSAL_TRAVEL_RAD
    along_low, along_high = np.where(turning, -hold, least), np.where(turning, hold, most)
    return np.asarray(np.where(forward, (along_low, along_high), (-along_high, -along_low)))


#: A residual beyond so many robust standard deviations may be a contact: it counts as this much of the ripple's check.
_CLIP = 3.0
_FEWEST_SAMPLES = 100
#: Share of its calibrated size above which the ripple of a log confirms the file's.
_CONFIRMED = 0.5


def carried_load(prepared: Prepared, joint: str, law: FrictionModel) -> FloatArray | None:
    """(n,) size of the torque on the gear, N·m; None where the law does not go with it."""
    torque = None if law.load is None else prepared.explained_nm(joint)
    return None if torque is None else np.asarray(np.abs(torque))


def known_ripple(
    series: UniformSeries,
    j: int,
    velocity: FloatArray,
    law: FrictionModel,
    kernel: Kernel,
    left_nm: FloatArray,
    usable: BoolArray,
) -> tuple[FloatArray | float, float]:
    """Ripple of one joint through the kernel, and what it may be wrong by, N·m.

    A joint that was opened, or counts from another zero, has its ripple elsewhere. The file's is therefore taken off
    only where this log has it at its place: where the residual's projection on it is more than half of it. Where it
    is not, nothing is taken off, and the threshold carries the whole amplitude.

    Args:
        series: where the joint was.
        j: its column.
        velocity: (n,) of the joint.
        law: with what is known of its ripple.
        kernel: that the residual has passed.
        left_nm: (n,) residual with the ripple in it.
        usable: (n,) samples at which that is known.

    Returns:
        (n,) torque, or 0, and a half width of 95 %.
    """
    if not law.ripple:
        return 0.0, 0.0
    wave = ripple_torque(law.ripple, series.position_rad[:, j], velocity)
    wave = kernel.apply(wave[:, None], series.segments, series.period_s)[:, 0]
    amplitude = sum(float(np.hypot(*w.same_nm) + np.hypot(*w.against_nm)) for w in law.ripple)
    rows = usable & np.isfinite(left_nm) & np.isfinite(wave)
    if np.count_nonzero(rows) < _FEWEST_SAMPLES:
        return 0.0, amplitude
    w, left = wave[rows], left_nm[rows] - median_of(left_nm[rows])
    bound = _CLIP * robust_sd(left)
    power = float(w @ w)
    if power <= 0.0 or float(w @ np.clip(left, -bound, bound)) < _CONFIRMED * power:
        return 0.0, amplitude
    return np.nan_to_num(wave), 2.0 * float(np.sqrt(sum(x.sd_nm**2 for x in law.ripple)))
