"""Thresholds from the bulk of a contact-free residual: what they are worth on more of the same, and with contact."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from collaudit.core.cycles.null_level import NullEvidence, motion_levels, rest_level
from collaudit.core.data.recommendation_result import FittedThresholds, JointThreshold, ThresholdLevel
from collaudit.core.detection.fitted_rule import exceeded_findings
from collaudit.core.numeric.null_tail import ZERO_DOUBT_NM

PERIOD = 0.002
N = 13


def coloured(duration_s: float, seed: int) -> np.ndarray:
    """Gaussian noise of unit size that remembers 40 ms."""
    x = lfilter([0.05], [1.0, -0.95], np.random.default_rng(seed).standard_normal(round(duration_s / PERIOD)))
    return np.asarray(x / np.std(x))


def swinging(samples: int) -> np.ndarray:
    """(n, 2) velocities of two joints."""
    t = np.arange(samples) * PERIOD
    return np.column_stack([1.5 * np.sin(0.9 * t), 0.5 * np.cos(0.4 * t)])


def evidence(residual: np.ndarray) -> NullEvidence:
    velocity = swinging(residual.size)
    return NullEvidence(residual, np.abs(velocity[:, 0]) > 0.02, PERIOD)


def level_of(one: NullEvidence, n: int = N, contact_free: bool = False) -> ThresholdLevel:
    (found,) = motion_levels([one], [[n]], 6, contact_free)
    return found


@pytest.mark.parametrize("seconds", [30.0, 600.0])
def test_the_level_is_seldom_passed_and_not_high(seconds: float) -> None:
    """Over an hour and more of the same no run of n samples passes 3 to 6 deviations, and a margin."""
    for seed in range(10):
        level = level_of(evidence(coloured(seconds, seed)))
        assert 3.0 < (level.gamma_nm - ZERO_DOUBT_NM) / level.margin < 6.0
        low, high = level.false_alarms_ci95
        assert low <= level.false_alarms_per_hour <= high
        over = np.abs(coloured(600.0, 100 + seed)) > level.gamma_nm
        assert np.convolve(over, np.ones(N), "valid").max() < N
    assert level_of(evidence(coloured(seconds, 1)), 1).gamma_nm > level.gamma_nm * 0.95


def test_contact_in_the_evidence_hardly_raises_it() -> None:
    """Pushes of 0.6 s every 6 s that no mask found: a tenth of the time, forty deviations high."""
    clean = coloured(120.0, 4)
    touched = clean + 40.0 * ((np.arange(clean.size) * PERIOD) % 6.0 < 0.6)
    assert level_of(evidence(touched)).gamma_nm < 1.4 * level_of(evidence(clean)).gamma_nm


def test_what_passes_is_said_and_may_not_pass_where_nothing_touched_the_arm() -> None:
    """A friction law that errs by twelve deviations for 0.3 s every 12 s."""
    clean = coloured(120.0, 4)
    wrong = clean + 12.0 * ((np.arange(clean.size) * PERIOD) % 12.0 < 0.3)
    assert level_of(evidence(clean)).exceeded == 0.0
    found, stated = level_of(evidence(wrong)), level_of(evidence(wrong), contact_free=True)
    assert found.exceeded == pytest.approx(0.3 / 12.0, rel=0.8)
    assert stated.exceeded == 0.0
    assert stated.gamma_nm > 12.0 > found.gamma_nm
    known = JointThreshold((found,), None, None, 120.0 / 3600.0, 1.0, None)
    (said,) = exceeded_findings(FittedThresholds("direct", False, {"a": known, "b": known}), {"a"})
    assert (said.code, said.joint) == ("fit-exceeded", "a")
    assert said.doubts_alarms
    assert found.highest_nm == pytest.approx(12.0, abs=4.0), "the errors, and the residual beside them"
    silent = replace(known, levels=(stated,))
    assert not exceeded_findings(FittedThresholds("direct", False, {"a": silent}), {"a"})


def test_what_lasts_only_in_slow_motion_makes_no_law_of_its_own() -> None:
    """Ripple of the gear changes its sign with the way: it lasts 0.2 s where the joint is slow, and nowhere else.

    By the bulk of what lasts so long, which is nothing, those few would be contact, and each of them an alarm.
    """
    samples = round(300.0 / PERIOD)
    ripple = np.sin(40.0 * np.cumsum(swinging(10 * samples)[:, 0]) * PERIOD)
    residual = ripple + 0.3 * coloured(3000.0, 2)
    one = evidence(residual[:samples])
    found = motion_levels([one], [[n] for n in (1, 13, 100)], 6)
    assert all(level.gamma_nm > 1.5 and level.exceeded == 0.0 for level in found)
    last = found[-1]
    over = np.abs(residual) > last.gamma_nm
    assert np.convolve(over, np.ones(last.n), "valid").max() < last.n


def test_a_residual_that_swings_has_a_level_of_what_lasts() -> None:
    """A structure that vibrates at 18 Hz keeps nothing for 100 ms: that level is lower, and not zero."""
    at = np.arange(round(3000.0 / PERIOD)) * PERIOD
    residual = np.sin(2.0 * np.pi * 18.0 * at) * (1.0 + 0.3 * coloured(3000.0, 3)) + 0.1 * coloured(3000.0, 4)
    one = evidence(residual[: round(300.0 / PERIOD)])
    single, _, lasting = motion_levels([one], [[n] for n in (1, 13, 50)], 6)
    assert lasting.n == 50
    assert 0.3 * single.gamma_nm < lasting.gamma_nm < 0.6 * single.gamma_nm
    over = np.abs(residual) > lasting.gamma_nm
    assert np.convolve(over, np.ones(50), "valid").max() < 25


def test_little_evidence_stands_further_off() -> None:
    """Half a minute, ten, an hour of the same: the margin shrinks, the level without it stays."""
    short, usual, long = (level_of(evidence(coloured(seconds, 5))) for seconds in (30.0, 600.0, 3600.0))
    assert short.margin > usual.margin > long.margin > 1.0
    bare = [(one.gamma_nm - ZERO_DOUBT_NM) / one.margin for one in (short, usual, long)]
    assert bare == pytest.approx([bare[-1]] * 3, rel=0.2)


def test_what_most_standstills_stay_below() -> None:
    loose = np.zeros(10_000, dtype=bool)
    residual = np.zeros(10_000)
    for k in range(20):
        loose[500 * k : 500 * k + 100] = True
        residual[500 * k + 50] = 0.1 * k
    residual[1050] = 30.0  # contact at one of them
    assert 1.6 <= rest_level([residual], [loose]) <= 1.9
    assert rest_level([residual], [np.zeros(10_000, dtype=bool)]) == 0.0
    residual[[2050, 3050, 4050]] = 30.0  # at four of twenty: more than the share that is left out
    assert 1.6 <= rest_level([residual], [loose]) <= 2.9
    residual[5050::500] = 30.0  # at half of them
    assert rest_level([residual], [loose]) == 30.0
    assert rest_level([residual], [loose], 2.5) == 2.5
