"""Residuals like the simulator's, hours of them in seconds: a smoothed block bootstrap.

A new log is put together from minutes of a few simulated clean logs, all joints together, so that memory, regimes and
what lasts for a minute stay as they are. Each minute is larger or smaller by a random factor of each joint, so that
none comes twice and the tail goes on beyond the largest that was simulated.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from collaudit.core.recommend.sustained_levels import LogPeaks

_BLOCK_S = 60.0
_FROM_LOGS = 4
#: Spread of a minute's size.
_BLOCK_SD = 0.04

#: Residual (n, j) N·m, and where it is clean.
Made = tuple[np.ndarray, np.ndarray]


def generated(sources: Sequence[Made], seed: int, period_s: float) -> Made:
    """A new log as long as the first source."""
    rng = np.random.default_rng(seed)
    few = rng.choice(len(sources), min(_FROM_LOGS, len(sources)), replace=False)
    n, joints = sources[0][0].shape
    length = min(round(_BLOCK_S / period_s), n)
    residual, clean = np.empty((n, joints), order="F"), np.empty((n, joints), dtype=bool, order="F")
    for start in range(0, n, length):
        x, usable = sources[int(rng.choice(few))]
        stop = min(n, start + length)
        at = int(rng.integers(0, x.shape[0] - (stop - start) + 1))
        part = slice(at, at + stop - start)
        residual[start:stop] = x[part] * np.exp(_BLOCK_SD * rng.standard_normal(joints))
        clean[start:stop] = usable[part]
    return residual, clean


def generated_peaks(sources: Sequence[Sequence[LogPeaks]], seed: int, length_s: float = 300.0) -> list[LogPeaks]:
    """Peaks of the joints of a new log, put together in the same way: a minute's levels grow by the minute's factor."""
    rng = np.random.default_rng(seed)
    few = rng.choice(len(sources), min(_FROM_LOGS, len(sources)), replace=False)
    minutes = [
        (sources[int(rng.choice(few))], rng.uniform(0.0, length_s - _BLOCK_S), rng.standard_normal(len(sources[0])))
        for _ in range(round(length_s / _BLOCK_S))
    ]
    return [
        _joined_minutes([(log[j], at, float(size[j])) for log, at, size in minutes], length_s)
        for j in range(len(sources[0]))
    ]


def _joined_minutes(minutes: Sequence[tuple[LogPeaks, float, float]], length_s: float) -> LogPeaks:
    levels, times, windows, hours = [], [], [], []
    for k, (log, at, size) in enumerate(minutes):
        own = (log.time_s >= at) & (log.time_s < at + _BLOCK_S)
        levels.append(log.level_nm[own] * np.exp(_BLOCK_SD * size))
        times.append(log.time_s[own] - at + k * _BLOCK_S)
        windows.append(np.full(int(own.sum()), k, dtype=np.int64))
        hours.append(_BLOCK_S * float(log.window_hours.sum()) / length_s)
    return LogPeaks(np.concatenate(levels), np.concatenate(times), np.concatenate(windows), np.array(hours))
