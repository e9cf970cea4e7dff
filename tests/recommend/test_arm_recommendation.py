"""Contaminated evidence, confirmation, the verdict on what is set, and the range of the evidence."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from plain_rule import collisions
from residual_audits import audit_of, coloured

from collaudit.core.data.audit_result import Audit, Collision, ResidualStats
from collaudit.core.recommend.arm_recommendation import recommend_arm
from collaudit.core.recommend.evidence_range import range_findings


def pushed(height: float, seconds: float = 900.0, seed: int = 0) -> tuple[Audit, np.ndarray]:
    """Two joints; both feel a push of 0.2 s now and then, that nothing told of."""
    x = coloured(seed, seconds, joints=2)
    at = np.random.default_rng(seed + 50).uniform(5.0, seconds - 5.0, 8)
    for start in at:
        k = round(start * 500)
        x[k : k + 100] += height
    return audit_of(x, gamma_nm=100.0), at


def test_contact_that_nobody_told_of_is_found_and_listed() -> None:
    clean = recommend_arm([audit_of(coloured(0, 900.0, joints=2))])
    audit, at = pushed(6.0)
    found = recommend_arm([audit])
    assert clean.to_confirm == () and clean.if_clean_nm == {}
    assert all(any(s.start_s <= t <= s.end_s for s in found.to_confirm) for t in at)
    assert len(found.to_confirm) <= len(at) + 1 and {s.why for s in found.to_confirm} == {"suspicious"}
    for joint, rule in found.joints.items():
        usual = clean.joints[joint].gamma_nm
        assert rule.gamma_nm is not None and usual is not None
        assert 0.8 * usual < rule.gamma_nm < 1.25 * usual
        assert any("a statement on" in text for text in rule.missing)
        assert found.if_clean_nm[joint] > 1.4 * rule.gamma_nm, "both answers stand side by side"
    assert found.to_confirm[0].level_nm is not None and found.to_confirm[0].level_nm > 4.0


def test_pushes_no_larger_than_the_rest_are_no_outliers_and_are_listed_as_what_gamma_rests_on() -> None:
    clean = recommend_arm([audit_of(coloured(0, 900.0, joints=2))])
    audit, at = pushed(2.5)
    found = recommend_arm([audit])
    assert len(found.to_confirm) < len(at), "not all can be told from clean motion"
    for joint, peaks in found.highest.items():
        assert [p.level_nm for p in peaks] == sorted((p.level_nm for p in peaks), reverse=True) and len(peaks) == 5
        assert peaks[0].level_nm == pytest.approx(found.joints[joint].largest_clean_nm or 0)
        assert (found.joints[joint].gamma_nm or 0) >= (clean.joints[joint].gamma_nm or 9)
        near = [any(abs(p.time_s - t) < 0.5 for t in at) for p in peaks]
        outside = [s for s in found.to_confirm if joint in s.joints]
        assert sum(near) >= 3 or outside, "the moments to look at are the pushes"


def test_clean_motion_of_many_joints_has_nothing_to_confirm() -> None:
    assert recommend_arm([audit_of(coloured(31, 900.0, joints=6))]).to_confirm == ()


def test_by_a_persons_word_it_counts() -> None:
    audit, at = pushed(6.0)
    found = recommend_arm([audit], contact=[()])
    assert found.to_confirm == () and len(found.counted) >= 0.8 * len(at), "what looks like contact is still said"
    assert (found.joints["joint1"].largest_clean_nm or 0) > 4.0
    known = recommend_arm([audit], contact=[[(t, t + 0.2) for t in at]])
    assert (known.joints["joint1"].largest_clean_nm or 9) < 4.0 and known.to_confirm == ()


def test_alarms_of_one_joint_clean_the_others() -> None:
    """A contact that alarms on joint 1 loads joint 2 below its threshold: its time counts for neither."""
    x = coloured(1, 600.0, joints=2)
    x[100_000:100_400] += np.array([12.0, 5.0])
    audit = audit_of(x, gamma_nm=10.0)
    hit = Collision("joint1", 200.0, 200.026, 0.8, 12.0, 10.0, "free")
    found = recommend_arm([replace(audit, result=replace(audit.result, collisions=(hit,)))])
    assert (found.joints["joint2"].largest_clean_nm or 9) < 4.0
    assert [s.why for s in found.to_confirm] == ["alarm"]


@pytest.mark.parametrize(("gamma", "opinion"), [(1.5, "too tight"), (40.0, "too loose")])
def test_what_is_set_is_judged(gamma: float, opinion: str) -> None:
    found = recommend_arm([audit_of(coloured(2, 600.0), gamma_nm=gamma)]).set_rules["joint1"]
    assert found.opinion == opinion and found.gamma_nm == gamma
    assert found.false_alarms_per_hour is not None and found.false_alarms_per_hour_upper95 is not None
    assert found.false_alarms_per_hour <= found.false_alarms_per_hour_upper95
    if opinion == "too tight":
        truth = coloured(9, 3600.0)[:, 0]
        alarms = len(collisions(truth, np.ones(truth.size, dtype=bool), gamma, 13, 100))
        assert 0.5 * alarms < found.false_alarms_per_hour < 2 * alarms
    else:
        assert found.unnoticed_nm is not None and found.unnoticed_nm[1] == gamma


def test_a_threshold_near_the_recommended_one_is_supported() -> None:
    gamma = recommend_arm([audit_of(coloured(2, 600.0))]).joints["joint1"].gamma_nm
    assert gamma is not None
    for factor in (1.0, 1.3):
        again = recommend_arm([audit_of(coloured(2, 600.0), gamma_nm=factor * gamma)])
        assert again.set_rules["joint1"].opinion == "supported"


def moving(speed: float, seconds: float = 200.0) -> Audit:
    t = np.arange(round(seconds * 500)) * 0.002
    velocity = speed * np.sin(2 * np.pi * t / 4)[:, None]
    return audit_of(coloured(3, seconds), velocity_rad_s=velocity)


def test_a_log_beyond_the_evidence_is_told_so() -> None:
    slow, fast = moving(0.5), moving(1.0)
    known = recommend_arm([slow]).ranges["joint1"]
    assert known.fastest_rad_s == pytest.approx(0.5, rel=0.01)
    assert known.hardest_rad_s2 == pytest.approx(0.5 * np.pi / 2, rel=0.02)
    assert known.reversals == 99
    assert range_findings(slow.signals, 0.002, None, {"joint1": known}) == []
    (found,) = range_findings(fast.signals, 0.002, None, {"joint1": known})
    beyond = np.mean(np.abs(fast.signals.velocity_rad_s) > 1.05 * known.fastest_rad_s)
    assert found.code == "evidence-range" and found.severity == "warning" and found.joint == "joint1"
    assert f"{100 * beyond:.2g} % faster than" in found.text and "accelerated harder" in found.text


def test_reversals_far_more_often_than_in_the_evidence_are_told() -> None:
    """The same speeds and accelerations, turned round twice a second where the evidence went one way."""
    t = np.arange(100_000) * 0.002
    oneway = audit_of(coloured(3, 200.0), velocity_rad_s=(0.5 + 0.3 * np.sin(2 * np.pi * t))[:, None])
    turning = audit_of(coloured(3, 200.0), velocity_rad_s=(0.3 * np.sin(2 * np.pi * t))[:, None])
    known = recommend_arm([oneway]).ranges["joint1"]
    assert known.reversals == 0 and known.reversals_per_h == 0.0
    assert range_findings(oneway.signals, 0.002, None, {"joint1": known}) == []
    (found,) = range_findings(turning.signals, 0.002, None, {"joint1": known})
    assert found.severity == "warning"
    assert "100 % around reversals, 7,182 an hour where the evidence has 0" in found.text
    often = {"joint1": replace(known, reversals_per_h=3000.0)}
    assert range_findings(turning.signals, 0.002, None, often) == [], "less than three times as often"


def test_noise_of_a_velocity_is_no_reversal() -> None:
    """A joint that rests has none; of one that swings, those of the motion are counted through the noise."""
    noise = 0.005 * np.random.default_rng(8).standard_normal((100_000, 1))
    swing = 0.5 * np.sin(2 * np.pi * np.arange(100_000) * 0.002 / 4)[:, None]
    for velocity, count in ((noise, 0), (swing + noise, 99)):
        log = audit_of(coloured(3, 200.0), velocity_rad_s=velocity)
        assert recommend_arm([log]).ranges["joint1"].reversals == count


def at_temperature(audit: Audit, lowest_c: float, highest_c: float) -> Audit:
    stats = ResidualStats(None, None, None, None, 200.0, None, 200.0, temperature_range_c=(lowest_c, highest_c))
    return replace(audit, result=replace(audit.result, residual={"joint1": stats}))


def test_runs_know_the_temperature_of_their_evidence() -> None:
    other = audit_of(coloured(4, 200.0), name="warm.mcap")
    runs = [at_temperature(moving(0.5), 21.0, 24.0), at_temperature(other, 23.0, 38.0)]
    assert recommend_arm(runs).ranges["joint1"].temperature_c == (21.0, 38.0)
    assert recommend_arm([moving(0.5)]).ranges["joint1"].temperature_c is None


def test_load_and_temperature_have_ranges_too() -> None:
    slow = moving(0.5)
    signals = replace(slow.signals, model_nm=np.asarray(slow.signals.model_nm) + 30.0)
    known = replace(recommend_arm([slow]).ranges["joint1"], temperature_c=(20.0, 30.0))
    warm = np.full(signals.residual_nm.shape, 45.0)
    (found,) = range_findings(signals, 0.002, warm, {"joint1": known})
    for words in ("loaded beyond", "warmer than 20 to 30 °C"):
        assert words in found.text
