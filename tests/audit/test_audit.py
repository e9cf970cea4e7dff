"""The chain on a pendulum whose torque is known in closed form: what is found, and what is not called clean."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from arms import LEVEL, dh_robot, dh_row
from origins import NOBODY
from simulated_logs import without_thresholds
from synthetic import PERIOD, lugre, make_log, strokes

from collaudit.core.audit import audit_log
from collaudit.core.config.schema import Config
from collaudit.core.data.audit_result import Audit, FrictionFile
from collaudit.core.data.joint_log import JointLog
from collaudit.core.data.signals import State
from collaudit.core.errors import NotJudgedError
from collaudit.core.fitting import fit_logs
from collaudit.core.prepare.preparation import prepare
from collaudit.core.recommend.arm_recommendation import recommend_arm
from collaudit.core.robot.robot_building import build_robot

MASS, LENGTH, INERTIA, ROTOR = 6.0, 0.4, 0.05, 0.3
GRAVITY = 9.80665
FRICTION = (6.0, 2.0, 8.0, 4.0)
SPEEDS = np.geomspace(0.02, 1.2, 16)


def config(**sections) -> Config:  # type: ignore[no-untyped-def]
    pendulum = dh_row(MASS, (0, 0, 0), (0, 0, INERTIA), a=LENGTH)
    robot = dh_robot([pendulum], armature_kg_m2=[ROTOR], **LEVEL)
    return Config.of({"robot": robot, **sections})


def torque(q: np.ndarray, v: np.ndarray, a: np.ndarray) -> np.ndarray:
    """(I + m l² + rotor) a + m g l cos(q) + friction, by hand."""
    rigid = (INERTIA + MASS * LENGTH**2 + ROTOR) * a + MASS * GRAVITY * LENGTH * np.cos(q)
    return np.asarray(rigid + lugre(v, *FRICTION))


def swing(seconds: float = 40.0, seed: int = 0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Smooth motion with few reversals: time, position, noisy effort without contact."""
    rng = np.random.default_rng(seed)
    t = PERIOD * np.arange(round(seconds / PERIOD))
    q = 0.9 * np.sin(0.8 * t)
    v = 0.72 * np.cos(0.8 * t)
    a = -0.576 * np.sin(0.8 * t)
    return t, q, torque(q, v, a) + rng.normal(0, 0.2, t.size)


def velocity_of(t: np.ndarray) -> np.ndarray:
    return np.asarray(0.72 * np.cos(0.8 * t))


def as_log(t: np.ndarray, q: np.ndarray, effort: np.ndarray) -> JointLog:
    return make_log(t, q[:, None], velocity_of(t)[:, None], effort[:, None])


def audit(log: JointLog, cfg: Config, friction: FrictionFile | None) -> Audit:
    robot = build_robot(cfg.robot, Path(), log.joint_names)
    return audit_log(prepare(log, robot, cfg), cfg, friction, NOBODY, siblings=None)


def fitted(seed: int) -> FrictionFile:
    q, v = strokes(SPEEDS)
    a = np.gradient(v, PERIOD)
    noise = np.random.default_rng(seed).normal(0, 0.2, q.size)
    log = make_log(PERIOD * np.arange(q.size), q[:, None], v[:, None], (torque(q, v, a) + noise)[:, None])
    cfg = config()
    return fit_logs([prepare(log, build_robot(cfg.robot, Path(), log.joint_names), cfg)], cfg, NOBODY)


@pytest.fixture(scope="module")
def friction() -> FrictionFile:
    return fitted(1)


def test_friction_is_found_within_its_intervals(monkeypatch: pytest.MonkeyPatch) -> None:
    """Parameters of one draw err together: of twelve draws at 95 % three or fewer miss (1 in 400 otherwise)."""
    without_thresholds(monkeypatch)
    inside = []
    for seed in range(12):
        fit = fitted(seed).joints["joint1"]
        assert fit.identifiable
        assert fit.n_pairs == len(SPEEDS)
        inside += [lo <= x <= hi for (lo, hi), x in zip(fit.ci95.values(), FRICTION, strict=True)]
    assert sum(inside) >= 0.75 * len(inside)


