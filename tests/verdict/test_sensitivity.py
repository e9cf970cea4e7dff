"""How small a torque would have alarmed, against pushes just above and below it; and what the verdict makes of it."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from arms import LEVEL, dh_robot, dh_row
from origins import NOBODY
from synthetic import PERIOD, lugre, make_log, strokes

from collaudit.core.audit import audit_log
from collaudit.core.config.schema import Config
from collaudit.core.data.audit_result import AuditResult, FrictionFile
from collaudit.core.data.joint_log import JointLog
from collaudit.core.errors import ConfigError
from collaudit.core.fitting import fit_logs
from collaudit.core.prepare.prepared import prepare
from collaudit.core.robot import load_robot
from collaudit.core.verdict.sensitivity import Observable, _lasting, level_at, observable_torques

NAMES = ("joint1", "joint2")
ROBOT = dh_robot(
    [dh_row(4.0, (0, 0, 0), (0, 0, 0.05), a=0.4), dh_row(2.0, (0, 0, 0), (0, 0, 0.02), a=0.3)],
    armature_kg_m2=[0.3, 0.3],
    **LEVEL,
)
#: Joint 2 holds 11 N·m at rest, and 20 % more where its level is not known (95 %): 2 · 13 + 4 = 30 N·m can hide.
FRICTION = ((2.0, 0.8, 10.0, 1.5), (8.0, 3.0, 10.0, 2.0))
HOLD_NM, HIDDEN_NM = 13.0, 30.0


def config(**sections: Any) -> Config:
    return Config.of({"robot": ROBOT, **sections})


def friction_of(v: np.ndarray) -> np.ndarray:
    return np.column_stack([lugre(v[:, j], *FRICTION[j]) for j in range(2)])


def log_of(q: np.ndarray, period: float = PERIOD, external: np.ndarray | float = 0.0, seed: int = 1) -> JointLog:
    """A log (n, 2) whose friction is that of the motion, 0 at rest; ``external`` is added to the effort."""
    v = np.gradient(q, period, axis=0)
    a = np.gradient(v, period, axis=0)
    robot = load_robot(config().robot, Path(), NAMES)
    noise = np.random.default_rng(seed).normal(0, 0.02, q.shape)
    effort = robot.inverse_dynamics(q, v, a) + friction_of(v) + noise + external
    return make_log(period * np.arange(len(q)), q, v, effort, NAMES)


@pytest.fixture(scope="module")
def friction() -> FrictionFile:
    stroke, _ = strokes((0.03, 0.06, 0.1, 0.2, 0.4, 0.8))
    rest = np.full_like(stroke, -0.5)
    q = np.concatenate([np.column_stack([stroke, rest]), np.column_stack([rest, stroke])])
    return fit_logs([prepare(log_of(q), load_robot(config().robot, Path(), NAMES), config())], config(), NOBODY)


def audit(log: JointLog, friction: FrictionFile, **sections: Any) -> AuditResult:
    cfg = config(**sections)
    return audit_log(prepare(log, load_robot(cfg.robot, Path(), NAMES), cfg), cfg, friction, NOBODY).result


def one_standing(seconds: float, period: float = PERIOD) -> np.ndarray:
    """Joint 1 swings, joint 2 stands."""
    t = period * np.arange(round(seconds / period))
    return np.column_stack([0.5 * np.sin(1.2 * t), np.full_like(t, -0.5)])


def torque_at(result: AuditResult, joint: str, share: float) -> float | None:
    assert result.sensitivity is not None
    (level,) = [level for level in result.sensitivity.joints[joint].levels if level.share == share]
    return level.torque_nm


def lowest_lasting(level: np.ndarray, n: int) -> np.ndarray:
    out = np.full(level.size, np.inf)
    for start in range(level.size - n + 1):
        out[start : start + n] = np.minimum(out[start : start + n], level[start : start + n].max())
    return out


@pytest.mark.parametrize("n", [1, 2, 3, 12, 13, 40, 41])
def test_a_torque_has_to_exceed_the_level_at_each_of_n_samples(n: int) -> None:
    rng = np.random.default_rng(n)
    level = rng.random(40)
    level[rng.random(40) < 0.1] = np.inf
    assert np.array_equal(_lasting(level.copy(), n), lowest_lasting(level, n))


def test_unknown_values_exceed_every_level() -> None:
    known = np.array([3.0, 1.0, 2.0])
    assert level_at(known, 4, (0.25, 0.5, 0.75, 0.76, 1.0)) == [1.0, 2.0, 3.0, None, None]
    assert level_at(known[:0], 4, (0.5,)) == [None]


@pytest.mark.parametrize(("share", "seen"), [(0.93, False), (1.07, True)])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_torque_on_a_standing_joint_shows_above_what_is_said_to_hide(
    friction: FrictionFile, share: float, seen: bool, sign: float
) -> None:
    """The worst case: friction holds as much as it can, and the push turns it over."""
    q = one_standing(20.0)
    hold = np.zeros_like(q)
    hold[:, 1] = -sign * HOLD_NM
    said = audit(log_of(q, external=hold), friction)
    assert not said.contacts
    hides = torque_at(said, "joint2", 0.5)
    assert hides == pytest.approx(HIDDEN_NM, rel=0.05)
    t = PERIOD * np.arange(len(q))
    hold[(t >= 8.0) & (t < 8.2), 1] += sign * share * hides
    assert bool(audit(log_of(q, external=hold), friction).contacts) == seen


def test_a_moving_joint_shows_its_threshold_and_what_the_level_of_friction_may_be_wrong_by(
    friction: FrictionFile,
) -> None:
    q = one_standing(20.0)
    smallest = torque_at(audit(log_of(q), friction), "joint1", 0.5)
    assert smallest is not None
    assert 4.0 < smallest < 5.0
    t = PERIOD * np.arange(len(q))
    quarter = np.pi / 2 / 1.2
    fast = 4 * 2 * quarter  # joint 1 is at its fastest
    push = np.zeros_like(q)
    push[(t >= fast) & (t < fast + 0.1), 0] = 1.05 * smallest
    assert audit(log_of(q, external=push), friction).contacts


def test_an_hour_in_which_a_standing_joint_hides_30_nm_does_not_pass(friction: FrictionFile) -> None:
    found = audit(log_of(one_standing(3600.0, 0.02), 0.02), friction)
    assert not found.contacts
    assert found.verdict == "not_judged", found.reasons
    (reason,) = found.reasons
    assert "joint2" in reason and "60 min" in reason
    assert found.sensitivity is not None
    assert found.sensitivity.joints["joint2"].largest_nm == pytest.approx(HIDDEN_NM, rel=0.05)
    accepted = audit(log_of(one_standing(3600.0, 0.02), 0.02), friction, policy={"observable_nm": {"joint2": 40.0}})
    assert accepted.verdict == "pass", accepted.reasons


def test_everyday_motion_passes_and_says_what_hides(friction: FrictionFile) -> None:
    found = audit(log_of(one_standing(60.0)), friction)
    assert found.verdict == "pass", found.reasons
    (hidden,) = [text for text in found.exclusions if "Hidden by friction" in text]
    assert "joint2 up to 30" in hidden and "of 60 s (asked: 15" in hidden
    assert "a torque of 8 N·m would have alarmed in 99 % of the motion" in found.reasons[0]


@pytest.mark.parametrize(
    ("policy", "verdict"),
    [
        ({"observable_nm": 6.0, "min_observable": 0.5}, "pass"),
        ({"observable_nm": 4.1, "min_observable": 0.95}, "not_judged"),
        ({"observable_nm": 4.1, "min_observable": 0.0}, "pass"),
        ({"max_hidden_s": 20.0}, "not_judged"),
        ({"max_hidden_s": 20.0, "observable_nm": {"joint2": 40.0}}, "pass"),
    ],
)
def test_the_policy_says_what_is_to_be_noticeable(friction: FrictionFile, policy: dict[str, Any], verdict: str) -> None:
    found = audit(log_of(one_standing(30.0)), friction, policy=policy)
    assert found.verdict == verdict, found.reasons
    assert any(f.code == "coverage-low" for f in found.findings) == (verdict == "not_judged")


def test_times_of_a_joint_add_up(friction: FrictionFile) -> None:
    log = log_of(one_standing(30.0))
    found = audit(log, friction)
    assert found.sensitivity is not None
    for joint in found.sensitivity.joints.values():
        for time in (joint.all, joint.motion):
            assert time.detectable_s + time.hidden_s + time.not_judged_s == pytest.approx(time.time_s)
        assert joint.all.time_s == pytest.approx(30.0, abs=2 * PERIOD)
    assert found.sensitivity.joints["joint2"].motion.time_s == 0.0


@pytest.mark.parametrize(
    ("gamma", "hold", "asked"), [(4.0, 1.0, 8.0), (4.0, 10.0, 14.0), (4.0, 30.0, 20.0), (25.0, 10.0, 50.0)]
)
def test_what_is_to_be_noticeable_follows_from_threshold_and_friction(gamma: float, hold: float, asked: float) -> None:
    law = SimpleNamespace(hold=hold)
    found = observable_torques(config().policy, {"joint1": gamma}, {"joint1": law})  # type: ignore[dict-item]
    assert found["joint1"] == Observable(asked, stated=False)
    stated = config(policy={"observable_nm": 7.0}).policy
    assert observable_torques(stated, {"joint1": gamma}, {}) == {"joint1": Observable(7.0, stated=True)}


def test_a_torque_asked_for_on_an_unknown_joint_is_an_error(friction: FrictionFile) -> None:
    with pytest.raises(ConfigError, match="not judged"):
        audit(log_of(one_standing(10.0)), friction, policy={"observable_nm": {"elbow": 5.0}})


@pytest.mark.parametrize("seconds", [0.01, 0.2])
def test_a_residual_above_the_threshold_in_motion_too_fast_to_judge_is_no_pass(
    friction: FrictionFile, seconds: float
) -> None:
    """Half of the pushes of an arm that runs faster than it was fitted were missed, and nothing was said."""
    t = PERIOD * np.arange(15_000)
    q = np.column_stack([0.5 * np.sin(1.9 * t), np.full_like(t, -0.5)])
    blind = {"beyond_range": 0.0}
    clean = audit(log_of(q), friction, detect=blind)
    assert clean.coverage.joints["joint1"].not_judged_s["too-fast"] > 1.0
    quarter = np.pi / 2 / 1.9
    fast = 6 * 2 * quarter
    push = np.zeros_like(q)
    push[np.abs(t - fast) < seconds / 2, 0] = 12.0
    pushed = audit(log_of(q, external=push), friction, detect=blind)
    assert any("a contact may have been missed" in reason for reason in pushed.reasons) == (seconds > 0.1)
    judged = audit(log_of(q, external=push), friction)
    assert "too-fast" not in judged.coverage.joints["joint1"].not_judged_s, "a raised threshold judges it"
    assert bool(judged.collisions) == (seconds > 0.1)
    assert not audit(log_of(q), friction).collisions
    assert not any("a contact may have been missed" in reason for reason in clean.reasons)
