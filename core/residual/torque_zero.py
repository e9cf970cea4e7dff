"""The zero of a joint's torque on the judged log, followed slowly and never further than a stated bound.

Sensors and currents drift by a tenth of a newton metre in an hour. The zero is the median of what the model leaves over
a minute of sliding: what lasts for seconds does not move it. What lasts longer, a clamp over half the log say, moves it
by the bound at most, so it still shows with all but that.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from collaudit.core.numeric.arrays import BoolArray, FloatArray

#: Of a threshold: of a steady torque of 1.3 times the threshold 1.05 times it are left.
BOUND_SHARE = 0.25
_BLOCK_S, _WINDOW_S, _SAMPLE_S = 1.0, 60.0, 0.02
#: Sliding in a block of which less tells nothing.
_LEAST = 0.25


@dataclass(frozen=True, slots=True, eq=False)
class TorqueZero:
    """The zero of one joint.

    Attributes:
        offset_nm: (n,) what is taken off the torque, N·m: within the bound.
        lowest_nm, highest_nm: what was found, N·m.
        bound_nm: the bound.
    """

    offset_nm: FloatArray
    lowest_nm: float
    highest_nm: float
    bound_nm: float


def follow_zero(
    excess_nm: FloatArray, usable: BoolArray, period_s: float, bound_nm: float, causal: bool
) -> TorqueZero | None:
    """Follow one joint's zero; None where it hardly slides.

    Args:
        excess_nm: (n,) torque that model and friction leave.
        usable: (n,) samples at which friction is steady and everything is known.
        period_s: sample period, s.
        bound_nm: the zero is at most that far off.
        causal: use the past only.
    """
    step = max(1, round(_SAMPLE_S / period_s))
    each = max(1, round(_BLOCK_S / (step * period_s)))
    block = each * step
    count = excess_nm.size // block
    rows = slice(0, count * block, step)
    known = (usable & np.isfinite(excess_nm))[rows].reshape(count, each)
    told = np.flatnonzero(known.mean(axis=1) >= _LEAST) if count else np.empty(0, np.int64)
    if not told.size:
        return None
    values = np.where(known[told], excess_nm[rows].reshape(count, each)[told], np.nan)
    level = np.asarray(np.nanmedian(values, axis=1))
    width = round(_WINDOW_S / _BLOCK_S) | 1
    at = (told + 0.5) * block
    if causal:  # of the blocks before: none tells of the first
        level = np.append(0.0, scipy.ndimage.median_filter(level, width, mode="nearest", origin=width // 2)[:-1])
        found = level[np.maximum(np.searchsorted(told, np.arange(excess_nm.size) // block, side="right") - 1, 0)]
    else:
        level = scipy.ndimage.median_filter(level, width, mode="nearest")
        found = np.interp(np.arange(excess_nm.size), at, level)
    offset = np.clip(found, -bound_nm, bound_nm)
    return TorqueZero(offset, float(level.min()), float(level.max()), bound_nm)


def balanced_zero(
    excess_nm: FloatArray, velocity: FloatArray, usable: BoolArray, period_s: float, causal: bool
) -> FloatArray | float:
    """(n,) the zero that does not depend on how far friction is off, N·m; 0 where a joint slides one way only.

    Friction that is off by a share d leaves d·f one way and -d·f the other: the mean of both directions is the zero.

    Args:
        excess_nm, usable, period_s, causal: as of :func:`follow_zero`.
        velocity: (n,) of the joint.
    """
    ways = [follow_zero(excess_nm, usable & way, period_s, np.inf, causal) for way in (velocity > 0, velocity < 0)]
    forward, backward = (None if way is None else way.offset_nm for way in ways)
    return 0.0 if forward is None or backward is None else 0.5 * (forward + backward)
