"""Zero-phase filters over gap-free stretches."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from collaudit.core.numeric.arrays import FloatArray, Span
from collaudit.core.numeric.iir_filter import blank, filtered
from collaudit.core.numeric.parallel import ordered_map
from collaudit.core.numeric.signal_filters import butterworth
from collaudit.core.numeric.tables import table

#: Two passes of a second-order Butterworth filter shift its -3 dB point by (sqrt(2) - 1)^(1/4).
_TWO_PASS = (math.sqrt(2.0) - 1.0) ** 0.25
#: Periods of the -3 dB frequency after which nothing is left of how a stretch begins.
SETTLED_PERIODS = 1.5
#: Values from which on columns are worth several threads.
_FOR_THREADS = 1 << 17


def default_bandwidth_hz(period_s: float) -> float:
    """20 Hz, or a fifth of the sample rate where that is lower.

    20 Hz keeps contacts of 25 ms (an impulse is widened to about 22 ms) and holds the noise of a
    differentiated 500 Hz velocity below 0.5 rad/s².
    """
    return min(20.0, 0.2 / period_s)


def low_pass(
    x: FloatArray, segments: Sequence[Span], period_s: float, bandwidth_hz: float, out: FloatArray | None = None
) -> FloatArray:
    """Low-pass each stretch forward and backward (no delay), second-order Butterworth twice.

    Args:
        x: (n,) or (n, j); NaN inside a stretch is bridged for the filter and stays NaN in the result.
        segments: gap-free stretches; outside them the result is NaN.
        period_s: sample period, s.
        bandwidth_hz: -3 dB frequency of both passes together, Hz.
        out: memory for the result, of the shape of ``x`` and other than it.
    """
    warped = math.tan(min(math.pi * bandwidth_hz * period_s, 1.5)) / _TWO_PASS  # the bilinear transform's scale
    corner = 2.0 / math.pi * math.atan(warped)
    rows = x.reshape(x.shape[0], -1)
    result = None if out is None else out.reshape(rows.shape)
    if corner >= 0.95:  # at or above Nyquist there is nothing to remove
        result = blank(rows, segments, result)
        for span in segments:
            result[span.slice] = rows[span.slice]
        return result.reshape(x.shape)
    settle = round(SETTLED_PERIODS / (bandwidth_hz * period_s))
    result, missing = filtered(*butterworth(corner), rows, segments, both_ways=True, pad=settle, out=result)
    if missing is not None:
        result[missing] = np.nan
    return result.reshape(x.shape)


def differentiate(
    x: FloatArray, segments: Sequence[Span], period_s: float, out: FloatArray | None = None
) -> FloatArray:
    """Central differences inside each stretch, one-sided at its ends, NaN outside; into ``out`` if that is given."""
    if x.ndim == 2 and x.shape[1] > 1 and x.size > _FOR_THREADS:
        slopes = table(*x.shape) if out is None else out
        for _ in ordered_map(lambda j: differentiate(x[:, j], segments, period_s, slopes[:, j]), range(x.shape[1])):
            pass
        return slopes
    out = blank(x, segments, out)
    for span in segments:
        if len(span) < 2:
            out[span.slice] = np.nan
        else:
            part, slope = x[span.slice], out[span.slice]
            np.subtract(part[2:], part[:-2], out=slope[1:-1])
            slope[1:-1] /= 2.0 * period_s
            slope[0], slope[-1] = (part[1] - part[0]) / period_s, (part[-1] - part[-2]) / period_s
    return out
