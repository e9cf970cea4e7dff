"""How high residuals stay for n samples in a row, and the separate peaks of that level."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray
from collaudit.core.numeric.runs import lowest_in_row, run_bounds

#: At most one peak is taken of so long a stretch, and peaks closer than half of it are one.
BLOCK_S = 1.0
#: Windows over which counts of peaks are compared.
WINDOW_S = 60.0


@dataclass(frozen=True, slots=True, eq=False)
class SustainedPeaks:
    """Declustered peaks of one joint over all logs.

    Attributes:
        level_nm: (b,) the largest level that |residual| kept for n samples in a row, one of each block.
        log: (b,) index of its log.
        window: (b,) number of its minute of clean time, counted over all logs.
        time_s: (b,) when, s from the start of its log.
        hours: clean time in stretches in which the rule can fire.
        window_hours: (w,) clean time of each minute.
        log_of_window: (w,) index of the log.
    """

    level_nm: FloatArray
    log: IntArray
    window: IntArray
    time_s: FloatArray
    hours: float
    window_hours: FloatArray
    log_of_window: IntArray


@dataclass(frozen=True, slots=True, eq=False)
class LogPeaks:
    """Declustered peaks of one joint on one log; attributes as of :class:`SustainedPeaks`, minutes from 0."""

    level_nm: FloatArray
    time_s: FloatArray
    window: IntArray
    window_hours: FloatArray


def sustained_level(data: CleanResidual, n: int) -> FloatArray:
    """(m,) the smallest |residual| of each n samples in a row, by their first sample; -inf where one is not clean.

    Rule (6) with this n fires in clean data exactly where it exceeds gamma.
    """
    return lowest_in_row(np.where(data.clean, np.abs(data.residual_nm), -np.inf), n)


def declustered_peaks(data: Sequence[CleanResidual], counts: Sequence[int]) -> SustainedPeaks:
    """Peaks of one joint over its logs.

    Args:
        data: its clean residuals, one entry a log.
        counts: n of the rule on each log, samples.
    """
    return pooled_peaks([peaks_of_log(log, n) for log, n in zip(data, counts, strict=True)])


def pooled_peaks(parts: Sequence[LogPeaks]) -> SustainedPeaks:
    """Peaks of several logs as one; their minutes are numbered on."""
    first = np.cumsum([0, *(part.window_hours.size for part in parts)])
    hours = _joined([part.window_hours for part in parts])
    numbers = np.arange(len(parts))
    return SustainedPeaks(
        level_nm=_joined([part.level_nm for part in parts]),
        log=np.repeat(numbers, [part.level_nm.size for part in parts]),
        window=_joined([part.window + at for part, at in zip(parts, first, strict=False)]).astype(np.int64),
        time_s=_joined([part.time_s for part in parts]),
        hours=float(hours.sum()),
        window_hours=hours,
        log_of_window=np.repeat(numbers, [part.window_hours.size for part in parts]),
    )


def _joined(parts: Sequence[FloatArray | IntArray]) -> FloatArray:
    return np.concatenate(parts) if parts else np.empty(0)


def peaks_of_log(data: CleanResidual, n: int) -> LogPeaks:
    """Declustered peaks of one joint on one log, at a persistence of n samples."""
    level = sustained_level(data, n)
    length = max(1, round(BLOCK_S / data.period_s))
    if level.size == 0:
        return LogPeaks(np.empty(0), np.empty(0), np.empty(0, np.int64), np.empty(0))
    starts = np.arange(0, level.size, length)
    whole = level[: level.size // length * length].reshape(-1, length)
    at = np.argmax(whole, axis=1)
    if whole.shape[0] < starts.size:  # the last block is shorter
        at = np.append(at, np.argmax(level[starts[-1] :]))
    place = at + starts
    peak: FloatArray = level[place]
    near = np.diff(place) < max(1, length // 2)
    lower = np.zeros(at.size, dtype=np.bool_)
    lower[:-1] |= near & (peak[:-1] < peak[1:])
    lower[1:] |= near & (peak[1:] <= peak[:-1])
    per_block = data.windows_by_block(n, length) * data.period_s / 3600.0
    # A minute is a minute of clean time, so that a sparse log does not count as many windows.
    minute = np.floor((np.cumsum(per_block) - 0.5 * per_block) / (WINDOW_S / 3600.0)).astype(np.int64)
    hours: FloatArray = np.bincount(minute, weights=per_block).astype(np.float64)
    kept = np.isfinite(peak) & ~lower
    times: FloatArray = np.asarray(place[kept] * data.period_s, dtype=np.float64)
    return LogPeaks(peak[kept], times, np.asarray(minute[kept], dtype=np.int64), hours)


@dataclass(frozen=True, slots=True, eq=False)
class CleanResidual:
    """Residual of one joint on one log, and the samples that count as contact-free evidence.

    Attributes:
        residual_nm: (n,).
        clean: (n,) samples on which the rule can fire, away from events.
        period_s: sample period, s.
        left_out_s: seconds in which the rule can fire, left out because they lie around events.
    """

    residual_nm: FloatArray
    clean: BoolArray
    period_s: float
    left_out_s: float = 0.0

    def windows_by_block(self, n: int, length: int) -> IntArray:
        """(b,) how many windows of n samples that all count begin in each block of so many samples."""
        starts, stops = run_bounds(self.clean & ~np.isnan(self.residual_nm))
        last = stops - (n - 1)  # the sample after the last that begins one
        starts, last = starts[last > starts], last[last > starts]
        edges = length * np.arange(-(-(self.clean.size - n + 1) // length) + 1)
        count = np.append(0, np.cumsum(last - starts))
        run = np.searchsorted(starts, edges, side="right")  # so many begin before an edge; the last may go on behind it
        return np.asarray(np.diff(count[run] - np.maximum(np.append(0, last)[run] - edges, 0)))
