"""What is off its calibration on the judged log, followed slowly: the level of friction, and the zero of a torque.

Friction falls by 10-15 % as a gear warms up and varies from day to day; at speed that alone is a torque above
common thresholds. The level (1 + d) is the value that explains most of the residual in the sense of least absolute
deviations over a window of a minute: a push, which lasts seconds and does not follow the velocity's sign, cannot
move it. What is left is a standard error, which the threshold carries.

Sensors and currents drift by a tenth of a newton metre in an hour. The zero is the median of what the model leaves over
a minute of sliding, never further than a stated bound: what lasts for seconds does not move it. What lasts longer, a
clamp over half the log say, moves it by the bound at most, so it still shows with all but that.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from collaudit.core.data.detection_result import LevelFacts, ZeroFacts
from collaudit.core.numeric.arrays import BoolArray, FloatArray
from collaudit.core.numeric.stats import median_of, parabola_minimum

#: Levels considered, as deviations from the calibration.
LARGEST = 0.3
_GRID = np.linspace(-LARGEST, LARGEST, 61)
_BLOCK_S, _WINDOW_S, _SAMPLE_S = 1.0, 30.0, 0.02
#: Residuals closer than this in time are the same error of the model.
_CORRELATION_S = 0.2
#: A residual this small is as good as the sensor can be.
_FLOOR_NM = 0.05


@dataclass(frozen=True, slots=True, eq=False)
class FrictionLevel:
    """The level of one joint.

    Attributes:
        deviation: (n,) d, friction is (1 + d) times its calibration.
        sd: (n,) its standard error.
        mean: d over the samples that tell it, weighted by friction squared, as least squares would weigh it.
    """

    deviation: FloatArray
    sd: FloatArray
    mean: float = 0.0

    @property
    def facts(self) -> LevelFacts:
        """Range and standard error."""
        share = 1.0 + self.deviation
        return LevelFacts(
            lowest=float(share.min()),
            median=median_of(share),
            highest=float(share.max()),
            sd=median_of(self.sd),
            mean=1.0 + self.mean,
        )


def follow_level(
    excess: FloatArray, friction: FloatArray, usable: BoolArray, period_s: float, prior_sd: float, causal: bool
) -> FrictionLevel:
    """Follow one joint's friction level.

    Minimises, over a window weighted exp(-|age| / 30 s), the sum of |excess - d·friction| / (scale · samples that
    are one error) + d² / (2 prior_sd²).

    Args:
        excess: (n,) residual with friction as calibrated, N·m.
        friction: (n,) calibrated friction, N·m.
        usable: (n,) samples at which friction is steady and everything is known.
        period_s: sample period, s.
        prior_sd: standard deviation of d before any data.
        causal: use the past only.
    """
    n = excess.size
    step = max(1, round(_SAMPLE_S / period_s))
    block = max(1, round(_BLOCK_S / (step * period_s)))
    pick = np.arange(0, n, step)
    use = usable[pick] & np.isfinite(excess[pick]) & np.isfinite(friction[pick])
    e, f = np.where(use, excess[pick], 0.0), np.where(use, friction[pick], 0.0)
    starts = np.arange(0, pick.size, block)
    cost = np.empty((starts.size, _GRID.size))
    for k, d in enumerate(_GRID):
        cost[:, k] = np.add.reduceat(np.abs(e - d * f), starts)
    information = np.add.reduceat(f**2, starts)
    count = np.add.reduceat(use.astype(np.float64), starts)
    decay = float(np.exp(-block * step * period_s / _WINDOW_S))
    weight = information
    cost, information, count = (_windowed(x, decay, causal) for x in (cost, information, count))
    together = max(1.0, _CORRELATION_S / (step * period_s))
    scale = np.maximum(cost.min(axis=1) / np.maximum(count, 1.0), _FLOOR_NM)
    total = cost / (scale * together)[:, None] + _GRID**2 / (2.0 * prior_sd**2)
    sd = 1.0 / np.sqrt(information / (scale**2 * together) + 1.0 / prior_sd**2)
    deviation = _minimum(total)
    mean = float(deviation @ weight / weight.sum()) if weight.any() else 0.0
    deviation, sd = (_over_time(x, starts, block, step, n, causal) for x in (deviation, sd))
    return FrictionLevel(deviation, sd, mean)


def _windowed(x: FloatArray, decay: float, causal: bool) -> FloatArray:
    """Sums over blocks with exponential forgetting: of the past only, or of both sides."""
    past = np.zeros_like(x)
    for k in range(1, x.shape[0]):
        past[k] = decay * (past[k - 1] + x[k - 1])
    if causal:
        return past
    ahead = np.zeros_like(x)
    for k in range(x.shape[0] - 2, -1, -1):
        ahead[k] = decay * (ahead[k + 1] + x[k + 1])
    return np.asarray(past + x + ahead)


def _minimum(cost: FloatArray) -> FloatArray:
    """(blocks,) grid minimum, refined by the parabola through its neighbours."""
    best = np.clip(np.argmin(cost, axis=1), 1, _GRID.size - 2)
    rows = np.arange(cost.shape[0])
    shift = parabola_minimum(*(cost[rows, best + k] for k in (-1, 0, 1)))
    step = _GRID[1] - _GRID[0]
    return np.asarray(np.clip(_GRID[best] + np.clip(shift, -1.0, 1.0) * step, -LARGEST, LARGEST))


def _over_time(blocks: FloatArray, starts: np.ndarray, block: int, step: int, n: int, causal: bool) -> FloatArray:
    """Block values at every sample: held when causal, straight between block centres otherwise."""
    samples = np.arange(n)
    if causal:
        return np.asarray(blocks[np.minimum(samples // (block * step), blocks.size - 1)])
    return np.asarray(np.interp(samples, (starts + 0.5 * block) * step, blocks))


#: Of a threshold: of a steady torque of 1.3 times the threshold 1.05 times it are left.
BOUND_SHARE = 0.25
#: Window of its median, s.
_ZERO_WINDOW_S = 60.0
#: Sliding in a block of which less tells nothing.
_LEAST = 0.25


@dataclass(frozen=True, slots=True, eq=False)
class TorqueZero:
    """The zero of one joint.

    Attributes:
        offset_nm: (n,) what is taken off the torque, N·m: within the bound.
        facts: what was found, and the bound.
    """

    offset_nm: FloatArray
    facts: ZeroFacts


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
    width = round(_ZERO_WINDOW_S / _BLOCK_S) | 1
    at = (told + 0.5) * block
    if causal:  # of the blocks before: none tells of the first
        level = np.append(0.0, scipy.ndimage.median_filter(level, width, mode="nearest", origin=width // 2)[:-1])
        found = level[np.maximum(np.searchsorted(told, np.arange(excess_nm.size) // block, side="right") - 1, 0)]
    else:
        level = scipy.ndimage.median_filter(level, width, mode="nearest")
        found = np.interp(np.arange(excess_nm.size), at, level)
    offset = np.clip(found, -bound_nm, bound_nm)
    return TorqueZero(offset, ZeroFacts(float(level.min()), float(level.max()), bound_nm))


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
