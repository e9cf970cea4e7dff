"""Filters over stretches and columns against SciPy's over the whole signal."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import butter, filtfilt, lfilter, lfilter_zi

from collaudit.core.numeric.arrays import Span
from collaudit.core.numeric.filters import filtered, low_pass

B, A = butter(2, 0.08)


@pytest.mark.parametrize("length", [64, 1000, 70_000])
@pytest.mark.parametrize("columns", [1, 2, 7])
def test_both_ways_is_filtfilt(length: int, columns: int) -> None:
    x = np.random.default_rng(1).normal(size=(length, columns))
    out = filtered(B, A, x, [Span(0, length)], both_ways=True)
    np.testing.assert_array_equal(out, filtfilt(B, A, x, axis=0, padlen=0))


@pytest.mark.parametrize("length", [400, 5000, 70_001])
@pytest.mark.parametrize("bandwidth_hz", [4.0, 20.0, 90.0])
def test_the_low_pass_is_a_butterworth_filter_forward_and_backward(length: int, bandwidth_hz: float) -> None:
    """Continued by its point reflection, far enough for the recursion to have settled, it is SciPy's."""
    period_s = 0.002
    x = np.cumsum(np.random.default_rng(6).normal(size=(length, 2)), axis=0)
    corner = 2.0 / np.pi * np.arctan(np.tan(np.pi * bandwidth_hz * period_s) / (np.sqrt(2.0) - 1.0) ** 0.25)
    pad = min(length - 1, int(10.0 / (bandwidth_hz * period_s)))
    wanted = filtfilt(*butter(2, corner), x, axis=0, padtype="odd", padlen=pad)
    inside = slice(None) if pad < length - 1 else slice(length // 3, 2 * length // 3)
    out = low_pass(x, [Span(0, length)], period_s, bandwidth_hz)
    np.testing.assert_allclose(out[inside], wanted[inside], atol=1e-9 * np.abs(x).max())


@pytest.mark.parametrize("length", [1, 2, 5, 40])
def test_a_straight_stretch_is_left_as_it_is_however_short(length: int) -> None:
    x = 3.0 + 0.5 * np.arange(float(length))
    np.testing.assert_allclose(low_pass(x, [Span(0, length)], 0.002, 20.0), x, atol=1e-9)


@pytest.mark.parametrize("length", [1, 64, 1000])
def test_forward_starts_settled(length: int) -> None:
    x = np.random.default_rng(2).normal(size=(length, 3))
    out = filtered(B, A, x, [Span(0, length)], both_ways=False)
    zi = lfilter_zi(B, A)[:, None] * x[:1]
    np.testing.assert_allclose(out, lfilter(B, A, x, axis=0, zi=zi)[0], atol=1e-12)


def test_stretches_do_not_see_each_other_and_holes_are_bridged() -> None:
    x = np.random.default_rng(3).normal(size=(400, 2))
    x[150, 1] = np.nan
    spans = [Span(10, 120), Span(130, 390)]
    out = filtered(B, A, x, spans, both_ways=True)
    assert np.isnan(out[:10]).all() and np.isnan(out[120:130]).all() and np.isnan(out[390:]).all()
    alone = filtered(B, A, x[10:120], [Span(0, 110)], both_ways=True)
    np.testing.assert_array_equal(out[10:120], alone)
    straight = x.copy()
    straight[150, 1] = 0.5 * (x[149, 1] + x[151, 1])
    np.testing.assert_allclose(out, filtered(B, A, straight, spans, both_ways=True), atol=1e-12)
