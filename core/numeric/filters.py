"""Zero-phase filters over gap-free stretches.

The functions of ``scipy.signal`` that a log needs, without its import, which takes longer than a minute of log.

``scipy.signal`` loads most of SciPy, 0.7 to 1.4 s of every command. Its compiled recursion is loaded alone, and by the
public way where SciPy has moved it; the rest are formulas of a few lines. Each is tested against the public function.
"""

from __future__ import annotations

import functools
import importlib.util
import math
from collections.abc import Sequence
from importlib.machinery import PathFinder
from typing import Any

import numpy as np

from collaudit.core.numeric.arrays import BoolArray, FloatArray, Span
from collaudit.core.numeric.parallel import each

_RECURSION, _FUNCTION = "_sigtools", "_linear_filter"


def lfilter(b: FloatArray, a: FloatArray, x: FloatArray, zi: FloatArray) -> FloatArray:
    """(n, j) result of a recursive filter along the columns: ``scipy.signal.lfilter`` with ``axis=0``.

    Args:
        b, a: numerator and denominator in z.
        x: (n, j).
        zi: (m, j) state before the first row.
    """
    return np.asarray(_recursion()(b, a, x, 0, zi)[0])


def filtfilt(b: FloatArray, a: FloatArray, x: FloatArray, padlen: int, zi: FloatArray) -> FloatArray:
    """(n, j) result of a filter run forward and backward: ``scipy.signal.filtfilt`` with ``axis=0``.

    Args:
        b, a: numerator and denominator in z.
        x: (n, j).
        padlen: rows by which both ends are continued by point reflection, less than n.
        zi: (m,) of :func:`lfilter_zi`.
    """
    before = 2.0 * x[:1] - x[padlen:0:-1]
    after = 2.0 * x[-1:] - x[-2 : -padlen - 2 : -1]
    whole = np.concatenate((before, x, after)) if padlen else x
    forward = lfilter(b, a, whole, zi[:, None] * whole[:1])
    both = lfilter(b, a, forward[::-1], zi[:, None] * forward[-1:])[::-1]
    return both[padlen : padlen + len(x)]


def lfilter_zi(b: FloatArray, a: FloatArray) -> FloatArray:
    """(m,) state of a filter whose input has been 1 for ever: ``scipy.signal.lfilter_zi``.

    It solves z = A z + B with A the transposed companion matrix of the denominator and B = b_k - a_k b_0.
    """
    size = max(b.size, a.size)
    b, a = (np.concatenate([x / a[0], np.zeros(size - x.size)]) for x in (b, a))
    companion = np.eye(size - 1, k=-1)
    companion[0] = -a[1:]
    return np.asarray(np.linalg.solve(np.eye(size - 1) - companion.T, b[1:] - a[1:] * b[0]))


def butterworth(corner: float) -> tuple[FloatArray, FloatArray]:
    """Numerator and denominator (3,) of the second-order low-pass: ``scipy.signal.butter(2, corner)``.

    Poles of the prototype at exp(±3πi/4), scaled to the warped corner, and the bilinear transform (A. V. Oppenheim,
    R. W. Schafer, *Discrete-Time Signal Processing*, ch. 7).

    Args:
        corner: -3 dB frequency as a share of half the sample rate, above 0 and below 1.
    """
    warped = 4.0 * np.tan(np.pi * corner / 2.0)
    poles = warped * -np.exp(1j * np.pi * np.array([-1.0, 1.0]) / 4.0)
    gain = warped**2 * np.real(1.0 / np.prod(4.0 - poles))
    return np.asarray(gain * np.array([1.0, 2.0, 1.0])), np.real(np.poly((4.0 + poles) / (4.0 - poles)))


def first_order_hold(numerator: FloatArray, denominator: FloatArray, period_s: float) -> tuple[FloatArray, FloatArray]:
    """A filter in s as one in z, exact for inputs that are straight between samples: ``cont2discrete``, ``foh``.

    The state space in controller canonical form, and the exponential of its block matrix (G. F. Franklin, J. D.
    Powell, M. L. Workman, *Digital Control of Dynamic Systems*, 6.3.2).

    Args:
        numerator, denominator: of the filter in s, highest power first, the numerator at most as long.
        period_s: sample period, s.
    """
    den = denominator / denominator[0]
    num = np.concatenate([np.zeros(den.size - numerator.size), numerator / denominator[0]])
    order = den.size - 1
    block = np.zeros((order + 2, order + 2))
    block[:order, :order] = np.eye(order, k=-1)
    block[0, :order] = -den[1:]
    block[0, order] = 1.0
    block *= period_s
    block[order, order + 1] = 1.0
    power = _exponential(block)
    a, before, after = power[:order, :order], power[:order, order], power[:order, order + 1]
    b = before - after + a @ after
    c = num[1:] - num[0] * den[1:]
    discrete = np.asarray(np.poly(a), dtype=np.float64)
    return np.asarray(np.poly(a - np.outer(b, c)) + (num[0] + c @ after - 1.0) * discrete), discrete


def _exponential(a: FloatArray) -> FloatArray:
    """(n, n) exponential of a small matrix: the power series of a part of it below 1/16, squared so many times."""
    halvings = max(0, int(np.ceil(np.log2(max(float(np.abs(a).sum(axis=1).max()), 1e-300)))) + 4)
    term = total = np.eye(len(a))
    for k in range(1, 14):
        term = term @ a / (2.0**halvings * k)
        total = total + term
    return np.asarray(np.linalg.matrix_power(total, 2**halvings))


@functools.cache
def _recursion() -> Any:
    """The compiled recursion: (b, a, x, axis, state before) -> (result, state after)."""
    package = importlib.util.find_spec("scipy")
    folders = [f"{folder}/signal" for folder in (package and package.submodule_search_locations) or ()]
    spec = PathFinder.find_spec(_RECURSION, folders)
    if spec is not None and spec.loader is not None:
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        if hasattr(module, _FUNCTION):
            return getattr(module, _FUNCTION)
    from scipy.signal import lfilter as public

    return lambda b, a, x, axis, zi: public(b, a, x, axis=axis, zi=zi)


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
    result, missing = filtered(*butterworth(corner), rows, segments, both_ways=True, pad=settle)
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
    settled = lfilter_zi(b, a)
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
                result[:, columns] = filtfilt(b, a, values, edge, settled)
            else:
                result[:, columns] = lfilter(b, a, values, settled[:, None] * values[:1])

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
