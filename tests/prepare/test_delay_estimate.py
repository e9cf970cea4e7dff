"""Delays: a nominal 95 % holds on noisy, periodic and coarsely stamped channels, and noise has no delay."""

from __future__ import annotations

import pytest
from delayed_channels import found_and_true

from collaudit.core.prepare.channel_delay import Delay, Undetermined

SEEDS = 25


@pytest.mark.parametrize("kind", ["rich", "periodic", "moves"])
@pytest.mark.parametrize("rho", [0.0, 0.95])
def test_a_channel_that_carries_nothing_has_no_delay(kind: str, rho: float) -> None:
    for seed in range(SEEDS):
        found, _ = found_and_true(kind, 1.0, rho, 0.0, seed, carries=False)
        assert isinstance(found, Undetermined)


@pytest.mark.parametrize(
    ("kind", "noise", "rho", "held_s", "least"),
    [
        ("rich", 0.3, 0.0, 0.0, 22),
        ("rich", 0.3, 0.95, 0.0, 22),
        ("rich", 0.1, 0.9, 0.02, 22),
        ("periodic", 0.3, 0.95, 0.0, 3),
        ("moves", 0.1, 0.9, 0.0, 3),
    ],
)
def test_the_interval_holds(kind: str, noise: float, rho: float, held_s: float, least: int) -> None:
    pairs = [found_and_true(kind, noise, rho, held_s, seed) for seed in range(SEEDS)]
    told = [(found, true) for found, true in pairs if isinstance(found, Delay)]
    assert len(told) >= least
    held = sum(found.ci95[0] <= true <= found.ci95[1] for found, true in told)
    assert held >= 0.88 * len(told)


def test_a_repeating_motion_names_the_other_shift() -> None:
    found = [found_and_true("periodic", 0.3, 0.95, 0.0, seed)[0] for seed in range(20)]
    assert any("repeats itself" in f.why for f in found if isinstance(f, Undetermined))
