"""Drives off, braking, stops and guiding are states with a span, not judged; motion and rest under power are none."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from arms import LEVEL, dh_robot, dh_row
from origins import NOBODY
from synthetic import PERIOD, lugre, make_log, strokes

from collaudit.core.arm_states.arm_states import find_arm_states
from collaudit.core.arm_states.drives_off import _zero
from collaudit.core.audit import audit_log
from collaudit.core.conditioning.conditioning import condition
from collaudit.core.config.schema import ConditioningConfig, Config
from collaudit.core.data.audit_result import Audit, FrictionFile
from collaudit.core.data.joint_log import Annotation, JointLog
from collaudit.core.data.signals import State
from collaudit.core.fitting import fit_logs
from collaudit.core.prepare.preparation import prepare
from collaudit.core.robot.robot_building import build_robot

FRICTION = (6.0, 2.0, 8.0, 4.0)
STOP_S, END_S = 20.0, 30.0


def config(sections: Mapping[str, Any] | None = None) -> Config:
    robot = dh_robot([dh_row(6.0, (0, 0, 0), (0, 0, 0.05), a=0.4)], armature_kg_m2=[0.3], **LEVEL)
    return Config.of({"robot": robot, **(sections or {})})


def torque(q: np.ndarray, v: np.ndarray, a: np.ndarray) -> np.ndarray:
    return np.asarray((0.05 + 6.0 * 0.16 + 0.3) * a + 6.0 * 9.80665 * 0.4 * np.cos(q) + lugre(v, *FRICTION))


def run(*, brakes: bool = False, rest_s: float = 0.0, power: bool = True, held: bool = False) -> JointLog:
    """A swing that stops: braked on the fly by drives without current, or at rest, ``rest_s`` before power goes."""
    t = PERIOD * np.arange(round(END_S / PERIOD))
    slow = 0.15 if brakes else 1.0
    rate = np.clip(1.0 - (t - STOP_S) / slow, 0.0, 1.0)
    place = np.concatenate(([0.0], np.cumsum(rate[:-1]))) * PERIOD
    q = 0.3 + 0.5 * np.sin(0.8 * place)
    v = np.gradient(q, PERIOD)
    effort = torque(q, v, np.gradient(v, PERIOD)) + np.random.default_rng(0).normal(0, 0.2, t.size)
    off = t >= (STOP_S if brakes else STOP_S + slow + rest_s)
    if not power:
        effort[off] = 0.0
    if held:
        effort[off] = effort[np.argmax(off) - 1]
    return make_log(t, q[:, None], v[:, None], effort[:, None])


@pytest.fixture(scope="module")
def friction() -> FrictionFile:
    q, v = strokes(np.geomspace(0.02, 1.2, 16))
    effort = torque(q, v, np.gradient(v, PERIOD)) + np.random.default_rng(1).normal(0, 0.2, q.size)
    log = make_log(PERIOD * np.arange(q.size), q[:, None], v[:, None], effort[:, None])
    return fit_logs([prepare(log, build_robot(config().robot, Path(), log.joint_names), config())], config(), NOBODY)


def audit(log: JointLog, friction: FrictionFile, sections: Mapping[str, Any] | None = None) -> Audit:
    cfg = config(sections)
    return audit_log(
        prepare(log, build_robot(cfg.robot, Path(), log.joint_names), cfg), cfg, friction, NOBODY, siblings=None
    )


def states(found: Audit) -> list[str]:
    """Codes of the findings on states; that power was off is a fact."""
    findings = [f for f in found.result.findings if f.code.startswith("arm-") or "not judged there" in f.text]
    return [f.code for f in findings]


def not_driven(found: Audit) -> tuple[float, float]:
    at = found.signals.time_s[found.signals.state[:, 0] == State.NOT_DRIVEN]
    return float(at[0]), float(at[-1])


def test_under_power_there_is_no_state(friction: FrictionFile) -> None:
    found = audit(run(), friction)
    assert states(found) == []
    assert found.result.collisions == ()


def test_brakes_and_no_current_are_one_state_that_forbids_a_pass(friction: FrictionFile) -> None:
    found = audit(run(brakes=True, power=False), friction)
    assert states(found) == ["arm-stopped"]
    start, end = not_driven(found)
    assert start == pytest.approx(STOP_S, abs=0.1)
    assert end == pytest.approx(END_S, abs=0.1)
    assert found.result.collisions == ()
    assert found.result.verdict == "not_judged"


def test_power_off_after_a_rest_is_no_braking(friction: FrictionFile) -> None:
    found = audit(run(rest_s=3.0, power=False), friction)
    assert states(found) == ["fact"]
    assert not_driven(found)[0] == pytest.approx(STOP_S + 4.0, abs=0.1)
    assert found.result.collisions == ()


def test_power_off_at_the_end_of_the_ramp_takes_the_ramp_along(friction: FrictionFile) -> None:
    found = audit(run(rest_s=0.1, power=False), friction)
    assert states(found) == ["arm-stopped"]
    assert not_driven(found)[0] == pytest.approx(STOP_S, abs=0.3)


def test_efforts_that_repeat_at_rest_are_not_judged(friction: FrictionFile) -> None:
    found = audit(run(rest_s=3.0, held=True), friction)
    assert states(found) == ["fact"]
    assert not_driven(found)[0] == pytest.approx(STOP_S + 4.0, abs=0.1)


def test_a_push_before_the_stop_stays_found(friction: FrictionFile) -> None:
    log = run(brakes=True, power=False)
    assert log.effort is not None
    effort = log.effort.copy()
    effort[(log.time_s > 12.0) & (log.time_s < 12.3)] += 9.0
    effort[(log.time_s > STOP_S - 0.04) & (log.time_s < STOP_S)] += 12.0
    found = audit(replace(log, effort=effort), friction)
    assert [c.onset_s for c in found.result.collisions] == pytest.approx([12.0], abs=0.01)
    assert "event-cut" in {f.code for f in found.result.findings}
    assert found.result.verdict == "fail"


@pytest.mark.parametrize(
    ("flag", "code", "forbids"),
    [("protective_stop", "arm-stopped", True), ("freedrive", "arm-guided", False), ("power_off", "fact", False)],
)
def test_what_the_log_says_is_taken(friction: FrictionFile, flag: str, code: str, forbids: bool) -> None:
    log = run()
    assert log.effort is not None
    effort = log.effort.copy()
    effort[(log.time_s > 8.0) & (log.time_s < 10.0)] += 12.0  # the hand that guides the arm
    log = replace(log, effort=effort, annotations=(Annotation(flag, "/mode", ((7.5, 10.5),)),))
    found = audit(log, friction)
    assert states(found) == [code]
    assert found.result.collisions == ()
    assert not_driven(found) == pytest.approx((7.5, 10.5), abs=0.1)
    assert any(f.forbids_pass for f in found.result.findings if f.code == code) == forbids


def test_a_state_without_power_begins_when_braking_does(friction: FrictionFile) -> None:
    """The flag comes when the arm stands; before that its brakes take torques that no model knows."""
    log = run(brakes=True)
    assert log.effort is not None
    effort = log.effort.copy()
    effort[(log.time_s > STOP_S) & (log.time_s < STOP_S + 0.2)] -= 40.0
    flagged = replace(log, effort=effort, annotations=(Annotation("power_off", "/mode", ((STOP_S + 0.24, END_S),)),))
    found = audit(flagged, friction)
    assert states(found) == ["arm-stopped"]
    assert not_driven(found)[0] == pytest.approx(STOP_S, abs=0.03)
    assert found.result.collisions == ()
    assert audit(replace(flagged, annotations=()), friction).result.collisions, "without the state it is an alarm"


def test_a_flag_that_marks_true_events_is_no_state(friction: FrictionFile) -> None:
    log = run()
    assert log.effort is not None
    effort = log.effort.copy()
    effort[(log.time_s > 8.0) & (log.time_s < 8.5)] += 12.0
    log = replace(log, effort=effort, annotations=(Annotation("protective_stop", "/mode", ((8.0, 8.5),)),))
    found = audit(log, friction, {"detect": {"true_events": ["protective_stop"]}})
    assert len(found.result.collisions) == 1
    assert states(found) == []


def test_zero_is_told_against_the_usual_size_of_known_efforts() -> None:
    """An effort that is mostly near zero: its 95 % quantile tells what it bears, not its median."""
    effort = np.full((1000, 3), 0.01)
    effort[::10] = 8.0
    effort[5::50] = np.nan
    load = np.full((1000, 3), 20.0)
    found = _zero(effort, np.zeros(1000, dtype=bool), load)
    known = np.isfinite(effort[:, 0])
    np.testing.assert_array_equal(found, known & (effort[:, 0] < 1.0))


def test_efforts_in_an_unknown_unit_do_not_tell_that_drives_are_off() -> None:
    """In amperes behind a worm gear nothing is what holds the arm; what is zero there may be as it should."""
    t = 0.002 * np.arange(4000)
    q = 0.5 * np.sin(t)[:, None] * np.ones(3)
    effort = np.random.default_rng(0).normal(0, 1.0, q.shape) + 5.0
    effort[2000:3000] *= 1e-3
    rigid = np.full(q.shape, 20.0)
    log = make_log(t, q, np.gradient(q, 0.002, axis=0), effort, ["a", "b", "c"])
    assert find_arm_states(condition(log, ConditioningConfig()), rigid)[0].any()
    raw = condition(replace(log, effort_unit="raw"), ConditioningConfig())
    assert not find_arm_states(raw, rigid)[0].any()
