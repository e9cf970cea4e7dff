"""Stretches that are exact copies of another stretch: what was recorded was written again."""

from __future__ import annotations

from math import ceil, log

import numpy as np
from numpy.typing import NDArray

from collaudit.core.conditioning.measured.calm_stretches import CHANCE, Noise
from collaudit.core.numeric.arrays import BoolArray, FloatArray
from collaudit.core.numeric.runs import marked, run_bounds

#: So many times as many values have to agree as would if each were drawn anew: noise is not, and less in slow motion.
_DEPENDENT = 2
#: A channel two of whose values are the same more often than this is too coarse to tell.
_MOST_ALIKE = 0.1
#: Values from which it is told how often two are the same.
_DRAWN = 1 << 14
#: What a hash is multiplied by before the next value is added: odd, its bits mixed (2^64 / golden ratio).
_FACTOR, _FOLD = np.uint64(0x9E3779B97F4A7C15), np.uint64(29)
_Hashes = NDArray[np.uint64]


def repeated_rows(x: FloatArray, noise: Noise, usual: BoolArray, least: int) -> BoolArray | None:
    """(n,) rows of runs that occurred before in the same order; None without any.

    The first of them counts as measured. If it was the copy, the log holds a stretch without measurement all the same.

    Values that are held count once. How many have to agree follows from how often two values of the channel do.

    Args:
        x: (n,) channel.
        noise: of it; one that was computed repeats where its motion does, a coarse one by chance.
        usual: (n,) rows that are looked at.
        least: samples.
    """
    return _repeated(_bits(x), usual & np.isfinite(x), least) if noise.varied else None


def repeated_rows_of_all(values: FloatArray, usual: BoolArray, least: int) -> BoolArray | None:
    """As :func:`repeated_rows`, where several channels (n, c) repeat together: fewer samples tell that."""
    key = np.zeros(values.shape[0], dtype=np.uint64)
    for column in values.T:
        _add(key, _bits(column))
    return _repeated(key, usual & np.isfinite(values.sum(axis=1)), least)


def _bits(x: FloatArray) -> _Hashes:
    return (x + 0.0).view(np.uint64)  # -0.0 is 0.0


def _add(key: _Hashes, value: _Hashes) -> None:
    """Add values to hashes, in place."""
    key *= _FACTOR
    key ^= key >> _FOLD
    key += value


def _repeated(value: _Hashes, usual: BoolArray, least: int) -> BoolArray | None:
    fresh = np.flatnonzero(np.concatenate(([True], value[1:] != value[:-1])) & usual)
    if fresh.size < 2:
        return None
    values = value[fresh]
    alike = _alike(values)
    if alike > _MOST_ALIKE:
        return None
    count = _DEPENDENT * ceil(log(0.5 * fresh.size**2 / CHANCE) / -log(alike))
    if fresh.size < 2 * count:
        return None
    starts, stops = run_bounds(_again(values, count))
    starts, stops = fresh[starts], fresh[stops + count - 2] + 1
    long = stops - starts >= least
    return marked(starts[long], stops[long], value.size) if long.any() else None


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
