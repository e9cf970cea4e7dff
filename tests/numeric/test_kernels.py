"""Kernels against their closed-form answers: steps, delays, noise, gaps."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from collaudit.core.numeric.arrays import Span
from collaudit.core.numeric.filters import Kernel, butterworth, double_pole, first_order

T = 0.002
FAMILY = {"momentum": first_order, "filtered": butterworth, "eso": double_pole}


def whole(n: int) -> list[Span]:
    return [Span(0, n)]


def test_the_first_order_step_response_is_the_exponential() -> None:
    k = first_order(60.0, True)
    t = T * np.arange(500)
    ramp = np.minimum(t / T, 1.0)  # straight between samples: what the discretisation is exact for
    out = k.apply(ramp[:, None], whole(500), T)[:, 0]
    kt = 60.0 * t
    exact = 1.0 - (1.0 - math.exp(-60.0 * T)) / (60.0 * T) * np.exp(-(kt - 60.0 * T))
    assert np.allclose(out[1:], exact[1:], atol=1e-12)


@pytest.mark.parametrize("name", FAMILY)
@pytest.mark.parametrize("gain", [20.0, 60.0, 150.0])
def test_a_slow_ramp_is_delayed_by_the_stated_delay(name: str, gain: float) -> None:
    k = FAMILY[name](gain, True)
    t = T * np.arange(4000)
    out = k.apply(t[:, None], whole(4000), T)[:, 0]
    assert t[-1] - out[-1] == pytest.approx(k.delay_s, rel=1e-6)
    both = FAMILY[name](gain, False)
    middle = both.apply(t[:, None], whole(4000), T)[2000, 0]
    assert middle == pytest.approx(t[2000], abs=1e-6)
    assert both.delay_s == 0.0


@pytest.mark.parametrize("name", FAMILY)
@pytest.mark.parametrize("causal", [True, False])
def test_the_noise_gain_is_what_noise_shows(name: str, causal: bool) -> None:
    k = FAMILY[name](60.0, causal)
    noise = np.random.default_rng(0).normal(0, 1, (400_000, 1))
    out = k.apply(noise, whole(len(noise)), T)
    assert np.std(out) == pytest.approx(k.noise_gain(T), rel=0.03)


def test_the_noise_gain_of_the_first_order_in_closed_form() -> None:
    gain = first_order(60.0, True).noise_gain(T)
    assert gain == pytest.approx(math.sqrt(60.0 * T / 2.0), rel=0.05)  # sqrt(K T / 2) for K T << 1


@pytest.mark.parametrize("name", FAMILY)
def test_the_slope_is_the_derivative_of_the_smoothed_signal(name: str) -> None:
    k = FAMILY[name](60.0, True)
    t = T * np.arange(3000)
    x, dx = np.sin(3.0 * t), 3.0 * np.cos(3.0 * t)
    slope = k.slope(x[:, None], whole(3000), T)[:, 0]
    smooth = k.apply(dx[:, None], whole(3000), T)[:, 0]
    assert np.allclose(slope[500:], smooth[500:], atol=1e-3)  # K T² x'' / 2 from the last straight piece


def test_only_causal_kernels_have_a_slope() -> None:
    with pytest.raises(ValueError, match="causal kernel"):
        first_order(60.0, False).slope(np.zeros((10, 1)), whole(10), T)


@settings(deadline=None)  # the first call imports scipy.signal
@given(st.integers(1, 40), st.integers(0, 20), st.sampled_from(sorted(FAMILY)), st.booleans())
def test_nothing_passes_a_gap(before: int, gap: int, name: str, causal: bool) -> None:
    k: Kernel = FAMILY[name](60.0, causal)
    n = before + gap + 50
    x = np.zeros((n, 1))
    x[:before] = 100.0
    spans = [Span(0, before), Span(before + gap, n)]
    out = k.apply(x, spans, T)
    assert np.allclose(out[:before], 100.0)
    assert np.all(np.isnan(out[before : before + gap]))
    assert np.allclose(out[before + gap :], 0.0)


@pytest.mark.parametrize("causal", [True, False])
def test_missing_samples_stay_missing_as_far_as_they_are_felt(causal: bool) -> None:
    k = first_order(60.0, causal)
    x = np.ones((1000, 1))
    x[500:520] = np.nan
    out = k.apply(x, whole(1000), T)[:, 0]
    assert np.all(np.isnan(out[500:520]))
    missing = np.flatnonzero(np.isnan(out))
    assert 525 < missing.max() < 560
    assert (missing.min() < 500) is not causal
    assert np.allclose(out[~np.isnan(out)], 1.0)


@pytest.mark.parametrize("samples", [1, 13, 100])
def test_the_share_of_a_short_push(samples: int) -> None:
    """K/(s + K) on a push of length d between samples: 1 - exp(-K d), and 1 - exp(-K d / 2) when run both ways."""
    seconds = samples * T
    forward = first_order(60.0, True).push_response(samples, T)[0].max()
    assert 1.0 - np.exp(-60.0 * (seconds - T)) <= forward <= 1.0 - np.exp(-60.0 * (seconds + T))
    both = first_order(60.0, False).push_response(samples, T)[0].max()
    assert 1.0 - np.exp(-30.0 * (seconds - T)) <= both <= 1.0 - np.exp(-30.0 * (seconds + T))


@pytest.mark.parametrize("causal", [True, False])
def test_what_weighs_too_much_is_missing_in_every_column(causal: bool) -> None:
    rng = np.random.default_rng(9)
    kernel = double_pole(60.0, causal)
    segments = [Span(0, 2500), Span(2600, 8000)]
    x = rng.normal(size=(8000, 3))
    x[:, 0][rng.random(8000) < 0.002] = np.nan
    x[3000:3100, 2] = np.nan
    found = kernel.apply(x, segments, T)
    inside = np.zeros((8000, 1), dtype=bool)
    for span in segments:
        inside[span.slice] = True
    unknown = ~inside | kernel.reach(~np.isfinite(x), segments, T)
    assert np.array_equal(np.isnan(found), unknown)
    assert unknown[:2500, 0].any() and not unknown[:2500, 0].all() and not unknown[:2500, 1].any()


def test_a_kernel_has_coefficients_of_its_own_for_each_sample_period() -> None:
    """They are kept from one use to the next; a ramp t comes out as t - (1 - exp(-K t)) / K, whatever the period."""
    kernel = first_order(20.0, causal=True)
    for period in (0.002, 0.01, 0.002):
        t = period * np.arange(round(0.5 / period))
        ramp = kernel.apply(t[:, None], [Span(0, t.size)], period)[:, 0]
        np.testing.assert_allclose(ramp, t - (1.0 - np.exp(-20.0 * t)) / 20.0, atol=1e-12)


@pytest.mark.parametrize("gain", [20.0, 900.0])
def test_a_kernel_is_exact_for_inputs_that_are_straight_between_samples(gain: float) -> None:
    """The double pole's answer to a ramp of slope 1 is t - 2/w + (t + 2/w) exp(-w t)."""
    t = T * np.arange(600)
    out = double_pole(gain, True).apply(t[:, None], whole(600), T)[:, 0]
    assert np.allclose(out, t - 2.0 / gain + (t + 2.0 / gain) * np.exp(-gain * t), atol=1e-12)
