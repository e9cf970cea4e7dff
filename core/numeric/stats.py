"""Constants and small estimators of statistics that several rooms use, each in one place."""

from __future__ import annotations

import numpy as np

from collaudit.core.numeric.arrays import FloatArray, IntArray
from collaudit.core.numeric.blocks import blocks

#: Standard errors in half of a 95 % interval, rounded as usual: intervals in results are this wide.
STANDARD_ERRORS_95 = 1.96
#: The same as the quantile of the normal distribution at 97.5 %, to set against quantiles of Student's t.
NORMAL_QUANTILE_975 = 1.959964
#: Standard deviations of a normal distribution in one median absolute deviation: 1 / Φ⁻¹(3/4).
SD_PER_MAD = 1.4826
#: Standard error of a median over that of a mean, of many normal values: sqrt(π/2).
MEDIAN_INEFFICIENCY = 1.2533
#: Huber's bound in standard deviations: 95 % of the efficiency of least squares on normal errors.
HUBER_BOUND = 1.345
#: Of more values than this so many are drawn; a place in order is looked for within so many standard errors.
_MANY, _DRAWN, _SIGMAS = 1 << 15, 4096, 3.0
#: Values at a time: with fewer, threads would wait for each other.
_PICKED_FROM = 1 << 18


def robust_sd(deviation: FloatArray) -> float:
    """Standard deviation by the median absolute deviation; (n,) deviations from their centre, without NaN."""
    return SD_PER_MAD * median_of(np.abs(deviation))


def median_of(x: FloatArray) -> float:
    """``np.median`` of (n,) numbers, none of them NaN.

    NumPy partitions at three places, which takes three times as long as at one, and twelve times as long as this.
    """
    if x.size == 0:
        return float("nan")
    low, high = in_order(x, (x.size - 1) // 2)
    return low if x.size % 2 else 0.5 * (low + high)


def quantile_of(x: FloatArray, share: float) -> float:
    """``np.quantile`` of (n,) numbers, n > 0, none of them NaN, at one share of them."""
    place = (x.size - 1) * share
    low, high = in_order(x, int(place))
    part, gap = place - int(place), high - low
    return low + gap * part if part < 0.5 else high - gap * (1.0 - part)  # NumPy's order of operations


def in_order(x: FloatArray, place: int) -> tuple[float, float]:
    """The values at a place and at the next in rising order of (n,) numbers, none of them NaN; the last one twice."""
    if x.size > _MANY:
        x, place = _near(x, place)
    after = min(place + 1, x.size - 1)
    parted = np.partition(x, [place, after])  # one place alone: 3 times as long, 40 where many are alike
    return float(parted[place]), float(parted[after])


def _near(x: FloatArray, place: int) -> tuple[FloatArray, int]:
    """Those of many values that lie about a place in rising order, and its place among them.

    Some of the values, drawn evenly over all, tell between which two it lies, most likely; those between are picked
    and those below counted. Where it does not lie between them, all values are handed back: the draw changes no result.
    Floyd and Rivest, Commun. ACM 18, 1975.
    """
    drawn = np.sort(x[drawn_places(x.size)])
    share = place / (x.size - 1)
    middle, margin = share * (_DRAWN - 1), _SIGMAS * np.sqrt(_DRAWN * share * (1.0 - share)) + 2.0
    low = drawn[int(middle - margin)] if middle >= margin else -np.inf
    high = drawn[int(middle + margin) + 1] if middle + margin + 1 < _DRAWN else np.inf
    below, parts = 0, []
    for block in blocks(x.size, _PICKED_FROM):
        under, up_to = x[block] < low, x[block] <= high
        below += int(np.count_nonzero(under))
        parts.append(x[block][np.not_equal(under, up_to, out=up_to)])
    inside = np.concatenate(parts)
    first = place - below
    needed = 1 if place == x.size - 1 else 2  # the value and the next
    return (inside, first) if 0 <= first <= inside.size - needed else (x, place)


def distinct(x: np.ndarray) -> np.ndarray:
    """``np.unique`` of (n,) numbers, none of them NaN, without its import of masked arrays."""
    ordered = np.sort(x)
    first = np.ones(ordered.size, dtype=np.bool_)
    np.not_equal(ordered[1:], ordered[:-1], out=first[1:])
    return ordered[first]


def drawn_places(size: int) -> IntArray:
    """Places in so many values, each in a stretch of its own and at another place of it: a period finds no echo."""
    number, golden = np.arange(_DRAWN), 0.5 * (np.sqrt(5.0) - 1.0)
    return np.asarray((number + number * golden % 1.0) * (size / _DRAWN), dtype=np.int64)


def parabola_minimum(before: FloatArray, at: FloatArray, after: FloatArray) -> FloatArray:
    """Where the parabola through three values has its minimum, in steps from the middle one; 0 where it has none.

    Args:
        before, at, after: values one step before, at and after the middle, of any shape that they share.
    """
    bend = before - 2.0 * at + after
    return np.asarray(np.where(bend > 0, 0.5 * (before - after) / np.where(bend > 0, bend, 1.0), 0.0))
