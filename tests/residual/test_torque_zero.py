"""The zero of a torque: a slow drift is none of a contact's business, and a contact is none of the zero's."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.residual.followed_offsets import BOUND_SHARE, balanced_zero, follow_level, follow_zero

PERIOD, GAMMA = 0.01, 0.5
TIME = np.arange(0.0, 300.0, PERIOD)
BOUND = BOUND_SHARE * GAMMA


def residual(torque: FloatArray, causal: bool = False) -> FloatArray:
    """What is left of a torque, in half of which the joint slides."""
    found = follow_zero(torque, TIME % 4.0 < 2.0, PERIOD, BOUND, causal)
    assert found is not None
    return np.asarray(torque - found.offset_nm)


def noise(seed: int = 1) -> FloatArray:
    return np.random.default_rng(seed).normal(0.0, 0.05, TIME.size)


@pytest.mark.parametrize("causal", [False, True])
def test_a_slow_drift_is_followed(causal: bool) -> None:
    drift = 0.1 * np.sin(2.0 * np.pi * TIME / 900.0)
    left = residual(drift + noise(), causal) - noise()
    assert np.abs(left[12_000:]).max() < 0.045
    assert np.abs(residual(0.1 + noise())).max() < 0.3 < GAMMA


@pytest.mark.parametrize(("start_s", "lasts_s"), [(100.0, 10.0), (0.0, 150.0), (150.0, 150.0)], ids=str)
@pytest.mark.parametrize("causal", [False, True])
def test_a_person_who_leans_and_a_clamp_over_half_the_log_still_alarm(
    start_s: float, lasts_s: float, causal: bool
) -> None:
    inside = (start_s <= TIME) & (start_s + lasts_s > TIME)
    left = residual(1.3 * GAMMA * inside + noise(), causal)[inside] - noise()[inside]
    assert left.min() >= 1.05 * GAMMA - 1e-9


@settings(deadline=None)
@given(st.floats(-50.0, 50.0), st.integers(0, 2**16))
def test_it_stays_within_its_bound(level: float, seed: int) -> None:
    found = follow_zero(level * noise(seed), np.ones(TIME.size, bool), PERIOD, BOUND, False)
    assert found is not None and np.abs(found.offset_nm).max() <= BOUND


def test_a_causal_zero_knows_the_past_only() -> None:
    torque = noise()
    later = torque + 3.0 * (TIME >= 200.0)
    before = TIME < 200.0
    np.testing.assert_array_equal(residual(torque, True)[before], residual(later, True)[before])


def test_a_joint_that_hardly_slides_has_no_zero() -> None:
    assert follow_zero(noise(), np.zeros(TIME.size, bool), PERIOD, BOUND, False) is None
    assert follow_zero(noise()[:30], np.ones(30, bool), PERIOD, BOUND, False) is None


@pytest.mark.parametrize("share", [0.8, 1.15])
@pytest.mark.parametrize("forward_s", [1.0, 2.0, 3.0])
def test_a_zero_is_not_taken_for_the_level_of_friction(share: float, forward_s: float) -> None:
    """Half as large as the friction, it leaves least absolute deviations free to choose any level between."""
    velocity = np.where(forward_s > TIME % 4.0, 0.5, -0.5)
    friction, zero = 0.4 * np.sign(velocity), 0.2
    excess, every = zero + (share - 1.0) * friction + noise(), np.ones(TIME.size, bool)
    found = balanced_zero(excess, velocity, every, PERIOD, False)
    assert np.abs(found - zero).max() < 0.03
    level = follow_level(excess - found, friction, every, PERIOD, 0.15, False)
    assert np.abs(1.0 + level.deviation - share).max() < 0.05


def test_one_direction_tells_no_zero() -> None:
    assert balanced_zero(noise(), np.ones(TIME.size), np.ones(TIME.size, bool), PERIOD, False) == 0.0
