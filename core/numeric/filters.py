"""Filters over gap-free stretches; SciPy loads ``scipy.signal`` at the first recursive one."""

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
    """Low-pass each stretch without delay: a second-order Butterworth filter forward and backward.

    Both passes together have the gain 1 / (1 + (tan(π f T) / tan(π f_c T))⁴), with f_c where one of them is at -3 dB.
    It is applied as such, block by block, in place of the recursion of ``scipy.signal.filtfilt``, which gives the
    same to rounding: importing that package costs more than judging a minute of log. Each stretch is continued by its
    point reflection at both ends.

    Args:
        x: (n,) or (n, j); NaN inside a stretch is bridged for the filter and stays NaN in the result.
        segments: gap-free stretches; outside them the result is NaN.
        period_s: sample period, s.
        bandwidth_hz: -3 dB frequency of both passes together, Hz.
    """
    corner = math.tan(min(math.pi * bandwidth_hz * period_s, 1.5)) / _TWO_PASS  # tan(π f_c T)
    out = blank(x, segments)
    if corner >= _NOTHING_ABOVE:
        for span in segments:
            out[span.slice] = x[span.slice]
        return out
    reach = math.ceil(_REACH_PERIODS / (bandwidth_hz * period_s))
    size = 1 << (_BLOCK_REACHES * reach).bit_length()
    gain = 1.0 / (1.0 + (np.tan(np.pi * np.fft.rfftfreq(size)) / corner) ** 4)
    columns, results = np.atleast_2d(x.T), np.atleast_2d(out.T)

    def run(c: int) -> None:
        for span in segments:
            if len(span):
                part, missing = _bridged(columns[c, span.slice, None])
                smooth = _in_blocks(part[:, 0], gain, reach, size)
                results[c, span.slice] = smooth if missing is None else np.where(missing[:, 0], np.nan, smooth)

    each(run, range(len(columns)))
    return out


#: tan(π f T) of a corner at 0.95 of the Nyquist frequency: above it there is nothing to remove.
_NOTHING_ABOVE = math.tan(0.475 * math.pi)
#: Periods of the -3 dB frequency after which the filter's response to an impulse is below 1e-14 of its peak.
_REACH_PERIODS = 10.0
#: Reaches in a block, at least: two of them are computed twice.
_BLOCK_REACHES = 8


def _in_blocks(x: FloatArray, gain: FloatArray, reach: int, size: int) -> FloatArray:
    """(n,) filtered by a real gain (size / 2 + 1,), in blocks that overlap by the filter's reach to either side."""
    step = size - 2 * reach
    continued = np.pad(x, (reach, reach + -len(x) % step), mode="reflect", reflect_type="odd")
    blocks = np.lib.stride_tricks.sliding_window_view(continued, size)[::step]
    smooth = np.fft.irfft(np.fft.rfft(blocks) * gain, size)
    return np.asarray(smooth[:, reach:-reach].ravel()[: len(x)])


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
) -> tuple[FloatArray, BoolArray | None]:
    """Run a recursive filter over each stretch, starting settled at its first value.

    Args:
        b, a: numerator and denominator of a filter in z.
        x: (n, j); values that are not finite inside a stretch are bridged by straight lines.
        segments: gap-free stretches.
        both_ways: forward and then backward, without delay (``scipy.signal.filtfilt``); else forward only.

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
        result = out[span.slice]

        def run(columns: slice, part: FloatArray = part, result: FloatArray = result) -> None:
            values = part[:, columns]
            if both_ways:
                result[:, columns] = scipy.signal.filtfilt(b, a, values, axis=0, padlen=0)
            else:
                result[:, columns] = scipy.signal.lfilter(b, a, values, axis=0, zi=settled[:, None] * values[:1])[0]

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
