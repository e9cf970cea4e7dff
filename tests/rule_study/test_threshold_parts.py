"""Each cause of a threshold is found where it is the only one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from collaudit.core.rule_study.threshold_parts import PartInputs, threshold_parts

PERIOD, SIZE = 0.004, 50_000
TIME = PERIOD * np.arange(SIZE)
POSITION = np.sin(0.7 * TIME) + 0.5 * np.sin(0.23 * TIME)
SPEED = np.gradient(POSITION, PERIOD)


def noise(sd: float, seed: int = 1) -> np.ndarray:
    made = np.convolve(np.random.default_rng(seed).normal(size=SIZE), np.hanning(9), "same")
    return sd * made / made.std()


def inputs(residual: np.ndarray, noise_nm: float = 0.05) -> PartInputs:
    gravity, inertial = 8.0 * np.cos(POSITION), 0.6 * np.gradient(SPEED, PERIOD)
    everywhere, interval = np.ones(SIZE, dtype=bool), np.abs(SPEED) < 0.03
    motion = np.gradient(SPEED, PERIOD)[:, None]
    return PartInputs(
        residual + noise(0.05),
        np.zeros(SIZE),
        everywhere,
        interval,
        POSITION,
        SPEED,
        gravity,
        inertial,
        motion,
        noise(noise_nm, 2),
        PERIOD,
    )


CAUSES = {
    "ripple": 0.8 * np.sin(POSITION * 2.0 * np.pi / 0.06),
    "drift": 0.8 * np.sin(TIME / 40.0),
    "lag": 0.08 * np.gradient(8.0 * np.cos(POSITION) + 0.6 * np.gradient(SPEED, PERIOD), PERIOD),
    "model": 0.15 * 8.0 * np.cos(POSITION),
    "friction": 0.8 * np.sign(SPEED) * (np.abs(SPEED) > 0.3),
    "reversal": 2.0 * np.exp(-((np.abs(SPEED) / 0.02) ** 2)) * np.sign(np.gradient(SPEED)),
}


@pytest.mark.parametrize("cause", CAUSES)
def test_the_cause_that_was_put_in_is_the_largest(cause: str) -> None:
    found = threshold_parts(inputs(CAUSES[cause]), 5)
    assert found is not None
    shares = {cause: fall for cause, fall in found.falls_nm.items() if cause != "rest"}
    assert max(shares, key=lambda name: shares[name]) == cause
    assert shares[cause] > 0.4 * found.level_nm


def test_noise_alone_is_noise() -> None:
    found = threshold_parts(inputs(noise(0.5, 3), noise_nm=0.5), 5)
    assert found is not None
    shares = {cause: fall for cause, fall in found.falls_nm.items() if cause != "rest"}
    assert max(shares, key=lambda name: shares[name]) == "noise"
    assert all(value < 0.3 * found.level_nm for name, value in shares.items() if name != "noise")


def test_too_little_clean_time_says_nothing() -> None:
    joint = inputs(np.zeros(SIZE))
    assert threshold_parts(replace(joint, clean=TIME < 10.0), 5) is None
