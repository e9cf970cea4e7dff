"""The record of an audit: excess of friction and load is found with an error that holds, and what is kept suffices."""

from __future__ import annotations

import numpy as np
import pytest

from collaudit.core.history.residual_shares import residual_shares

RATE_HZ = 100.0


def strokes(seconds: int, seed: int) -> tuple[np.ndarray, ...]:
    """(time, friction, rigid-body torque, error) of an arm that swings; errors last a tenth of a second."""
    rng = np.random.default_rng(seed)
    t = np.arange(0.0, seconds, 1 / RATE_HZ)
    friction = np.sign(np.sin(2 * np.pi * t / 7.3)) * (5.0 + 2.0 * np.abs(np.sin(2 * np.pi * t / 7.3)))
    rigid = 20.0 * np.cos(2 * np.pi * t / 7.3) + 3.0 * np.sin(2 * np.pi * t / 3.1)
    white = rng.normal(0.0, 0.2, t.size)
    return t, friction, rigid, np.convolve(white, np.ones(10), "same")


def test_intervals_hold_although_errors_last() -> None:
    truth = np.array([0.03, -0.02, 0.4])
    held = []
    for seed in range(150):
        t, friction, rigid, error = strokes(90, seed)
        found = residual_shares(t, truth[0] * friction + truth[1] * rigid + truth[2] + error, friction, rigid)
        assert found is not None and found.load is not None
        shares = (found.friction, found.load, found.offset)
        held.append([abs(s.value - x) < 2.0 * s.se for s, x in zip(shares, truth, strict=True)])
    assert np.all(np.mean(held, axis=0) > 0.88), np.mean(held, axis=0)


def test_what_motion_does_not_tell_is_none() -> None:
    t, friction, rigid, error = strokes(60, 0)
    assert residual_shares(t, error, np.abs(friction) * 0 + 5.0, rigid) is None  # one direction at one speed
    assert residual_shares(t[:900], error[:900], friction[:900], rigid[:900]) is None  # too short
    vertical = residual_shares(t, error, friction, 0.0 * rigid)
    assert vertical is not None and vertical.load is None


def test_gaps_and_missing_samples_do_not_count() -> None:
    t, friction, rigid, error = strokes(90, 1)
    y = 0.05 * friction + error
    y[::7] = np.nan
    found = residual_shares(t, y, friction, rigid)
    assert found is not None and found.friction.value == pytest.approx(0.05, abs=4 * found.friction.se)
