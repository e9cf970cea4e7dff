"""Warm-up and ripple against what was put in."""

from __future__ import annotations

import numpy as np
import pytest

from collaudit.core.identification.trends import ripple, warm_up


def test_a_warm_up_trend_lies_in_its_interval() -> None:
    t = np.arange(0, 300, 0.01)
    friction = 8.0 * np.sign(np.sin(0.9 * t)) + 4.0 * np.sin(0.9 * t)
    hits = 0
    for seed in range(40):
        noise = 0.3 * np.random.default_rng(seed).standard_normal(t.size)
        found = warm_up(t, -0.01 * friction * t / 60.0 + noise, friction)
        assert found is not None
        assert found.per_minute == pytest.approx(-0.01, abs=0.001)
        hits += found.ci95[0] <= -0.01 <= found.ci95[1]
    assert 33 <= hits <= 40


def test_a_short_log_has_no_warm_up() -> None:
    t = np.arange(0, 30, 0.01)
    assert warm_up(t, np.zeros(t.size), np.ones(t.size)) is None


def test_ripple_is_found_with_its_frequency_and_share() -> None:
    rng = np.random.default_rng(0)
    q = 0.5 * np.sin(0.7 * np.arange(0, 60, 0.002))
    wave = 0.8 * np.sin(200 * q + 0.4)
    found = ripple(q, wave + 0.4 * rng.standard_normal(q.size))
    assert found is not None
    assert found.cycles_per_turn == pytest.approx(200, abs=2)
    assert found.amplitude_nm == pytest.approx(0.8, rel=0.15)
    assert found.explained == pytest.approx(0.32 / (0.32 + 0.16), abs=0.15)
    quiet = ripple(q, 0.4 * rng.standard_normal(q.size))
    assert quiet is not None
    assert quiet.explained < 0.02
