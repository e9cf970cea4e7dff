"""Filters of ``scipy.signal`` over gap-free stretches; SciPy loads that part of it at the first call."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import scipy

from collaudit.core.numeric.arrays import BoolArray, FloatArray, Span
from collaudit.core.numeric.parallel import each

#: Two passes of a second-order Butterworth filter shift its -3 dB point by (sqrt(2) - 1)^(1/4).
_TWO_PASS = (math.sqrt(2.0) - 1.0) ** 0.25
#: Periods of the -3 dB frequency after which nothing is left of how a stretch begins.
SETTLED_PERIODS = 1.5


def default_bandwidth_hz(period_s: float) -> float:
    """20 Hz, or a fifth of the sample rate where that is lower.

    20 Hz keeps contacts of 25 ms (an impulse is widened to about 22 ms) and holds the noise of a
    differentiated 500 Hz velocity below 0.5 rad/s².
    """
    return min(20.0, 0.2 / period_s)


def low_pass(x: FloatArray, segments: Sequence[Span], period_s: float, bandwidth_hz: float) -> FloatArray:
    """Low-pass each stretch forward and backward (no delay), second-order Butterworth twice.

    Args:
        x: (n,) or (n, j); NaN inside a stretch is bridged for the filter and stays NaN in the result.
        segments: gap-free stretches; outside them the result is NaN.
        period_s: sample period, s.
        bandwidth_hz: -3 dB frequency of both passes together, Hz.
    """
    warped = math.tan(min(math.pi * bandwidth_hz * period_s, 1.5)) / _TWO_PASS  # the bilinear transform's scale
    corner = 2.0 / math.pi * math.atan(warped)
    if corner >= 0.95:  # at or above Nyquist there is nothing to remove
        result = blank(x, segments)
        for span in segments:
            result[span.slice] = x[span.slice]
        return result
    settle = round(SETTLED_PERIODS / (bandwidth_hz * period_s))
    rows = x.reshape(x.shape[0], -1)
    result, missing = filtered(*scipy.signal.butter(2, corner), rows, segments, both_ways=True, pad=settle)
    if missing is not None:
        result[missing] = np.nan
    return result.reshape(x.shape)


#: Standard deviations of a Gaussian window after which nothing is left.
_WINDOW_REACH = 4.0


def window_reach(deviation: float) -> int:
    """Samples to either side that a Gaussian window with this standard deviation, in samples, reaches."""
    return math.ceil(_WINDOW_REACH * deviation)


def gaussian_smoothed(x: FloatArray, deviation: float) -> FloatArray:
    """(n,) smoothed by a Gaussian window, as if the first and last value had lasted.

    Args:
        x: (n,) values.
        deviation: standard deviation of the window, samples; 0 changes nothing.
    """
    if deviation == 0.0:
        return x
    reach = window_reach(deviation)
    weight = np.exp(-0.5 * np.square(np.arange(-reach, reach + 1) / deviation))
    lasting = np.concatenate([np.full(reach, x[0]), x, np.full(reach, x[-1])])
    return np.convolve(lasting, weight / weight.sum(), mode="valid")


def differentiate(x: FloatArray, segments: Sequence[Span], period_s: float) -> FloatArray:
    """Central differences of (n,) or (n, j) inside each stretch, one-sided at its ends, NaN outside."""
    out = blank(x, segments)
    slopes, columns = np.atleast_2d(out.T), np.atleast_2d(x.T)

    def fill(c: int) -> None:
        for span in segments:
            slopes[c, span.slice] = np.gradient(columns[c, span.slice], period_s) if len(span) > 1 else np.nan

    each(fill, range(len(columns)))
    return out


#: Values of a stretch from which on each of its columns is filtered alone, which takes less memory and several threads.
_LARGE = 1 << 17


def filtered(
    b: FloatArray,
    a: FloatArray,
    x: FloatArray,
    segments: Sequence[Span],
    *,
    both_ways: bool,
    pad: int = 0,
) -> tuple[FloatArray, BoolArray | None]:
    """Run a recursive filter over each stretch, starting settled.

    Args:
        b, a: numerator and denominator of a filter in z.
        x: (n, j); values that are not finite inside a stretch are bridged by straight lines.
        segments: gap-free stretches.
        both_ways: forward and then backward, without delay (``scipy.signal.filtfilt``); else forward only.
        pad: samples by which each stretch is continued by its point reflection at both ends (at most its length
            less one); 0 starts at the first value as if it had lasted for ever.

    Returns:
        (n, j) result, NaN outside the stretches; and (n, j) where values were bridged, None when nowhere.
    """
    out = blank(x, segments)
    settled = scipy.signal.lfilter_zi(b, a)
    bridged: BoolArray | None = None
    for span in segments:
        if len(span) == 0:
            continue
        part, missing = _bridged(x[span.slice])
        if missing is not None:
            bridged = np.zeros(x.shape, dtype=bool) if bridged is None else bridged
            bridged[span.slice] = missing
        result, edge = out[span.slice], min(pad, len(span) - 1)

        def run(columns: slice, part: FloatArray = part, result: FloatArray = result, edge: int = edge) -> None:
            values = part[:, columns]
            if both_ways:
                result[:, columns] = scipy.signal.filtfilt(b, a, values, axis=0, padlen=edge)
            else:
                start = settled[:, None] * values[:1]
                result[:, columns] = scipy.signal.lfilter(b, a, values, axis=0, zi=start)[0]

        each(run, _groups(x.shape[1], len(span)))
    return out, bridged


def blank(like: FloatArray, segments: Sequence[Span]) -> FloatArray:
    """An array of the same shape, NaN outside the stretches and not yet written inside them."""
    out = np.empty(like.shape, order="F")
    before = 0
    for span in segments:
        out[before : span.start] = np.nan
        before = span.stop
    out[before:] = np.nan
    return out


def _groups(columns: int, samples: int) -> list[slice]:
    """Columns that are filtered together: all of a short stretch, each of a long one alone."""
    return [slice(j, j + 1) for j in range(columns)] if samples * columns > _LARGE else [slice(0, columns)]


def _bridged(part: FloatArray) -> tuple[FloatArray, BoolArray | None]:
    """A stretch (m, j) with missing values filled by straight lines, and where they were, None when nowhere."""
    if np.isfinite(part.sum()):
        return part, None
    missing: BoolArray = ~np.isfinite(part)
    filled = part.copy()
    for column in np.flatnonzero(missing.any(axis=0)):
        hole = missing[:, column]
        known = np.flatnonzero(~hole)
        filled[hole, column] = np.interp(np.flatnonzero(hole), known, part[known, column]) if known.size else 0.0
    return filled, missing
