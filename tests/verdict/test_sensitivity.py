"""How small a torque would have alarmed, against pushes just above and below it; and what the verdict makes of it."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from arms import LEVEL, dh_robot, dh_row
from origins import NOBODY
from scipy.special import erf
from synthetic import PERIOD, lugre, make_log, strokes

from collaudit.core.audit import audit_log
from collaudit.core.config.schema import Config
from collaudit.core.data.audit_result import AuditResult, FrictionFile
from collaudit.core.data.identification_result import EstimateChoice, TriedEstimate
from collaudit.core.data.joint_log import JointLog
from collaudit.core.errors import ConfigError
from collaudit.core.fitting import fit_logs
from collaudit.core.numeric.arrays import Span
from collaudit.core.numeric.filters import butterworth, double_pole, first_order
from collaudit.core.prepare import hand_guiding
from collaudit.core.prepare.effort_smoothing import Smoothing
from collaudit.core.prepare.preparation import prepare
from collaudit.core.residual import residual
from collaudit.core.robot.robot_building import build_robot
from collaudit.core.verdict import sensitivity
from collaudit.core.verdict.sensitivity import Push, _height

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
    robot = build_robot(config().robot, Path(), NAMES)
    noise = np.random.default_rng(seed).normal(0, 0.02, q.shape)
    effort = robot.inverse_dynamics(q, v, a) + friction_of(v) + noise + external
    return make_log(period * np.arange(len(q)), q, v, effort, NAMES)


@pytest.fixture(scope="module")
def friction() -> FrictionFile:
    stroke, _ = strokes((0.03, 0.06, 0.1, 0.2, 0.4, 0.8))
    rest = np.full_like(stroke, -0.5)
    q = np.concatenate([np.column_stack([stroke, rest]), np.column_stack([rest, stroke])])
    return fit_logs([prepare(log_of(q), build_robot(config().robot, Path(), NAMES), config())], config(), NOBODY)


def audit(log: JointLog, friction: FrictionFile, **sections: Any) -> AuditResult:
    cfg = config(**sections)
    return audit_log(
        prepare(log, build_robot(cfg.robot, Path(), NAMES), cfg), cfg, friction, NOBODY, siblings=None
    ).result


def one_standing(seconds: float, period: float = PERIOD) -> np.ndarray:
    """Joint 1 swings, joint 2 stands."""
    t = period * np.arange(round(seconds / period))
    return np.column_stack([0.5 * np.sin(1.2 * t), np.full_like(t, -0.5)])


def torque_at(result: AuditResult, joint: str, share: float) -> float | None:
    assert result.sensitivity is not None
    (level,) = [level for level in result.sensitivity.joints[joint].levels if level.share == share]
    return level.torque_nm


@pytest.mark.parametrize("n", [1, 2, 12, 13, 40])
@pytest.mark.parametrize("kernel", [double_pole(5000.0, False), butterworth(60.0, False), first_order(20.0, True)])
def test_a_push_has_to_exceed_what_is_needed_at_each_of_n_samples(n: int, kernel: Any) -> None:
    """The height found, a trifle more and a trifle less, through the same kernel onto the same need."""
    rng = np.random.default_rng(n)
    push = Push.of(0.06, kernel, n, PERIOD)
    needed = rng.random((50, push.response.size))
    needed[rng.random(needed.shape) < 0.02] = np.inf
    found = _height(needed, push)
    for row, height in zip(needed, found, strict=True):
        alarms = [_lasts(scale * height * push.response > row, n) for scale in (0.999, 1.001)]
        assert alarms == ([False, True] if np.isfinite(height) else [False, False])


def _lasts(mask: np.ndarray, n: int) -> bool:
    return any(mask[k : k + n].all() for k in range(mask.size - n + 1))


def test_a_push_that_is_too_short_for_filter_and_persistence_alarms_at_no_height() -> None:
    assert np.isinf(_height(np.ones((1, 12)), Push.of(0.024, first_order(1e5, True), 14, PERIOD))).all()
    slow, quick = (Push.of(0.2, first_order(gain, True), 13, PERIOD) for gain in (1.0, 60.0))
    heights = [_height(np.ones((1, push.response.size)), push)[0] for push in (slow, quick)]
    assert heights[0] > 5.0, "of a push of 0.2 s a filter of a second passes a fifth"
    assert heights[1] < 1.05


def test_a_push_begins_where_its_response_does() -> None:
    push = Push.of(0.1, butterworth(60.0, False), 3, PERIOD)
    x = np.zeros((400, 1))
    x[200:250] = 1.0
    passed = butterworth(60.0, False).apply(x, [Span(0, 400)], PERIOD)[:, 0]
    assert push.response == pytest.approx(passed[200 - push.lead : 200 - push.lead + push.response.size], abs=1e-3)


@pytest.mark.parametrize(("share", "seen"), [(0.87, False), (1.07, True)])
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
    assert hides == pytest.approx(HIDDEN_NM, rel=0.1)  # a slow swing bounds what smooths the effort at 61 ms: 8 %
    t = PERIOD * np.arange(len(q))
    hold[(t >= 8.0) & (t < 8.2), 1] += sign * share * hides
    assert bool(audit(log_of(q, external=hold), friction).contacts) == seen


@pytest.mark.parametrize(("share", "seen"), [(0.85, False), (1.15, True)])
def test_a_push_that_the_channel_smooths_shows_above_what_is_said(
    friction: FrictionFile, monkeypatch: pytest.MonkeyPatch, share: float, seen: bool
) -> None:
    """A push of 0.2 s behind a window of 0.15 s keeps half of its height, and the torque that is noticed doubles."""
    q, window_s = one_standing(20.0), 0.15
    plain = torque_at(audit(log_of(q), friction), "joint1", 0.5)
    known = dict.fromkeys(("joint1", "joint2"), Smoothing(window_s, window_s, window_s))
    monkeypatch.setattr(hand_guiding, "effort_smoothing", lambda *_: known)
    said = torque_at(audit(log_of(q), friction), "joint1", 0.5)
    assert plain is not None and said is not None
    assert said == pytest.approx(plain / erf(0.1 / (np.sqrt(2.0) * window_s)), rel=0.05)
    t = PERIOD * np.arange(len(q))
    fastest = 3 * np.pi / 1.2
    push = np.zeros_like(q)
    for edge, sign in ((fastest - 0.1, 0.5), (fastest + 0.1, -0.5)):
        push[:, 0] += sign * share * said * erf((t - edge) / (np.sqrt(2.0) * window_s))
    assert bool(audit(log_of(q, external=push), friction).contacts) == seen


def test_where_slow_motion_does_not_bound_the_smoothing_no_push_counts_as_noticed_and_it_is_said(
    friction: FrictionFile, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(hand_guiding, "effort_smoothing", lambda *_: {"joint1": Smoothing(1.0, 0.0, np.inf)})
    found = audit(log_of(one_standing(20.0)), friction)
    assert torque_at(found, "joint1", 0.5) is None
    assert found.verdict == "not_judged"
    (said,) = [f.text for f in found.findings if f.code == "effort-filtered"]
    assert "joint1" in said and "joint2" not in said


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


def test_an_hour_in_which_a_standing_joint_hides_the_torque_asked_for_does_not_pass(friction: FrictionFile) -> None:
    hour = log_of(one_standing(3600.0, 0.02), 0.02)
    found = audit(hour, friction, policy={"observable_nm": {"joint2": 15.0}})
    assert not found.contacts
    assert found.verdict == "not_judged", found.reasons
    (reason,) = found.reasons
    assert "joint2" in reason and "60 min" in reason
    assert found.sensitivity is not None
    assert found.sensitivity.joints["joint2"].largest_nm == pytest.approx(HIDDEN_NM, rel=0.05)
    accepted = audit(hour, friction, policy={"observable_nm": {"joint2": 40.0}})
    assert accepted.verdict == "pass", accepted.reasons


def test_an_arm_that_never_moves_is_judged_by_the_force_that_it_would_have_noticed(friction: FrictionFile) -> None:
    """Two joints that hold up to 10 and 30 N·m on levers of 0.7 and 0.3 m: over all of the time."""
    rest = np.tile([0.1, -0.5], (5000, 1))
    found = audit(log_of(rest), friction, policy={"observable_n": {"tool": 200.0}})
    assert found.sensitivity is not None and found.sensitivity.time is not None
    assert not found.sensitivity.time.moving
    assert found.sensitivity.time.time_s == pytest.approx(10.0, abs=0.1)
    assert found.verdict == "pass", found.reasons
    assert "of the time." in found.reasons[0], "it did not move"
    weak = audit(log_of(rest), friction, policy={"observable_n": {"tool": 20.0}})
    assert weak.verdict == "not_judged"
    assert "of the time; limited by joint" in weak.reasons[0]
    long = audit(log_of(rest), friction, policy={"observable_n": {"tool": 200.0}, "max_hidden_s": 5.0})
    assert long.verdict == "pass", "200 N is noticed at any time"


def test_everyday_motion_passes_and_says_what_would_have_been_noticed(friction: FrictionFile) -> None:
    found = audit(log_of(one_standing(60.0)), friction, policy={"observable_n": {"tool": 30.0}})
    assert found.verdict == "pass", found.reasons
    said = re.fullmatch(
        r"0 contacts and 0 near misses in 60 s, within the policy\. Would have noticed a push \(200 ms\) of (\d+) N at "
        r"the tool, in 90 % of the moving time\.",
        found.reasons[0],
    )
    assert said is not None, found.reasons
    assert 15 < float(said[1]) < 35
    (missed,) = [text for text in found.exclusions if "Not noticed" in text]
    assert "30 N at the tool for" in missed and "of 60 s" in missed
    assert not any("Not noticed" in text for text in audit(log_of(one_standing(60.0)), friction).exclusions)


def test_too_insensitive_says_the_force_what_is_asked_what_limits_it_and_what_to_do(friction: FrictionFile) -> None:
    found = audit(log_of(one_standing(30.0)), friction, detect={"gamma_nm": {"joint1": 90.0, "joint2": 95.0}})
    assert found.verdict == "not_judged"
    (said,) = [reason for reason in found.reasons if "insensitive" in reason]
    assert re.match(r"Too insensitive: \d+ N at the tool, 100 N asked; in 90 % of the moving time; limited by", said)
    assert "(γ 9" in said and "[fit] estimate" in said and "[policy] observable_n" in said
    accepted = audit(
        log_of(one_standing(30.0)),
        friction,
        detect={"gamma_nm": {"joint1": 90.0, "joint2": 95.0}},
        policy={"observable_n": {"tool": 1000.0}},
    )
    assert not [reason for reason in accepted.reasons if "insensitive" in reason]


def test_too_insensitive_says_what_a_better_fit_would_bring(friction: FrictionFile) -> None:
    """In proportion to what it leaves of the held-out motion of the joint that limits."""
    tried = [("friction", 2.0), ("friction, rotor", 0.5)]
    left = tuple(TriedEstimate(what, dict.fromkeys(friction.joints, rms), 0.0) for what, rms in tried)
    known = replace(friction, choice=EstimateChoice("friction", 0.1, left, better="friction, rotor"))
    found = audit(log_of(one_standing(30.0)), known, detect={"gamma_nm": {"joint1": 90.0, "joint2": 95.0}})
    (said,) = [reason for reason in found.reasons if "insensitive" in reason]
    told = re.search(r"insensitive: (\d+) N at the tool.*would bring it to about (\d+) N", said)
    assert told is not None, said
    assert float(told[2]) == pytest.approx(0.25 * float(told[1]), abs=1.0)


def test_a_threshold_that_grows_never_makes_a_log_easier_to_pass(friction: FrictionFile) -> None:
    """The yardstick of a pass was two to five thresholds: any threshold passed."""
    verdicts = []
    for gamma in (4.0, 10.0, 40.0, 200.0):
        found = audit(log_of(one_standing(30.0)), friction, detect={"gamma_nm": gamma})
        assert found.sensitivity is not None
        (tool,) = [force for force in found.sensitivity.forces if force.place == "tool"]
        assert tool.asked is not None and tool.asked.force_n == 100.0
        verdicts.append(found.verdict)
    assert verdicts == ["pass", "pass", "not_judged", "not_judged"]


@pytest.mark.parametrize(
    ("policy", "verdict"),
    [
        ({"observable_nm": 6.0, "observable_share": 0.5}, "pass"),
        ({"observable_nm": 4.001, "observable_share": 0.95}, "not_judged"),
        ({"observable_nm": 4.001, "observable_share": 0.01}, "pass"),
        ({"observable_nm": {"joint2": 15.0}, "max_hidden_s": 20.0}, "not_judged"),
        ({"observable_nm": {"joint2": 40.0}, "max_hidden_s": 20.0}, "pass"),
        ({"observable_n": {"tool": 15.0}}, "not_judged"),
        ({"observable_n": {"tool": 30.0}}, "pass"),
        ({"observable_n": {"tool": 30.0}, "observable_share": 0.999}, "not_judged"),
        ({"observable_n": {"tool": 15.0}, "observable_nm": 6.0}, "not_judged"),
    ],
)
def test_the_policy_says_what_is_to_be_noticeable(friction: FrictionFile, policy: dict[str, Any], verdict: str) -> None:
    found = audit(log_of(one_standing(30.0)), friction, policy=policy)
    assert found.verdict == verdict, found.reasons
    assert any(f.code == "coverage-low" for f in found.findings) == (verdict == "not_judged")


@pytest.mark.parametrize(("push_s", "verdict"), [(0.01, "not_judged"), (0.06, "pass")])
def test_a_push_shorter_than_the_persistence_is_never_noticed(
    friction: FrictionFile, push_s: float, verdict: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sensitivity, "PUSH_S", push_s)
    found = audit(log_of(one_standing(30.0)), friction, policy={"observable_n": {"tool": 100.0}})
    assert found.verdict == verdict, found.reasons


def test_a_torque_asked_for_on_every_joint_takes_the_place_of_the_default_force(friction: FrictionFile) -> None:
    every = audit(log_of(one_standing(30.0)), friction, policy={"observable_nm": 20.0})
    some = audit(log_of(one_standing(30.0)), friction, policy={"observable_nm": {"joint1": 20.0}})
    asked = [[force.asked is not None for force in found.sensitivity.forces][-1] for found in (every, some)]  # type: ignore[union-attr]
    assert asked == [False, True]
    assert "N at the tool" in every.reasons[0], "it is said all the same"


def test_a_slow_filter_notices_less_of_a_push_of_the_same_duration(friction: FrictionFile) -> None:
    def tool_n(**detect: object) -> float:
        found = audit(log_of(one_standing(30.0)), friction, detect=detect)
        assert found.sensitivity is not None
        return found.sensitivity.forces[-1].at(0.5) or np.inf

    quick = tool_n()
    assert tool_n(detector="momentum", observer_gain_per_s=60.0, causal=True) < 1.3 * quick
    assert tool_n(detector="momentum", observer_gain_per_s=2.0, causal=True) > 2.5 * quick


def test_times_of_a_joint_add_up(friction: FrictionFile) -> None:
    found = audit(log_of(one_standing(30.0)), friction, policy={"observable_nm": 6.0})
    assert found.sensitivity is not None
    for joint in found.sensitivity.joints.values():
        assert joint.asked is not None and joint.told_s <= joint.motion_s
        assert joint.asked.noticed_s + joint.asked.unnoticed_s <= 30.0 + PERIOD
        assert joint.asked.noticed_s + joint.asked.unnoticed_s == pytest.approx(30.0, abs=0.5)
    assert found.sensitivity.joints["joint2"].motion_s == 0.0


def test_a_torque_asked_for_on_an_unknown_joint_is_an_error(friction: FrictionFile) -> None:
    with pytest.raises(ConfigError, match="not judged"):
        audit(log_of(one_standing(10.0)), friction, policy={"observable_nm": {"elbow": 5.0}})


@pytest.mark.parametrize("seconds", [0.01, 0.2])
def test_a_residual_above_the_threshold_in_motion_too_fast_to_judge_is_no_pass(
    friction: FrictionFile, seconds: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Half of the pushes of an arm that runs faster than it was fitted were missed, and nothing was said."""
    t = PERIOD * np.arange(15_000)
    q = np.column_stack([0.5 * np.sin(1.9 * t), np.full_like(t, -0.5)])
    monkeypatch.setattr(residual, "MOST_DOUBT", 0.0)
    clean = audit(log_of(q), friction)
    assert clean.coverage.joints["joint1"].not_judged_s["too-fast"] > 1.0
    quarter = np.pi / 2 / 1.9
    fast = 6 * 2 * quarter
    push = np.zeros_like(q)
    push[np.abs(t - fast) < seconds / 2, 0] = 12.0
    pushed = audit(log_of(q, external=push), friction)
    assert any("a contact may have been missed" in reason for reason in pushed.reasons) == (seconds > 0.1)
    monkeypatch.undo()
    judged = audit(log_of(q, external=push), friction)
    assert "too-fast" not in judged.coverage.joints["joint1"].not_judged_s, "a raised threshold judges it"
    assert any(alarm.spoke != "cycle" for alarm in judged.collisions) == (seconds > 0.1)
    assert not audit(log_of(q), friction).collisions
    assert not any("a contact may have been missed" in reason for reason in clean.reasons)