def test_clean_motion_passes_with_a_residual_of_the_noise(friction: FrictionFile) -> None:
    t, q, effort = swing()
    found = audit(as_log(t, q, effort), config(), friction)
    assert found.result.verdict == "pass", found.result.reasons
    assert found.result.collisions == ()
    level = found.result.residual["joint1"]
    assert found.result.detection is not None
    assert level.rms_nm == pytest.approx(0.2 * found.result.detection.delay.noise_gain, rel=0.2)
    assert found.result.recommended["joint1"].gamma_nm is None, "less than three minutes support no threshold"


def test_pushes_are_found_where_they_are(friction: FrictionFile) -> None:
    t, q, effort = swing()
    for start, end, push in ((8.4, 8.5, 6.0), (16.2, 16.6, -9.0)):
        effort = effort + push * ((t >= start) & (t < end))
    found = audit(as_log(t, q, effort), config(), friction).result
    assert found.verdict == "fail"
    assert [c.onset_s for c in found.collisions] == pytest.approx([8.4, 16.2], abs=2 * PERIOD)
    assert [c.detected_s - c.onset_s for c in found.collisions] == pytest.approx([12 * PERIOD] * 2, abs=1e-9)
    # The kernel, of 7 ms standard deviation, moves the crossing of 4 of 6 N·m by 3 ms inwards at either end.
    assert [c.duration_s for c in found.collisions] == pytest.approx([0.094, 0.4], abs=2 * PERIOD)
    assert [np.sign(c.peak_nm) for c in found.collisions] == [1, -1]


@pytest.mark.parametrize(
    ("push", "length", "kind"), [(3.7, 0.2, "amplitude"), (6.0, 0.020, "persistence"), (2.0, 0.2, None)]
)
def test_near_misses_are_told_apart(friction: FrictionFile, push: float, length: float, kind: str | None) -> None:
    t, q, effort = swing()
    found = audit(as_log(t, q, effort + push * ((t >= 8.4) & (t < 8.4 + length))), config(), friction).result
    assert found.collisions == ()
    assert [m.kind for m in found.near_misses] == ([kind] if kind else [])


def test_a_push_within_breakaway_on_a_standing_joint_is_not_called_clean(friction: FrictionFile) -> None:
    t = PERIOD * np.arange(10000)
    q = np.full(t.size, 0.3)
    hold = MASS * GRAVITY * LENGTH * np.cos(q)
    noise = np.random.default_rng(0).normal(0.0, 0.02, t.size)
    still = make_log(t, q[:, None], np.zeros((t.size, 1)), (hold + noise)[:, None])
    hidden = audit(still, config(), friction)
    assert hidden.result.verdict == "not_judged"
    assert hidden.result.coverage.joints["joint1"].judged_s == 0.0
    assert hidden.result.coverage.joints["joint1"].standing_s > 19
    push = 20.0 * ((t >= 5) & (t < 5.2))
    assert still.effort is not None
    beyond = audit(replace(still, effort=still.effort + push[:, None]), config(), friction).result
    assert beyond.verdict == "fail"
    assert beyond.collisions[0].peak_nm == pytest.approx(20.0, abs=0.3), "the change against the quiet level"


def test_a_gap_neither_fires_nor_hides(friction: FrictionFile) -> None:
    t, q, effort = swing()
    effort = effort + 6.0 * ((t >= 8.390) & (t < 8.410)) + 6.0 * ((t >= 8.450) & (t < 8.470))
    keep = (t < 8.410) | (t >= 8.450)
    found = audit(as_log(t[keep], q[keep], effort[keep]), config(), friction).result
    assert found.collisions == (), "two short exceedances were joined across a gap"
    assert "time-gap" in {f.code for f in found.findings}
    assert found.coverage.gaps_s == pytest.approx(0.04, abs=2 * PERIOD)
    assert "edge" in found.coverage.joints["joint1"].not_judged_s


