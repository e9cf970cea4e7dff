"""Zero-phase filters over gap-free stretches."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from collaudit.core.series import BoolArray, FloatArray, Span

#: Two passes of a second-order Butterworth filter shift its -3 dB point by (sqrt(2) - 1)^(1/4).
_TWO_PASS = (math.sqrt(2.0) - 1.0) ** 0.25


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
    from scipy.signal import butter, sosfiltfilt

    warped = math.tan(min(math.pi * bandwidth_hz * period_s, 1.5)) / _TWO_PASS  # the bilinear transform's scale
    corner = 2.0 / math.pi * math.atan(warped)
    out = np.full_like(x, np.nan)
    if corner >= 0.95:  # at or above Nyquist there is nothing to remove
        for span in segments:
            out[span.slice] = x[span.slice]
        return out
    sos = butter(2, corner, output="sos")
    settle = round(1.5 / (bandwidth_hz * period_s))
    for span in segments:
        part = x[span.slice]
        pad = min(settle, len(span) - 1)
        bridged, missing = _bridge(part)
        rows = np.ascontiguousarray(bridged.T)  # filters run several times faster along the contiguous axis
        out[span.slice] = sosfiltfilt(sos, rows, axis=-1, padtype="odd", padlen=pad).T
        if missing is not None:
            out[span.slice][missing] = np.nan
    return out


def differentiate(x: FloatArray, segments: Sequence[Span], period_s: float) -> FloatArray:
    """Central differences inside each stretch, one-sided at its ends; NaN outside."""
    out = np.full_like(x, np.nan)
    for span in segments:
        if len(span) >= 2:
            part, slope = x[span.slice], out[span.slice]
            np.subtract(part[2:], part[:-2], out=slope[1:-1])
            slope[1:-1] /= 2.0 * period_s
            slope[0], slope[-1] = (part[1] - part[0]) / period_s, (part[-1] - part[-2]) / period_s
    return out


def _bridge(part: FloatArray) -> tuple[FloatArray, BoolArray | None]:
    """Fill NaN linearly so that a filter can pass; returns the filled copy and where it was missing, if anywhere."""
    if np.isfinite(part.sum()):
        return part, None
    missing = ~np.isfinite(part)
    filled = part.copy().reshape(part.shape[0], -1)
    holes = missing.reshape(part.shape[0], -1)
    k = np.arange(part.shape[0])
    for column in range(filled.shape[1]):
        hole = holes[:, column]
        if hole.all():
            filled[:, column] = 0.0
        elif hole.any():
            filled[hole, column] = np.interp(k[hole], k[~hole], filled[~hole, column])
    return filled.reshape(part.shape), missing
