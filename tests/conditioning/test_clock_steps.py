"""A clock that is set while an arm moves is told from lost time by the positions, which go on."""

from __future__ import annotations

import numpy as np
import pytest

from collaudit.core.conditioning.conditioning import clock_step_findings

T = 0.002 * np.arange(4000)
MOVING = np.column_stack([np.sin(T), 0.5 * np.cos(1.7 * T)])
AT = 2000


def stepped(by_s: float) -> np.ndarray:
    """Stamps of a clock that was set at one sample."""
    return T + np.where(np.arange(T.size) >= AT, by_s, 0.0)


@pytest.mark.parametrize(
    ("by_s", "words"),
    [
        (3600.0, "daylight saving"),
        (-3600.0, "daylight saving"),
        (3599.9, "daylight saving"),
        (2 * 3600.0, "time zone"),
        (3.7, "NTP"),
        (-2.3, "NTP"),
        (86_400.0, "NTP"),
        (1.7e9, "NTP"),
    ],
)
def test_a_clock_that_was_set_is_named_with_its_step(by_s: float, words: str) -> None:
    stamps = stepped(by_s)
    (found,) = clock_step_findings(stamps, MOVING)
    assert words in found.text and f"{abs(stamps[AT] - stamps[AT - 1]):.7g} s" in found.text
    assert found.code == ("time-gap" if by_s > 0 else "log-clock")
    assert found.start_s == pytest.approx(T[AT - 1])


@pytest.mark.parametrize("lost", [300, 1500])
def test_lost_samples_are_no_clock_that_was_set(lost: int) -> None:
    kept = np.r_[:1500, 1500 + lost : T.size]
    assert clock_step_findings(T[kept], MOVING[kept]) == []


def test_an_arm_that_stands_tells_nothing() -> None:
    assert clock_step_findings(stepped(3600.0), np.zeros_like(MOVING)) == []


def test_noise_of_encoders_hides_no_step() -> None:
    noisy = MOVING + np.random.default_rng(1).normal(0.0, 1e-5, MOVING.shape)
    assert len(clock_step_findings(stepped(60.0), noisy)) == 1


def test_missing_positions_and_stamps_are_no_evidence() -> None:
    stamps, position = stepped(3600.0), MOVING.copy()
    position[AT - 2 : AT + 2] = np.nan
    assert clock_step_findings(stamps, position) == []
    stamps[:] = np.nan
    assert clock_step_findings(stamps, MOVING) == []
