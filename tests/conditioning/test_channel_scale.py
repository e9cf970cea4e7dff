"""Step and noise of a channel: known ones are found, absent ones are not invented."""

from __future__ import annotations

import numpy as np
import pytest

from collaudit.core.conditioning.channel_scale import channel_scale

TIME_S = np.arange(20_000) * 0.002
MOTION = 1.3 * np.sin(0.7 * TIME_S) + 0.2 * np.sin(2.1 * TIME_S)


@pytest.mark.parametrize("step", [0.003, 0.0087890625, 2 * np.pi / 4096])
@pytest.mark.parametrize("decimals", [6, 15])
def test_the_step_is_found(step: float, decimals: int) -> None:
    values = np.round(np.round(MOTION / step) * step, decimals)
    found = channel_scale(values).step
    assert found == pytest.approx(step, rel=2e-3)


def test_an_uneven_signal_has_no_step() -> None:
    assert channel_scale(MOTION).step is None
    noisy = MOTION + np.random.default_rng(1).normal(0, 0.01, MOTION.size)
    assert channel_scale(noisy).step is None
    assert channel_scale(noisy.astype(np.float32).astype(float)).step is None


@pytest.mark.parametrize("noise", [0.002, 0.5])
def test_noise_is_within_its_interval_whatever_the_motion(noise: float) -> None:
    inside = 0
    for seed in range(40):
        values = 50 * MOTION + np.random.default_rng(seed).normal(0, noise, MOTION.size)
        found = channel_scale(values)
        assert found.noise is not None and found.noise_ci95 is not None
        assert found.noise == pytest.approx(noise, rel=0.05)
        inside += found.noise_ci95[0] <= noise <= found.noise_ci95[1]
    assert inside >= 36


def test_a_channel_that_stands_still_or_is_short_says_nothing() -> None:
    assert channel_scale(np.full(1000, 0.3)).noise is None
    assert channel_scale(np.arange(9.0)).noise is None
    assert channel_scale(np.full(1000, np.nan)).step is None
    coarse = np.round(MOTION / 0.05) * 0.05
    assert channel_scale(coarse).noise == 0.0 and channel_scale(coarse).step == pytest.approx(0.05)
    assert channel_scale(np.arange(1000) * 0.1 + 7).noise == 0.0, "rounding of float64 is no noise"
