"""An empirical null: how high a quantity rises by itself, told from the bulk of its peaks."""

from __future__ import annotations

from dataclasses import dataclass
from math import exp, log, sqrt

import numpy as np
from scipy.special import gammaincinv as gamma_quantile

from collaudit.core.numeric.arrays import BoolArray, FloatArray

#: False alarms of the arm an hour that automatic thresholds expect.
ARM_PER_HOUR = 0.1
#: On top, for motion that is not quite the evidence's.
MARGIN = 1.2
#: ... and so much more where there are hardly enough peaks; it falls with the root of the time.
_LITTLE = 1.0
#: The zero of a torque differs from day to day by a tenth of a newton metre; one log does not show it. Together with a
#: zero that is followed by a quarter of the threshold so much covers that, N·m.
ZERO_DOUBT_NM = 0.08
#: Neighbouring samples share their error: one peak is taken of each stretch, s.
BLOCK_S = 0.25
#: Peaks without which nothing is told: 3 s.
FEWEST_BLOCKS = 12
#: The law of the peaks is read off between these shares of them, the highest left out.
_HIGHEST, _BULK = 0.1, 0.5
#: Peaks are contact where the law would pass their level once in so many such logs.
_EXCLUDED = 20.0
_ROUNDS = 6


def margin_after(seconds: float) -> float:
    """What a level is multiplied by, for other recordings of the arm than the evidence of so many seconds of motion.

    By recordings that were fitted and judged apart (docs/evidence.md, "Doubt of little evidence").
    """
    return MARGIN + _LITTLE * sqrt(BLOCK_S * FEWEST_BLOCKS / max(seconds, BLOCK_S * FEWEST_BLOCKS))


@dataclass(frozen=True, slots=True)
class NullTail:
    """How high a quantity rises by itself, from the bulk of its peaks and a tail model: an empirical null.

    Some of the evidence may be contact that nobody marked, and a short log has no tail. So nothing is taken from the
    largest values: the law of the peaks is read off where most of them lie (Efron, J. Am. Stat. Assoc. 99, 2004). The
    squares of the peaks of a sum of many bounded or Gaussian errors thin out exponentially; normalised spacings between
    their order statistics tell the rate of that (Renyi 1953), with no peak of the highest tenth.
    The law: P(peak² > x) = share · exp(-(x - start) / slope), x >= start.

    Attributes:
        start, slope: of the squares of the peaks.
        share: of the blocks with a peak above the start.
        spacings: that the slope was told from: 2 · spacings · slope / slope_true is chi-squared with as many degrees.
        per_hour: blocks an hour.
    """

    start: float
    slope: float
    share: float
    spacings: int
    per_hour: float

    def level(self, rate_per_hour: float) -> float:
        """The level that is expected to be passed so often."""
        times = max(self.share * self.per_hour / rate_per_hour, 1.0)
        return sqrt(self.start + self.slope * log(times))

    def rate(self, level: float, slope_factor: float = 1.0) -> float:
        """Expected alarms an hour above a level; of a slope that many times as large."""
        over = max(level**2 - self.start, 0.0)
        return self.share * self.per_hour * exp(-over / (self.slope * slope_factor))

    def ceiling(self, blocks: int) -> float:
        """The level above which a peak of so many blocks is contact: once in ``_EXCLUDED`` such logs it is none."""
        return sqrt(max(self.start + self.slope * log(self.share * blocks * _EXCLUDED), 0.0))

    def interval(self, level: float) -> tuple[float, float]:
        """95 % interval of :meth:`rate`, from what the number of spacings leaves open of the slope."""
        low, high = (self.spacings / float(gamma_quantile(self.spacings, p)) for p in (0.975, 0.025))
        return self.rate(level, low), self.rate(level, high)


def null_tail(peaks: FloatArray, contact_free: bool = False) -> NullTail | None:
    """The law of peaks (b,), one of each block of motion; None where they are too few, or do not differ.

    Peaks that the law all but excludes are contact, the other component: the law is read off again without them.

    Args:
        peaks: of the blocks.
        contact_free: there is no contact among them, and all of them count.
    """
    squares = np.sort(peaks**2)[::-1]
    if contact_free:
        return _law(squares, robust=False) if squares.size >= FEWEST_BLOCKS else None
    kept, tail = squares, None
    for round_ in range(_ROUNDS):
        if kept.size < FEWEST_BLOCKS:
            return None
        tail = _law(kept, robust=round_ == 0)
        if tail is None:
            return None
        rest = squares[squares <= tail.ceiling(kept.size) ** 2]
        if rest.size == kept.size and round_ > 0:
            break
        kept = rest
    return tail


def _law(squares: FloatArray, robust: bool) -> NullTail | None:
    """From squares in falling order; ``robust`` against a gap between contact and the rest."""
    first, last = int(_HIGHEST * squares.size), int(_BULK * squares.size)
    spacing = np.arange(first + 1, last + 1) * (squares[first:last] - squares[first + 1 : last + 1])
    slope = float(np.median(spacing)) / log(2.0) if robust else float(spacing.mean())
    if not slope > 0.0:
        slope = float(spacing.mean())
    if not slope > 0.0:
        return None
    return NullTail(float(squares[last]), slope, (last + 0.5) / squares.size, spacing.size, 3600.0 / BLOCK_S)


def block_peaks(level: FloatArray, counts: BoolArray, period_s: float) -> FloatArray:
    """(b,) the highest of (n,) levels in each block of time of which more than half counts."""
    length = max(1, round(BLOCK_S / period_s))
    blocks = level.size // length
    whole = slice(0, blocks * length)
    peaks = level[whole].reshape(blocks, length).max(axis=1, initial=0.0)
    return np.asarray(peaks[counts[whole].reshape(blocks, length).mean(axis=1) > 0.5])
