"""Stretches of a channel that are no measurement: constant, on a straight line, without its usual noise, or copied.

What is told is how a channel bends from sample to sample, x[i-1] - 2 x[i] + x[i+1]. A measured channel bends by its
noise. One that is held, or filled in by a straight line, does not bend at all; one that is held with a little noise
added, or filled in by a smooth curve, bends less than it ever does. How much is usual, and for how long less is,
the channel itself tells: a drive that updates slowly, and one that writes coarse steps, are held by nature. Noise
never repeats itself: a stretch whose values stood before in the same order was copied.
"""

from __future__ import annotations

from collections.abc import Callable
from math import ceil, exp, log, sqrt

import numpy as np
from numpy.typing import NDArray

from collaudit.core.config.schema_judging import DetectConfig
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray, lasting, marked, run_bounds
from collaudit.core.numeric.stats import ROUNDING, Noise, median_of, quantile_of

#: Expected number of stretches as long by chance.
CHANCE = 1e-6
#: So many times as long as others in a signal that is held, or coarse.
_TIMES = 3.0
#: A signal that is calm more often than this is too coarse, or too slow, to tell.
_MOST_CALM = 0.9
#: What a straight line bends by where it was rounded to the signal's resolution, in steps of it. That is below the
#: noise where the resolution is finer than this share of the noise.
_ROUNDED, _FINE = 2.0, 0.05
#: Windows in which noise is measured, in times of the shortest; its fewest samples, in one channel and in all at once.
_WINDOWS, WINDOW, _WINDOW_OF_ALL = (1, 2, 4, 8), 8, 4
#: A window has less than the usual noise where it lies below the lower quarter by so many times what that lies below
#: the median, in logarithms: 12 recordings of 8 arms and the simulated ones stay within 10.5.
_BELOW, _QUARTER = 14.0, 0.25
#: Of white noise the lower quarter lies below the median by so many standard deviations of the logarithm; these are
#: sqrt(2 / freedom), with a degree of freedom for every 1.94 bends, which depend on each other.
_TO_QUARTER, _FREEDOM = 0.6745, 2.0 * 1.94
#: Windows from which the usual noise is told.
_LEAST_WINDOWS = 40


def straight_rows(x: FloatArray, bend: FloatArray, noise: Noise, moving: BoolArray, least: int) -> BoolArray | None:
    """(n,) rows of runs that are constant or on a straight line for too long; None where there are none.

    Of each run, from the first to the last of its rows in motion.

    Args:
        x, bend: (n,) channel and :func:`bend_of`.
        noise: of :func:`noise_of`.
        moving: (n,) rows at which it is told what is usual, and of which ``least`` lie in a run that counts.
        least: samples.
    """
    if noise.sd <= ROUNDING * noise.range and not noise.coarse:  # computed, not measured: it is straight by nature
        return None
    calm = straight(bend, noise)
    starts, stops = straight_runs(x, calm)
    at = np.flatnonzero(moving)
    first, last = np.searchsorted(at, starts), np.searchsorted(at, stops)
    if not (last - first >= least).any():
        return None
    bound = max(float(least), _bound(calm & moving, int(np.count_nonzero(moving & ~calm)), noise.coarse, least))
    long = last - first >= bound
    return marked(at[first[long]], at[last[long] - 1] + 1, x.size) if long.any() else None


def straight(bend: FloatArray, noise: Noise) -> BoolArray:
    """(n,) whether each sample is on a straight line with its neighbours; arguments as of :func:`straight_rows`."""
    tolerance = ROUNDING * noise.range
    if noise.resolution < _FINE * noise.sd:
        tolerance += _ROUNDED * noise.resolution
    with np.errstate(invalid="ignore"):
        return np.asarray(bend <= tolerance)


def straight_runs(x: FloatArray, calm: BoolArray) -> tuple[IntArray, IntArray]:
    """Runs (starts, stops) of rows that are held or filled in, from :func:`straight`: what is held bends at its end."""
    starts, stops = run_bounds(calm)
    return starts, stops + (x[np.minimum(stops, x.size - 1)] == x[stops - 1]) * (stops < x.size)


def _bound(calm: BoolArray, others: int, coarse: bool, least: int) -> float:
    """Calm samples in a row that are neither usual for this signal nor chance; infinite where that cannot be told.

    By chance, each calm sample of a run is followed by another one as often as in the signal's usual runs; where there
    are hardly any, as often as samples are calm.
    """
    starts, stops = run_bounds(calm)
    length = stops - starts
    run = np.concatenate((length, np.zeros(max(others - length.size, 0))))  # most samples of most drives: not calm
    usual = length[length < max(_TIMES * (1.0 + float(np.median(run))), min(least - 1, WINDOW))]
    samples = int(usual.sum())
    share = (samples + 1.0) / (samples + others + 2.0)
    if share > _MOST_CALM:
        return float("inf")
    again = (samples - usual.size + share) / (samples + 1.0)
    bound = 1.0 + log((usual.size + 1.0) / CHANCE) / -log(again)
    if length.size > 2 and coarse:  # these runs are not drawn by chance: they come with every slow change of load
        bound = max(bound, _TIMES * float(np.partition(length, -3)[-3]))
    return bound


