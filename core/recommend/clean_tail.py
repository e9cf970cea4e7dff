"""How often clean residuals would reach levels that the data have not shown: the tail of their peaks.

Peaks over a high level u are taken to exceed it by exponentially distributed amounts, the limit law of
light tails (Coles, An Introduction to Statistical Modeling of Extreme Values, 2001, ch. 4, shape 0). Residuals of
friction and ripple have bounded or Gaussian tails, which fall faster: for them the law overstates the rate.
"""

from __future__ import annotations

from math import exp, log

import numpy as np

from collaudit.core.dataclass import dataclass
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.numeric.special_functions import gamma_quantile

#: One peak a block: neighbouring samples share their cause, a reversal or a turn of the gear.
BLOCK_S = 1.0
#: The tail is the highest 1/20 of the blocks, and never fewer than 8 peaks: below that its slope is anybody's guess.
_SHARE, _FEWEST = 20, 8
#: Blocks that a tail needs.
FEWEST_BLOCKS = 40


@dataclass(frozen=True, slots=True)
class CleanTail:
    """Exponential tail of the peaks.

    Attributes:
        level_nm: u, the level the tail begins at.
        scale_nm: mean excess over u; its relative standard error is 1 / sqrt(peaks).
        scale_upper95_nm: its one-sided 95 % bound: 2 peaks scale / scale_true is chi-squared with 2 peaks degrees.
        peaks: number of peaks above u.
        hours: judged time they were seen in.
    """

    level_nm: float
    scale_nm: float
    scale_upper95_nm: float
    peaks: int
    hours: float

    def rate_per_hour(self, gamma_nm: float) -> float:
        """With 95 % confidence no more peaks an hour than this lie above a level at or over u."""
        return self.peaks / self.hours * exp(-(gamma_nm - self.level_nm) / self.scale_upper95_nm)

    def level_at(self, rate_per_hour: float) -> float:
        """The level that with 95 % confidence is exceeded no more often, N·m; u at least."""
        return self.level_nm + self.scale_upper95_nm * max(0.0, log(self.peaks / self.hours / rate_per_hour))


def clean_tail(peaks_nm: FloatArray, hours: float) -> CleanTail | None:
    """The tail of peaks, one a block of ``BLOCK_S``; None where they are too few, or do not differ."""
    if peaks_nm.size < FEWEST_BLOCKS or hours <= 0:
        return None
    count = max(_FEWEST, peaks_nm.size // _SHARE)
    ranked = np.sort(peaks_nm)[::-1]
    level = float(ranked[count])
    scale = float(np.mean(ranked[:count] - level))
    upper = count * scale / float(gamma_quantile(count, 0.05))
    return CleanTail(level, scale, upper, count, hours) if scale > 0 else None