def test_missing_and_saturated_effort_is_not_judged(friction: FrictionFile) -> None:
    t, q, effort = swing()
    broken = effort.copy()
    broken[4200:4300] = np.nan
    broken[8000:8100] = effort.max() + 30.0
    audited = audit(as_log(t, q, broken), config(), friction)
    state = audited.signals.state[:, 0]
    assert np.all(state[4200:4300] == State.NOT_A_NUMBER)
    assert np.all(state[8000:8100] == State.SATURATED)
    assert audited.result.collisions == ()
    seconds = audited.result.coverage.joints["joint1"].not_judged_s
    for reason in ("not-a-number", "saturated"):  # and what the kernel makes of it on either side
        assert 0.2 - PERIOD <= seconds[reason] <= 0.23


def test_an_inverted_effort_is_not_judged_and_never_flipped(friction: FrictionFile) -> None:
    t, q, effort = swing()
    found = audit(as_log(t, q, -effort), config(), friction).result
    assert found.verdict == "not_judged"
    assert "effort-sign-inverted" in {f.code for f in found.findings}
    assert found.residual["joint1"].judged_s == 0.0


def test_a_joint_without_friction_is_not_judged(friction: FrictionFile) -> None:
    t, q, effort = swing()
    found = audit(as_log(t, q, effort), config(), replace(friction, joints={})).result
    assert found.verdict == "not_judged"
    assert "no friction model" in found.reasons[0]


def test_friction_from_the_judged_log_is_said() -> None:
    q, v = strokes(SPEEDS)
    a = np.gradient(v, PERIOD)
    noise = np.random.default_rng(1).normal(0, 0.2, q.size)
    log = make_log(PERIOD * np.arange(q.size), q[:, None], v[:, None], (torque(q, v, a) + noise)[:, None])
    found = audit(log, config(), None).result
    assert "friction-same-log" in {f.code for f in found.findings}
    assert found.collisions == ()


def test_a_friction_file_fitted_on_the_judged_log_is_said(friction: FrictionFile) -> None:
    log = as_log(*swing())

    def said(logs: dict[str, str]) -> set[str]:
        file = replace(friction, provenance=replace(friction.provenance, logs=logs))
        return {f.code for f in audit(log, config(), file).result.findings}

    assert "friction-same-log" in said({"renamed.csv": log.source.sha256})
    assert "friction-same-log" in said({"other.csv": "1" * 64, "renamed.csv": log.source.sha256})
    assert "friction-same-log" not in said({"other.csv": "1" * 64})


def test_an_effort_of_unknown_unit_is_fitted_and_never_judged(friction: FrictionFile) -> None:
    t, q, effort = swing()
    found = audit(replace(as_log(t, q, effort), effort_unit="raw"), config(), friction).result
    assert found.verdict == "not_judged"
    assert "effort-kind" in {f.code for f in found.findings}


def test_policy_breach_wins_over_not_judged(friction: FrictionFile) -> None:
    t, q, effort = swing()
    effort = effort + 9.0 * ((t >= 8.4) & (t < 8.6))
    effort[10000:] = np.nan
    found = audit(as_log(t, q, effort), config(), friction).result
    assert found.verdict == "fail"
    assert len(found.reasons) == 2, "the broken policy and the part not judged are both said"


def test_recommendations_pool_several_logs(friction: FrictionFile) -> None:
    audits = []
    for seed in range(3):
        t, q, effort = swing(seed=seed)
        audits.append(audit(as_log(t, q, effort), config(), friction))
    together = recommend_arm(audits).joints["joint1"]
    alone = [a.result.recommended["joint1"] for a in audits]
    assert together.clean_hours == pytest.approx(sum(r.clean_hours for r in alone))
    assert "3 min are needed" in together.missing[0]


def test_samples_missing_within_every_run_of_n_blind_the_rule(friction: FrictionFile) -> None:
    t, q, effort = swing()
    effort = effort + 12.0 * ((t >= 8.4) & (t < 8.9))
    effort[::12] = np.nan
    found = audit(as_log(t, q, effort), config(), friction).result
    assert found.verdict == "not_judged", found.reasons
    assert found.coverage.joints["joint1"].judged_s == 0.0
    assert "too-brief" in found.coverage.joints["joint1"].not_judged_s
    assert found.recommended["joint1"].gamma_nm is None


