"""Thresholds of an arm: what they promise, what they need, and what they refuse."""

from __future__ import annotations

import numpy as np
import pytest
from plain_rule import collisions
from residual_audits import audit_of, coloured

from collaudit.core.cycles.null_level import NullEvidence
from collaudit.core.numeric.null_tail import ZERO_DOUBT_NM
from collaudit.core.recommend.arm_evidence import gather_evidence, separate_peaks, sustained_level
from collaudit.core.recommend.arm_recommendation import ArmRecommendation, recommend_arm
from collaudit.core.recommend.joint_thresholds import LEAST_S, LOOSE, arm_rate, judge_set_rule, recommend_joints


def recommended(residual: np.ndarray, per_hour: float = 0.1, name: str = "a.mcap") -> ArmRecommendation:
    return recommend_arm([audit_of(residual, name=name)], per_hour=per_hour)


def test_less_than_three_minutes_give_nothing() -> None:
    found = recommended(coloured(0, LEAST_S - 2.0))
    rule = found.joints["joint1"]
    assert rule.gamma_nm is None and found.rate.bound_per_hour is None and not found.rate.supported
    assert "at least 3 min" in rule.missing[0]
    assert found.set_rules["joint1"].opinion == "not judged"
    assert recommended(coloured(0, LEAST_S + 5.0)).joints["joint1"].gamma_nm is not None


def test_what_is_claimed_is_what_the_hours_show() -> None:
    """No alarm in a quarter of an hour: at most three in it; the hours that would show the rate asked for."""
    rate = recommended(coloured(1, 900.0, joints=3)).rate
    assert rate.hours == pytest.approx(0.25, rel=1e-3) and rate.alarms == 0
    assert rate.bound_per_hour == pytest.approx(2.996 / rate.hours, rel=1e-3), "the rule of three"
    assert not rate.supported and rate.hours + rate.more_hours == pytest.approx(29.96, rel=1e-3)
    often = recommended(coloured(1, 900.0, joints=3), per_hour=15.0).rate
    assert often.supported and often.more_hours == 0.0


def test_alarms_that_a_threshold_would_have_given_are_counted() -> None:
    evidence = gather_evidence([audit_of(coloured(4, 900.0))])
    _, found = recommend_joints(evidence, 0.026, [])
    low = 0.5 * float(found["joint1"].peaks.level_nm.max())
    rate = arm_rate(found, {"joint1": low}, 0.1)
    assert rate.alarms == np.count_nonzero(found["joint1"].peaks.level_nm > low) > 3
    assert rate.bound_per_hour is not None and rate.bound_per_hour > rate.alarms / rate.hours


def test_the_level_is_that_of_the_fits_law_and_gamma_at_most_twice_it() -> None:
    """Nothing is asked to be noticed in these audits: the room is wide."""
    rule = recommended(coloured(2, 600.0)).joints["joint1"]
    assert rule.gamma_nm is not None and rule.motion_nm is not None and rule.largest_clean_nm is not None
    assert rule.gamma_nm == pytest.approx(2.0 * rule.motion_nm, rel=0.01)
    assert rule.largest_clean_nm < rule.motion_nm < 2.0 * rule.largest_clean_nm
    fresh = coloured(12, 7200.0)[:, 0]
    assert collisions(fresh, np.ones(fresh.size, dtype=bool), rule.motion_nm, rule.n) == []


def test_more_hours_of_the_same_lower_the_doubt() -> None:
    levels = [
        np.median([recommended(coloured(seed, minutes * 60.0)).joints["joint1"].motion_nm or 0 for seed in range(3)])
        for minutes in (4, 15, 45)
    ]
    assert levels[0] > levels[1] > 0.95 * levels[2]
    assert levels[2] > ZERO_DOUBT_NM


def test_what_the_evidence_says_of_a_threshold_that_is_set() -> None:
    rules, found = recommend_joints(gather_evidence([audit_of(coloured(5, 900.0))]), 0.026, [])
    rule, one = rules["joint1"], found["joint1"]
    assert rule.gamma_nm is not None and rule.motion_nm is not None
    opinions = [
        judge_set_rule(gamma, rule, one).opinion
        for gamma in (0.5 * rule.motion_nm, rule.motion_nm, rule.gamma_nm, 1.1 * LOOSE * rule.gamma_nm)
    ]
    assert opinions == ["too tight", "supported", "supported", "too loose"]


def test_logs_of_other_levels_are_named() -> None:
    audits = [audit_of(f * coloured(s, 200.0), name=f"{s}.mcap") for s, f in enumerate((0.5, 1.1))]
    assert any("factor of 2." in text for text in recommend_arm(audits).joints["joint1"].missing)


def test_the_same_log_twice_counts_once() -> None:
    audit = audit_of(coloured(3, 300.0))
    once, twice = recommend_arm([audit]), recommend_arm([audit, audit])
    assert twice.joints == once.joints and len(twice.logs) == 1


def test_sustained_levels_are_the_rules() -> None:
    """Gaps are never bridged; the level is the threshold at which the rule stops to fire."""
    rng = np.random.default_rng(0)
    x, clean = rng.standard_normal(400), rng.random(400) > 0.05
    level = sustained_level(NullEvidence(x, clean, 0.002), 5)
    for start in range(396):
        inside = slice(start, start + 5)
        expected = np.abs(x[inside]).min() if clean[inside].all() else -np.inf
        assert level[start] == expected


def test_peaks_are_found_once_for_a_persistence() -> None:
    evidence = gather_evidence([audit_of(coloured(3, 20.0))])
    peaks = evidence.peaks("joint1", 0.026)
    assert evidence.peaks("joint1", 0.026) is peaks
    for persistence_s, n in ((0.026, 13), (0.052, 26)):
        expected = separate_peaks(evidence.of_joint("joint1"), [n])
        np.testing.assert_array_equal(evidence.peaks("joint1", persistence_s).level_nm, expected.level_nm)


def test_peaks_are_apart() -> None:
    x = np.zeros(5000)
    x[990:1020] = 3.0
    x[1980:1996], x[2003:2030] = 1.0, 2.5  # less than a second apart: the higher one
    x[3000:3030] = 2.0
    peaks = separate_peaks([NullEvidence(x, np.ones(5000, dtype=bool), 0.002)] * 2, [13, 13])
    assert sorted(peaks.level_nm[peaks.level_nm > 0]) == [2.0, 2.0, 2.5, 2.5, 3.0, 3.0]
    assert peaks.hours == pytest.approx(2 * 4988 * 0.002 / 3600)
    assert set(peaks.log) == {0, 1}


def test_an_arm_nobody_watched_gets_no_rate() -> None:
    found, items = recommend_joints(gather_evidence([audit_of(np.zeros((200_000, 1)))]), 0.026, [])
    assert found["joint1"].gamma_nm is None and items["joint1"].level is None
    assert "varies" in found["joint1"].missing[0]
