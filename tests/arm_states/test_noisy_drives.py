"""Brakes that hold an arm whose efforts are noisy and offset, and what must not be taken for them."""

from __future__ import annotations

import numpy as np
import pytest

from collaudit.core.arm_states.drives_off import noisy_zero
from collaudit.core.numeric.arrays import run_bounds

PERIOD_S = 0.002
LOAD = np.array([0.0, -14.0, 9.0, 0.3])
OFFSET = np.array([-0.9, 0.3, -0.4, 0.2])


def efforts(seconds: float, noise_nm: float) -> np.ndarray:
    """(n, 4) of an arm at rest, with friction's share and the offsets of its sensors."""
    n = round(seconds / PERIOD_S)
    rng = np.random.default_rng(1)
    return LOAD * np.array([1.0, 0.8, 1.1, 1.0]) + OFFSET + noise_nm * rng.standard_normal((n, 4))


def told(effort: np.ndarray) -> np.ndarray:
    n = effort.shape[0]
    return noisy_zero(effort, np.tile(LOAD, (n, 1)), np.ones(n, dtype=bool), PERIOD_S)


@pytest.mark.parametrize("noise_nm", [0.05, 0.5, 2.0])
def test_brakes_are_told_through_noise_and_offsets(noise_nm: float) -> None:
    effort = efforts(30.0, noise_nm)
    effort[5000:8000] -= LOAD * np.array([1.0, 0.8, 1.1, 1.0])
    starts, stops = run_bounds(told(effort))
    assert len(starts) == 1
    assert 4850 <= starts[0] <= 5000 and 8000 <= stops[0] <= 8150, "the grip of the brakes is part of it"


@pytest.mark.parametrize(
    "torque_nm",
    [(0.0, 11.5, 0.0, 0.0), (0.0, 8.0, -6.0, 0.0), (0.0, 25.0, -19.0, 0.0), (0.0, 0.0, -9.9, 0.0)],
    ids=["one joint relieved", "both relieved by half", "both pushed beyond", "the other relieved"],
)
def test_a_push_that_bears_part_of_the_load_is_no_brake(torque_nm: tuple[float, ...]) -> None:
    effort = efforts(30.0, 0.5)
    effort[5000:8000] += np.array(torque_nm)
    assert not told(effort).any()


def test_an_arm_that_hangs_otherwise_than_described_is_not_braked() -> None:
    """What the model takes to be loaded bears nothing, and a joint that it does not load bears a lot."""
    effort = efforts(30.0, 0.5)
    effort[5000:8000] -= LOAD * np.array([1.0, 0.8, 1.1, 1.0])
    effort[5000:8000, 0] += 6.0
    assert not told(effort).any()


def test_nothing_is_told_in_motion_or_without_a_load() -> None:
    effort = efforts(10.0, 0.5)
    effort[1000:3000] = 0.0
    n = effort.shape[0]
    assert not noisy_zero(effort, np.tile(LOAD, (n, 1)), np.zeros(n, dtype=bool), PERIOD_S).any()
    assert not noisy_zero(effort, np.zeros((n, 4)), np.ones(n, dtype=bool), PERIOD_S).any()
    assert not noisy_zero(effort, None, np.ones(n, dtype=bool), PERIOD_S).any()


def test_amperes_taken_for_torque_are_no_brake() -> None:
    """An arm that moves for half of the time, and whose efforts are an eighth of its load: that is what they bear."""
    n = 10_000
    t = PERIOD_S * np.arange(n)
    still = (t % 2.0) < 1.0
    load = LOAD * np.where(still, 1.0, 1.0 + 0.3 * np.sin(2.0 * np.pi * t))[:, None]
    noise = 0.005 * np.random.default_rng(2).standard_normal((n, 4))
    effort = 0.125 * load + np.where(still[:, None], 0.0, 0.02) + noise
    assert not noisy_zero(effort, load, still, PERIOD_S).any()
    effort[4000:4500] = noise[4000:4500]
    found = noisy_zero(effort, load, still, PERIOD_S)
    assert found[4100:4400].all() and not found[:3800].any()