def test_a_persistence_longer_than_the_log_judges_nothing(friction: FrictionFile) -> None:
    t, q, effort = swing()
    with pytest.raises(NotJudgedError, match="longer than the log"):
        audit(as_log(t, q, effort), config(detect={"persistence_ms": 1e6}), friction)


def test_time_lost_in_gaps_counts_against_coverage(friction: FrictionFile) -> None:
    t, q, effort = swing()
    keep = (t < 8.0) | (t >= 24.0)
    found = audit(as_log(t[keep], q[keep], effort[keep]), config(), friction).result
    assert found.verdict == "not_judged"
    assert "gaps" in " ".join(found.reasons)
    short = (t < 8.0) | (t >= 9.0)
    passed = audit(as_log(t[short], q[short], effort[short]), config(), friction).result
    assert passed.verdict == "pass", passed.reasons
    assert any("Gaps in the log: 1" in text for text in passed.exclusions), "a pass says what it does not speak of"


def test_a_collision_clipped_by_saturation_is_no_pass(friction: FrictionFile) -> None:
    t, q, effort = swing()
    pushed = effort + 60.0 * ((t >= 8.4) & (t < 8.9))
    clipped = np.minimum(pushed, effort.max() + 10.0)
    found = audit(as_log(t, q, clipped), config(), friction).result
    assert found.verdict != "pass", found.reasons
    assert "event-cut" in {f.code for f in found.findings} or found.collisions


def test_motion_below_the_fitted_speeds_is_not_standing(friction: FrictionFile) -> None:
    fit = friction.joints["joint1"]
    narrow = replace(friction, joints={"joint1": replace(fit, speed_range_rad_s=(0.69, 1.2))})
    t, q, effort = swing()
    found = audit(as_log(t, q, effort), config(policy={"observable_n": {"tool": 50.0}}), narrow).result
    assert found.verdict == "not_judged", "only the sign of friction is known there"
    cover = found.coverage.joints["joint1"]
    assert cover.moving_s > 30 and cover.standing_s > 25


def test_friction_of_an_absent_joint_or_another_model_is_said(friction: FrictionFile) -> None:
    t, q, effort = swing()
    other = replace(friction.provenance, model_sha256="0" * 64)
    extra = {**friction.joints, "joint9": friction.joints["joint1"]}
    found = audit(as_log(t, q, effort), config(), replace(friction, joints=extra, provenance=other)).result
    codes = {f.code for f in found.findings}
    assert {"friction-other-model", "log-joints-missing"} <= codes
    assert found.verdict == "not_judged"


def test_degrees_taken_for_radians_are_not_judged(friction: FrictionFile) -> None:
    t, q, effort = swing()
    log = make_log(t, np.rad2deg(q)[:, None], np.rad2deg(velocity_of(t))[:, None], effort[:, None])
    found = audit(log, config(), friction).result
    assert found.verdict == "not_judged"
    assert found.collisions == ()
    assert "log-unit-suspect" in {f.code for f in found.findings}


def test_motion_beyond_the_evidence_of_a_threshold_is_said(friction: FrictionFile) -> None:
    t, q, effort = swing()
    assert friction.thresholds is not None
    of_joint = friction.thresholds.joints["joint1"]
    assert of_joint.evidence is not None, "the friction file keeps what its thresholds rest on"
    slow = replace(of_joint, evidence=replace(of_joint.evidence, fastest_rad_s=0.3))
    rested = replace(friction, thresholds=replace(friction.thresholds, joints={"joint1": slow}))
    found = audit(as_log(t, q, effort), config(detect={"gamma_nm": "auto"}), rested).result
    (said,) = [f for f in found.findings if f.code == "evidence-range"]
    assert said.severity == "warning" and "faster than 0.3 rad/s" in said.text
    known = of_joint.evidence
    assert known.fastest_rad_s == pytest.approx(max(abs(v) for v in SPEEDS), rel=0.2)
    assert known.reversals > 0 and known.least_nm < known.most_nm
