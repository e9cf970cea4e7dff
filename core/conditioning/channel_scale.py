"""How finely each channel of a log is resolved: the step between its values and its noise, as recorded."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from collaudit.core.config.schema import LogConfig
from collaudit.core.data.joint_log import JointLog
from collaudit.core.data.uniform_series import UniformSeries
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.numeric.stats import SD_PER_MAD

_BLOCKS = 10
#: Standard deviation over the median of |third differences| of white noise: 1.4826 / sqrt(1 + 9 + 9 + 1).
_SD_PER_MEDIAN = SD_PER_MAD / float(np.sqrt(20.0))
#: Values closer than this share of the range are one value that was rounded twice.
_SAME = 1e-9
#: A finer step, as a share of the range, is the number format's and not the sensor's.
_FINEST = 1e-6
_FEWEST = 5
#: Differences below this share of the values are those of float64.
_ROUNDING = 1e-14
_ROWS = 100_000


@dataclass(frozen=True, slots=True)
class ChannelScale:
    """One channel of one joint, in the unit of the log in SI.

    Attributes:
        step: distance between neighbouring values; None where the values lie on no grid.
        noise: standard deviation from sample to sample, 0 where most samples repeat or lie on a line; None where the
            channel stands still.
        noise_ci95: its interval, from ten stretches of the log.
    """

    step: float | None
    noise: float | None
    noise_ci95: tuple[float, float] | None


@dataclass(frozen=True, slots=True)
class JointScale:
    """The channels of one joint; None for those that the log does not have."""

    joint: str
    position: ChannelScale
    velocity: ChannelScale | None
    effort: ChannelScale | None


def measure_channels(log: JointLog) -> tuple[JointScale, ...]:
    """Step and noise of every channel, before any filter.

    Args:
        log: as recorded.
    """

    def scale(values: FloatArray | None, j: int) -> ChannelScale | None:
        return None if values is None else channel_scale(values[:_ROWS, j])

    return tuple(
        JointScale(name, channel_scale(log.position_rad[:_ROWS, j]), scale(log.velocity_rad_s, j), scale(log.effort, j))
        for j, name in enumerate(log.joint_names)
    )


def channel_scale(values: FloatArray) -> ChannelScale:
    """Step and noise of one channel (n,).

    Noise is the median size of third differences, in which a motion that is smooth over four samples cancels. Its
    interval is the second smallest to the second largest of ten stretches, 97.9 % for their median.
    """
    values = values[np.isfinite(values)]
    if values.size < 10 * _BLOCKS or not np.ptp(values) > 0:
        return ChannelScale(None, None, None)
    parts = np.array_split(np.abs(np.diff(values, 3)), _BLOCKS)
    sizes = np.sort([float(np.median(part)) * _SD_PER_MEDIAN for part in parts])
    sizes[sizes < _ROUNDING * np.abs(values).max()] = 0.0
    return ChannelScale(_step(values), float(np.median(sizes)), (float(sizes[1]), float(sizes[-2])))


def _step(values: FloatArray) -> float | None:
    """The grid on which values lie: every gap between neighbours in size is a whole multiple of it."""
    reach = float(np.ptp(values))
    gaps = np.diff(np.unique(values))
    gaps = np.sort(gaps[gaps > _SAME * reach])
    if gaps.size < _FEWEST:
        return None
    step = float(gaps[gaps.size // 20])
    for limit in (4.0, 30.0, 200.0):  # longer gaps sharpen the step, once it is known well enough to count them
        near = gaps[gaps < limit * step]
        count = np.round(near / step)
        if count.any():
            step = float(near @ count / (count @ count))
    near = gaps[gaps < 200.0 * step]
    off = near / step - np.round(near / step)
    whole = 2 * near.size > gaps.size and float(np.sqrt(np.mean(off**2))) < 0.1  # 0.29 without a grid
    return step if whole and step > _FINEST * reach else None


def undelayed(series: UniformSeries, config: LogConfig) -> UniformSeries:
    """The series with effort and wrench moved to the time of the motion they belong to.

    Values are interpolated between samples; within a delay of a gap nothing is known.

    Args:
        series: the log on its uniform time base.
        config: the delays, ms; positive when the channel is stamped late.
    """
    if series.effort is not None and config.effort_delay_ms:
        series = replace(series, effort=moved(series.effort, series, 1e-3 * config.effort_delay_ms))
    if series.wrench is not None and config.wrench_delay_ms:
        series = replace(series, wrench=moved(series.wrench, series, 1e-3 * config.wrench_delay_ms))
    return series


def moved(values: FloatArray, series: UniformSeries, delay_s: float) -> FloatArray:
    """(n, k) values at their times plus a delay, s; NaN within it of a gap."""
    out = np.full_like(values, np.nan)
    steps = delay_s / series.period_s
    for span in series.segments:
        part = values[span.slice]
        at = np.arange(len(span)) + steps
        low = np.floor(at).astype(np.int64)
        inside = (low >= 0) & (low + 1 < len(span))
        share = (at - low)[inside, None]
        moved = np.full_like(part, np.nan)
        moved[inside] = (1.0 - share) * part[low[inside]] + share * part[low[inside] + 1]
        out[span.slice] = moved
    return out
