"""Thresholds of an arm: what they promise, what they need, and what they refuse."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from plain_rule import collisions
from residual_audits import audit_of, coloured

from collaudit.core.recommend.arm_evidence import gather_evidence
from collaudit.core.recommend.arm_recommendation import ArmRecommendation, recommend_arm
from collaudit.core.recommend.joint_thresholds import (
    LEAST_S,
    LOOSE,
    REACH,
    looseness,
    recommend_joints,
    tail_evidence,
    threshold,
)
from collaudit.core.recommend.sustained_levels import (
    CleanResidual,
    SustainedPeaks,
    declustered_peaks,
    round_up,
    sustained_level,
)
from collaudit.core.recommend.tail_fit import JointTail, _skewed, fit_tail, tail_likelihood


def recommended(residual: np.ndarray, per_hour: float = 1e-3, name: str = "a.mcap") -> ArmRecommendation:
    return recommend_arm([audit_of(residual, name=name)], per_hour=per_hour)


def test_less_than_three_minutes_give_nothing() -> None:
    found = recommended(coloured(0, LEAST_S - 2.0))
    rule = found.joints["joint1"]
    assert rule.gamma_nm is None and found.rate.bound_per_hour is None and not found.rate.supported
    assert "at least 3 min" in rule.missing[0]
    assert found.set_rules["joint1"].opinion == "not judged"
    assert recommended(coloured(0, LEAST_S + 5.0)).joints["joint1"].gamma_nm is not None


def test_the_arm_gets_what_was_asked_for() -> None:
    """Three joints share the rate; the sum of their bounds keeps it; the hours decide whether it is claimed."""
    found = recommended(coloured(1, 900.0, joints=3), per_hour=0.01)
    rate, rules = found.rate, found.joints.values()
    assert rate.extrapolated_per_hour == pytest.approx(sum(r.false_alarms_per_hour or 0 for r in rules))
    assert rate.extrapolated_per_hour is not None and rate.extrapolated_per_hour <= 0.01, "from one log, 95 % hold it"
    assert rate.hours == pytest.approx(0.25, rel=1e-3)
    assert not rate.supported and rate.bound_per_hour == pytest.approx(1 / (REACH * rate.hours))
    assert rate.hours + rate.more_hours == pytest.approx(100 / REACH)
    assert rate.observed_per_hour == pytest.approx(2.996 / rate.hours, rel=1e-3), "the rule of three"
    often = recommended(coloured(1, 900.0, joints=3), per_hour=1.0).rate
    assert often.supported and often.more_hours == 0.0


def test_thresholds_alarm_on_none_of_their_own_data_and_hold_on_more() -> None:
    rule = recommended(coloured(2, 600.0)).joints["joint1"]
    fresh = coloured(12, 7200.0)[:, 0]
    assert rule.gamma_nm is not None and rule.margin is not None and rule.margin >= 1.0
    for x in (coloured(2, 600.0)[:, 0], fresh):
        assert collisions(x, np.ones(x.size, dtype=bool), rule.gamma_nm, rule.n) == []
    largest = sustained_level(CleanResidual(fresh, np.ones(fresh.size, dtype=bool), 0.002), rule.n).max()
    assert rule.gamma_nm < 1.5 * largest


def test_more_hours_of_the_same_do_not_raise_gamma() -> None:
    gammas = [
        np.median([recommended(coloured(seed, minutes * 60.0)).joints["joint1"].gamma_nm or 0 for seed in range(3)])
        for minutes in (5, 15, 45)
    ]
    assert gammas[0] >= gammas[1] >= gammas[2]


def of_more_hours(tail: JointTail, times: float) -> JointTail:
    """The same distribution of peaks from so many times the hours: as many more peaks, all surer by as much."""
    law = tail.likelihood
    longer = replace(law, peaks=round(times * law.peaks), deviance=times * law.deviance)
    return replace(tail, hours=times * tail.hours, likelihood=longer)


@given(
    st.integers(0, 50), st.floats(0.06, 20.0), st.floats(1.0, 30.0), st.floats(0.3, 3.0), st.floats(1e-4, 2.0),
    st.floats(1.0, 300.0),
)  # fmt: skip
def test_more_hours_of_the_same_distribution_never_raise_gamma(
    seed: int, hours: float, scatter: float, size: float, per_hour: float, times: float
) -> None:
    excess = np.random.default_rng(seed).exponential(size, 20 + 10 * (seed % 7))
    law = tail_likelihood(excess, 1.0, hours, (scatter, 1.0 + scatter / 10.0), 1.7)
    tail = JointTail(law, 1.7, 0.5, scatter, None, None, float(np.sqrt(1.0 + excess.max())), hours, 1 + seed % 2)
    less, more = (threshold(one, per_hour, 6) for one in (tail, of_more_hours(tail, times)))
    assert less is not None and more is not None
    assert more <= round_up(1.005 * less), "bounds between the steps of the hours may be higher by half a per cent"


def test_what_is_claimed_holds_at_95_percent() -> None:
    """Below it, at the rate asked for, the threshold lies between what is likeliest and what holds at 95 %."""
    clean = np.ones(225_000, dtype=bool)
    data = [CleanResidual(coloured(seed, 450.0)[:, 0], clean, 0.002) for seed in (5, 6)]
    tail = tail_evidence(declustered_peaks(data, [13, 13]), 13).tail
    assert tail is not None and tail.logs == 2
    gamma = threshold(tail, 1e-3, 6)
    assert gamma is not None and tail.rate_bound(gamma) <= 1.0 / (REACH * tail.hours) / 6
    assert tail.rate_at(gamma) <= 1e-3 / 6 < tail.rate_bound(gamma)
    alone = threshold(replace(tail, logs=1), 1e-3, 6)
    assert alone == round_up(tail.level_bound(1e-3 / 6)) > gamma, "one log does not show how much logs differ"
    often = threshold(tail, 4.0, 6)
    assert often == max(round_up(tail.level_bound(4.0 / 6)), round_up(tail.largest_nm)), "supported: 95 %"


def test_a_loose_gamma_says_so() -> None:
    """From minutes gamma may be half as large again as 50 h would ask for, from half an hour it is not."""
    short, long = (recommended(coloured(21, minutes * 60.0)).joints["joint1"] for minutes in (3.2, 30))
    assert short.loose is not None and long.loose is not None and long.loose < min(LOOSE, short.loose)
    assert not any("times as high as" in text for text in long.missing)
    data = [CleanResidual(coloured(21, 192.0)[:, 0], np.ones(96_000, dtype=bool), 0.002)]
    tail = tail_evidence(declustered_peaks(data, [13]), 13).tail
    assert tail is not None and looseness(tail, 3.0 * tail.largest_nm) > LOOSE
    restless = coloured(23, 300.0) * np.repeat((0.1, 0.1, 0.1, 1.0, 1.2), 30_000)[:, None]
    wide = recommend_arm([audit_of(restless)], contact=[()]).joints["joint1"]
    assert wide.loose is not None and wide.loose > LOOSE and any("times as high as" in text for text in wide.missing)


def test_logs_of_other_levels_are_named() -> None:
    audits = [audit_of(f * coloured(s, 200.0), name=f"{s}.mcap") for s, f in enumerate((0.5, 1.1))]
    assert any("factor of 2." in text for text in recommend_arm(audits).joints["joint1"].missing)


def test_the_same_log_twice_counts_once() -> None:
    audit = audit_of(coloured(3, 300.0))
    once, twice = recommend_arm([audit]), recommend_arm([audit, audit])
    assert twice.joints == once.joints and len(twice.logs) == 1


def test_what_differs_between_logs_is_in_the_bound() -> None:
    """Logs whose residuals differ by a factor, beside logs that are alike and have the same mean."""
    factors = (0.6, 1.4, 0.7, 1.3, 1.0)
    alike = [audit_of(coloured(s, 300.0), name=f"{s}.mcap") for s in range(5)]
    unlike = [audit_of(f * coloured(s, 300.0), name=f"{s}.mcap") for s, f in enumerate(factors)]
    a, b = (recommend_arm(audits).joints["joint1"] for audits in (alike, unlike))
    assert a.tail is not None and b.tail is not None and a.gamma_nm is not None and b.gamma_nm is not None
    assert b.tail.dispersion_logs is not None and b.tail.dispersion_logs > 5 > (a.tail.dispersion_logs or 0)
    assert b.gamma_nm > 1.2 * 1.4 * a.gamma_nm / 1.4


def test_peaks_in_crowds_bound_the_rate_less() -> None:
    """The same peaks, evenly over the minutes or crowded into a few of them."""
    rng = np.random.default_rng(8)
    level, minutes = np.sqrt(rng.exponential(1.0, 3600)), np.arange(60)
    order = np.argsort(-level)
    crowded = np.empty(3600, dtype=np.int64)
    crowded[order] = np.repeat(minutes, 60)
    tails = []
    for window in (rng.permutation(np.repeat(minutes, 60)), crowded):
        zeros = np.zeros(3600, dtype=np.int64)
        peaks = SustainedPeaks(
            level, zeros, window, zeros * 1.0, 1.0, np.full(60, 1 / 60), np.zeros(60, dtype=np.int64)
        )
        tails.append(fit_tail(peaks))
    even, crowd = tails
    assert even is not None and crowd is not None
    assert even.likelihood.count_dispersion < 2 < 20 < crowd.likelihood.count_dispersion
    gamma = 1.05 * even.begins_nm
    assert crowd.rate_bound(gamma) > 1.5 * even.rate_bound(gamma)


def test_a_few_bad_minutes_bound_the_rate_less_than_even_scatter() -> None:
    """Counts of like dispersion: half of the minutes a little worse, or a few of them far worse."""
    minutes = np.arange(40)
    even = np.where(minutes % 2 == 0, 10, 50)
    few = np.where(minutes % 8 == 0, 83, 22)
    widened = [_skewed(np.repeat(minutes, counts), np.full(40, 1 / 60), 1.7) for counts in (even, few)]
    assert widened[0] == 1.0 and 1.2 < widened[1] < 1.8


def test_a_residual_that_grows_is_called_drifting() -> None:
    x = coloured(4, 1200.0)
    grows = x * np.linspace(1.0, 2.0, x.shape[0])[:, None]
    steady, drifting = (recommended(part).joints["joint1"] for part in (x, grows))
    assert steady.tail is not None and steady.tail.drift is None
    assert drifting.tail is not None and drifting.tail.drift == pytest.approx(1.67, rel=0.1)
    assert any("steady residual" in text for text in drifting.missing)
    assert drifting.gamma_nm is not None and steady.gamma_nm is not None
    assert drifting.gamma_nm > 1.5 * steady.gamma_nm, "the worst third determines it"


@given(st.floats(1e-6, 1e6), st.floats(1.0, 3.0))
def test_rounding_is_upwards_by_less_than_a_digit_and_keeps_order(level: float, factor: float) -> None:
    rounded = round_up(level)
    assert level * (1 - 1e-9) <= rounded <= 1.1 * level
    assert f"{rounded:.2g}" == f"{rounded:.6g}" or float(f"{rounded:.2g}") == rounded, "two significant digits"
    assert round_up(rounded) == rounded and round_up(factor * level) >= rounded


@pytest.mark.parametrize(
    ("level", "rounded"), [(0.0, 0.0), (1.0, 1.0), (1.01, 1.1), (99.1, 100.0), (0.0331, 0.034), (12.0, 12.0)]
)
def test_two_digits_upwards(level: float, rounded: float) -> None:
    assert round_up(level) == rounded


def test_sustained_levels_are_the_rules() -> None:
    """Gaps are never bridged; the level is the threshold at which the rule stops to fire."""
    rng = np.random.default_rng(0)
    x, clean = rng.standard_normal(400), rng.random(400) > 0.05
    level = sustained_level(CleanResidual(x, clean, 0.002), 5)
    for start in range(396):
        inside = slice(start, start + 5)
        expected = np.abs(x[inside]).min() if clean[inside].all() else -np.inf
        assert level[start] == expected


@pytest.mark.parametrize("n", [1, 5, 40, 400, 401])
@pytest.mark.parametrize("length", [1, 7, 100, 1000])
def test_windows_that_count_are_told_from_the_runs_of_clean_samples(n: int, length: int) -> None:
    rng = np.random.default_rng(n)
    x, clean = rng.standard_normal(400), rng.random(400) > 0.02
    x[rng.integers(0, 400, 3)] = np.nan
    for marked in (clean, np.zeros(400, dtype=bool), np.arange(400) % 130 != 100):
        data = CleanResidual(x, marked, 0.002)
        known = np.isfinite(sustained_level(data, n))
        expected = [np.count_nonzero(known[a : a + length]) for a in range(0, known.size, length)]
        assert data.windows_by_block(n, length).tolist() == expected


def test_peaks_are_found_once_for_a_persistence() -> None:
    evidence = gather_evidence([audit_of(coloured(3, 20.0))])
    peaks = evidence.peaks("joint1", 0.026)
    assert evidence.peaks("joint1", 0.026) is peaks
    for persistence_s, n in ((0.026, 13), (0.052, 26)):
        expected = declustered_peaks(evidence.of_joint("joint1"), [n])
        np.testing.assert_array_equal(evidence.peaks("joint1", persistence_s).level_nm, expected.level_nm)


def test_peaks_are_apart() -> None:
    x = np.zeros(5000)
    x[990:1020] = 3.0  # across the border of two seconds' blocks: one peak
    x[1980:1996], x[2003:2030] = 1.0, 2.5  # rising across a border: the higher one
    x[3000:3030] = 2.0
    peaks = declustered_peaks([CleanResidual(x, np.ones(5000, dtype=bool), 0.002)] * 2, [13, 13])
    assert sorted(peaks.level_nm[peaks.level_nm > 0]) == [2.0, 2.0, 2.5, 2.5, 3.0, 3.0]
    assert peaks.hours == pytest.approx(2 * 4988 * 0.002 / 3600)
    assert peaks.window_hours.sum() == pytest.approx(peaks.hours)
    assert set(peaks.log) == {0, 1} and set(peaks.log_of_window) == {0, 1}


def test_an_arm_nobody_watched_gets_no_rate() -> None:
    found, items = recommend_joints(gather_evidence([audit_of(np.zeros((200_000, 1)))]), 0.026)
    assert found["joint1"].gamma_nm is None and items["joint1"].tail is None
    assert "varies" in found["joint1"].missing[0]
