"""Constants and small estimators of statistics that several rooms use, each in one place."""

from __future__ import annotations

import numpy as np

from collaudit.core.numeric.arrays import FloatArray

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


def robust_sd(deviation: FloatArray) -> float:
    """Standard deviation by the median absolute deviation; (n,) deviations from their centre, without NaN."""
    return SD_PER_MAD * float(np.median(np.abs(deviation)))


def parabola_minimum(before: FloatArray, at: FloatArray, after: FloatArray) -> FloatArray:
    """Where the parabola through three values has its minimum, in steps from the middle one; 0 where it has none.

    Args:
        before, at, after: values one step before, at and after the middle, of any shape that they share.
    """
    bend = before - 2.0 * at + after
    return np.asarray(np.where(bend > 0, 0.5 * (before - after) / np.where(bend > 0, bend, 1.0), 0.0))
