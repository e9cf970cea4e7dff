"""Warm-up, temperature and load against what was put in."""

from __future__ import annotations

import numpy as np
import pytest

from collaudit.core.data.identification_result import Trend, TrendFit
from collaudit.core.friction.friction_model import temperature_doubt, temperature_share
from collaudit.core.friction.friction_variation import any_law, friction_slope
from collaudit.core.numeric.stats import STANDARD_ERRORS_95


def motion(seconds: float = 300.0) -> tuple[np.ndarray, np.ndarray]:
    t = np.arange(0, seconds, 0.01)
    return t, 8.0 * np.sign(np.sin(0.9 * t)) + 4.0 * np.sin(0.9 * t)


def beside(t: np.ndarray, friction: np.ndarray) -> np.ndarray:
    return any_law(friction, np.abs(np.sin(0.9 * t)), 0.9 * np.cos(0.9 * t))


def test_a_warm_up_trend_lies_in_its_interval() -> None:
    t, friction = motion()
    hits = 0
    for seed in range(40):
        noise = 0.3 * np.random.default_rng(seed).standard_normal(t.size)
        found = friction_slope(t, -0.01 * friction * t / 60.0 + noise, friction, beside(t, friction), t / 60.0)
        assert found is not None
        assert found[0] == pytest.approx(-0.01, abs=0.001)
        hits += found[1][0] <= -0.01 <= found[1][1]
    assert 33 <= hits <= 40


def test_a_trend_with_temperature_lies_in_its_interval() -> None:
    t, friction = motion()
    warm = 25.0 + 8.0 * (1.0 - np.exp(-t / 90.0))
    hits = 0
    for seed in range(40):
        noise = 0.3 * np.random.default_rng(seed).standard_normal(t.size)
        found = friction_slope(t, -0.02 * friction * (warm - 30.0) + noise, friction, beside(t, friction), warm)
        assert found is not None
        assert found[0] == pytest.approx(-0.02, abs=0.002)
        hits += found[1][0] <= -0.02 <= found[1][1]
    assert 33 <= hits <= 40


def test_a_trend_that_the_law_has_taken_up_is_not_told_from_it() -> None:
    """An experiment that goes through the speeds while the arm warms up: the law fitted on it hides the trend."""
    t = np.arange(0, 300.0, 0.02)
    speed = 0.02 * 60.0 ** (t / 300.0)
    sign = np.sign(np.sin(2.0 * t))
    warm = 20.0 + 15.0 * (1.0 - np.exp(-t / 150.0))
    for returns in (0.0, 0.05):  # share of the time at one speed that comes back: only that tells anything
        again = np.where((t % 10.0) < 10.0 * returns, 0.6, speed)
        friction = sign * (8.0 + 4.0 * again)
        hits = 0
        for seed in range(8):
            noise = 0.3 * np.random.default_rng(seed).standard_normal(t.size)
            residual = -0.02 * friction * (warm - 30.0) + noise
            columns = np.column_stack([sign, sign * again, sign * np.exp(-20.0 * again)])
            residual = residual - columns @ np.linalg.lstsq(columns, residual, rcond=None)[0]
            found = friction_slope(t, residual, friction, any_law(friction, again, np.zeros(t.size)), warm)
            hits += found is None or (found[1][0] or 0.0) <= -0.02 <= (found[1][1] or 0.0)
        assert hits >= 7


def test_a_trend_with_load_lies_in_its_interval() -> None:
    t, friction = motion()
    load = np.abs(40.0 * np.sin(0.31 * t))
    hits = 0
    for seed in range(40):
        noise = 0.5 * np.random.default_rng(seed).standard_normal(t.size)
        residual = np.sign(friction) * 0.03 * (load - 20.0) + noise
        found = friction_slope(t, residual, np.sign(friction), beside(t, friction), load)
        assert found is not None
        assert found[0] == pytest.approx(0.03, abs=0.003)
        hits += found[1][0] <= 0.03 <= found[1][1]
    assert 33 <= hits <= 40


def test_too_little_says_nothing() -> None:
    t, friction = motion(15.0)
    assert friction_slope(t, np.zeros(t.size), friction, beside(t, friction), t) is None
    t, friction = motion()
    assert friction_slope(t, np.zeros(t.size), np.sign(friction), beside(t, friction), np.full(t.size, 7.0)) is None
    none = np.zeros(t.size)
    assert friction_slope(t, none, none, beside(t, friction), t) is None, "a law without friction"


def test_friction_beyond_the_fits_temperatures_is_held_at_its_ends() -> None:
    half = STANDARD_ERRORS_95 * 0.002
    ends = -0.01 - half, -0.01 + half
    trend = Trend("temperature", -0.01, ends, 20.0, "log", TrendFit(20.0, 40.0, mean=30.0, level=0.02))
    temperature = np.array([10.0, 20.0, np.nan, 40.0, 90.0])
    assert temperature_share(trend, temperature) == pytest.approx([1.12, 1.12, 1.02, 0.92, 0.92])
    assert temperature_doubt(trend, temperature) == pytest.approx(0.02)
