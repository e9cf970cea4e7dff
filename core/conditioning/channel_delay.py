"""Effort and wrench at the time of the motion they belong to, where a delay of their channel is stated."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from collaudit.core.config.schema import LogConfig
from collaudit.core.data.uniform_series import UniformSeries
from collaudit.core.numeric.arrays import FloatArray


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