def quiet_rows(bend: FloatArray, moving: BoolArray, least: int, channels: int = 1) -> BoolArray | None:
    """(n,) rows of runs with far less than the usual noise; None where there are none, or that cannot be told.

    Args:
        bend: (n,) of :func:`bend_of` of a channel that is measured, or of all, each in its noise.
        moving, least: as of :func:`straight_rows`.
        channels: how many it is of.
    """
    known = np.isfinite(bend)
    energy = np.concatenate(([0.0], np.cumsum(np.square(np.where(known, bend, 0.0)))))
    whole = _whole(known & moving)
    out = np.zeros(bend.size, dtype=np.bool_)
    loud = 0.0
    for times in _WINDOWS:
        width = times * max(least, WINDOW if channels == 1 else _WINDOW_OF_ALL)
        if width >= bend.size:
            break
        power = energy[width:] - energy[:-width]
        at = np.arange(0, power.size, max(width // 2, 1))
        typical = power[at[whole(at, width)]]
        if typical.size < _LEAST_WINDOWS:
            break
        quarter, half = quantile_of(typical, _QUARTER), median_of(typical)
        if quarter <= 0.0:
            continue
        loud = max(loud, half / width)
        spread = min(quarter / half, exp(-_TO_QUARTER * sqrt(_FREEDOM / (channels * width))))  # few windows tell it ill
        first = np.flatnonzero(power < quarter * spread**_BELOW)
        first = first[whole(first, width)]
        if first.size:
            out |= marked(first, first + width, bend.size)
    if not out.any():
        return None
    with np.errstate(invalid="ignore"):
        out &= np.square(bend) <= loud  # a window may reach beyond what is quiet
    out = lasting(out, least)
    return out if out.any() else None


def _whole(mask: BoolArray) -> Callable[[IntArray, int], BoolArray]:
    """Whether all of so many rows from each of some places are in the mask."""
    count = np.concatenate(([0], np.cumsum(mask)))
    return lambda at, width: np.asarray(count[at + width] - count[at] == width)


#: Rounding of a persistence in samples.
_STRETCH_ROUNDING = 1e-3
#: Two values are on a straight line always.
_SHORTEST = 3


def shortest_stretch(detect: DetectConfig, period_s: float) -> int:
    """Samples of it: as many as an alarm needs.

    Args:
        detect: the rule.
        period_s: usual step between stamps.
    """
    return max(_SHORTEST, detect.n or ceil(detect.asked_persistence_ms / 1e3 / period_s - _STRETCH_ROUNDING))


#: So many times as many values have to agree as would if each were drawn anew: noise is not, and less in slow motion.
_DEPENDENT = 2
#: A channel two of whose values are the same more often than this is too coarse to tell.
_MOST_ALIKE = 0.1
#: Values from which it is told how often two are the same.
_DRAWN = 1 << 14
#: What a hash is multiplied by before the next value is added: odd, its bits mixed (2^64 / golden ratio).
_FACTOR, _FOLD = np.uint64(0x9E3779B97F4A7C15), np.uint64(29)
_Hashes = NDArray[np.uint64]


def repeated_rows(values: FloatArray, usual: BoolArray, least: int) -> BoolArray | None:
    """(n,) rows of runs that occurred before in the same order; None without any.

    The first of them counts as measured. If it was the copy, the log holds a stretch without measurement all the same.

    Values that are held count once. How many have to agree follows from how often two values do: where several channels
    repeat together, fewer samples tell it.

    Args:
        values: (n, c) channels that are measured, and not coarse: computed ones repeat where their motion does.
        usual: (n,) rows that are looked at.
        least: samples.
    """
    value = np.zeros(values.shape[0], dtype=np.uint64)
    for column in values.T:
        _add(value, np.ascontiguousarray(column + 0.0).view(np.uint64))  # -0.0 is 0.0
    usual = usual & np.isfinite(values.sum(axis=1))
    fresh = np.flatnonzero(np.concatenate(([True], value[1:] != value[:-1])) & usual)
    if fresh.size < 2:
        return None
    drawn = value[fresh]
    alike = _alike(drawn)
    if alike > _MOST_ALIKE:
        return None
    count = _DEPENDENT * ceil(np.log(0.5 * fresh.size**2 / CHANCE) / -np.log(alike))
    if fresh.size < 2 * count:
        return None
    starts, stops = run_bounds(_again(drawn, count))
    starts, stops = fresh[starts], fresh[stops + count - 2] + 1
    long = stops - starts >= least
    return marked(starts[long], stops[long], value.size) if long.any() else None


def _add(key: _Hashes, value: _Hashes) -> None:
    """Add values to hashes, in place."""
    key *= _FACTOR
    key ^= key >> _FOLD
    key += value


def _alike(values: _Hashes) -> float:
    """Share of the pairs of values that are the same, of some drawn evenly, or that one such pair would be."""
    ordered = np.sort(values[:: max(1, values.size // _DRAWN)])
    starts, stops = run_bounds(ordered[1:] == ordered[:-1])
    times = (stops - starts + 1).astype(np.float64)
    return max(float(np.sum(times * (times - 1.0))), 1.0) / (float(ordered.size) * (ordered.size - 1.0))


def _again(values: _Hashes, count: int) -> BoolArray:
    """(m,) whether the ``count`` values from each place on stand earlier too."""
    size = values.size - count + 1
    key = np.zeros(size, dtype=np.uint64)
    for k in range(count):
        _add(key, values[k : k + size])
    later = np.zeros(size, dtype=np.bool_)
    ordered = np.sort(key)
    if not (ordered[1:] == ordered[:-1]).any():  # as in most logs, and told in a tenth of the time
        return later
    order = np.argsort(key, kind="stable")
    later[order[1:]] = key[order[1:]] == key[order[:-1]]
    return later
