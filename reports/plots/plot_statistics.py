"""How one joint's residual is spread, how long it remembers, and how its level moves over the log."""

from __future__ import annotations

import numpy as np
from markupsafe import Markup

from collaudit.core.numeric.arrays import BoolArray, FloatArray
from collaudit.reports.plots.downsample import column_edges
from collaudit.reports.plots.joint_trace import JointTrace
from collaudit.reports.plots.svg import Panel, drawing

_WIDTH, _HEIGHT = 170, 56
_BINS = 41
_PIECES = 40
_LAG_S = 0.5
_LAGS = 60
_MOST = 131_072
_LEAST = 100


def draw_histogram(trace: JointTrace, name: str, label: str) -> Markup | None:
    """Judged residual within ±1.2 γ (all of it without γ); None where too little was judged."""
    known = _known(trace)
    if np.count_nonzero(known) < _LEAST:
        return None
    reach = 1.2 * trace.gamma_nm
    if not np.isfinite(reach):
        reach = float(np.abs(trace.residual_nm[known]).max()) or 1.0
    counts, edges = np.histogram(np.clip(trace.residual_nm[known], -reach, reach), _BINS, (-reach, reach))
    panel = Panel((0, 2, _WIDTH, _HEIGHT - 4), (-reach, reach), (0.0, float(counts.max())))
    across, up = np.repeat(edges, 2)[1:-1], np.repeat(counts, 2).astype(np.float64)
    panel.area(across, np.zeros(up.size), up, "bar-fill")
    if np.isfinite(trace.gamma_nm):
        for sign in (-1, 1):
            panel.moments([sign * trace.gamma_nm], "gamma")
    return drawing(_WIDTH, _HEIGHT, label, [panel], name)


def draw_autocorrelation(trace: JointTrace, name: str, label: str) -> Markup | None:
    """Autocorrelation of the judged residual up to half a second; None where no judged stretch is twice that long."""
    lags, values = autocorrelation(trace)
    if lags.size == 0:
        return None
    panel = Panel((0, 2, _WIDTH, _HEIGHT - 4), (0.0, float(lags[-1])), (min(-0.2, float(values.min())), 1.0))
    panel.level(0.0, "zero")
    panel.line(lags, values, "curve")
    return drawing(_WIDTH, _HEIGHT, label, [panel], name)


def autocorrelation(trace: JointTrace) -> tuple[FloatArray, FloatArray]:
    """Lags, s, and correlation (k,) of the judged residual less its mean, over pairs that were both judged."""
    known = _known(trace)[:_MOST]
    if np.count_nonzero(known) < _LEAST:
        return np.empty(0), np.empty(0)
    x = np.where(known, trace.residual_nm[: known.size], 0.0)
    x = np.where(known, x - x[known].mean(), 0.0)
    samples = np.unique(np.linspace(0, min(_LAG_S / trace.period_s, known.size / 2), _LAGS).astype(int))
    length = 1 << int(np.ceil(np.log2(x.size + samples[-1] + 1)))
    sums, pairs = (_products(y, length)[samples] for y in (x, known.astype(np.float64)))
    enough = pairs >= _LEAST / 2
    if not enough.any() or sums[0] <= 0:
        return np.empty(0), np.empty(0)
    covariance = sums[enough] / pairs[enough]
    return samples[enough] * trace.period_s, covariance / covariance[0]


def _products(x: FloatArray, length: int) -> FloatArray:
    """Sums of x(t) x(t + lag) for every lag up to ``length`` less the size of ``x`` (Wiener-Khinchin)."""
    spectrum = np.fft.rfft(x, length)
    return np.fft.irfft(spectrum * spectrum.conj(), length)


def draw_trend(trace: JointTrace, name: str, label: str) -> Markup | None:
    """RMS of the judged residual in forty equal stretches of the log; None where too little was judged."""
    known = _known(trace)
    if np.count_nonzero(known) < _LEAST:
        return None
    edges = column_edges(known.size, _PIECES)
    power, counts = (np.add.reduceat(x, edges[:-1]) for x in (np.where(known, trace.residual_nm**2, 0.0), 1.0 * known))
    rms = np.sqrt(np.divide(power, counts, out=np.full(_PIECES, np.nan), where=counts > 0))
    middle = trace.time_s[(edges[:-1] + edges[1:]) // 2]
    panel = Panel(
        (0, 2, _WIDTH, _HEIGHT - 4), (trace.time_s[0], trace.time_s[-1]), (0.0, 1.1 * float(np.nanmax(rms)) or 1.0)
    )
    panel.line(middle, rms, "curve")
    return drawing(_WIDTH, _HEIGHT, label, [panel], name)


def _known(trace: JointTrace) -> BoolArray:
    return trace.judged & np.isfinite(trace.residual_nm)
