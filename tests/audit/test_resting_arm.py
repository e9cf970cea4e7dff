"""An arm that never moves, without a friction file, is judged for changes of its torque, and never passes."""

from __future__ import annotations

import warnings
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from arms import LEVEL, dh_robot, dh_row
from origins import NOBODY
from synthetic import PERIOD, make_log

from collaudit.core.audit import audit_log
from collaudit.core.config.schema import Config
from collaudit.core.data.audit_result import Audit, FrictionFile
from collaudit.core.data.joint_log import JointLog
from collaudit.core.data.signals import State
from collaudit.core.fitting import fit_logs
from collaudit.core.prepare.preparation import prepare
from collaudit.core.prepare.quiet_level import quiet_levels
from collaudit.core.robot.robot_building import build_robot

LOAD_NM = 6.0 * 9.80665 * 0.4 * np.cos(0.3)


def config(source: str, **detect: Any) -> Config:
    robot = dh_robot([dh_row(6.0, (0, 0, 0), (0, 0, 0.05), a=0.4)], **LEVEL)
    return Config.of({"robot": robot, "log": {"effort_kind": f"{source}-torque"}, "detect": detect})


def resting(seconds: float = 20.0, *, every_s: float = 0.0, lasting_s: float = 0.5, push_nm: float = 3.0) -> JointLog:
    """A standing pendulum; a touch of uneven force begins every so many seconds."""
    rng = np.random.default_rng(3)
    t = PERIOD * np.arange(round(seconds / PERIOD))
    q = 0.3 + 1e-5 * rng.integers(-1, 2, t.size)
    v = rng.normal(0, 1e-3, t.size)
    effort = LOAD_NM + 0.4 + 0.05 * np.round(rng.normal(0, 1.0, t.size))
    if every_s:
        since = np.mod(t, every_s) - 1.0
        touched = (since >= 0) & (since < lasting_s)
        effort += push_nm * touched * np.sin(np.pi * np.clip(since / lasting_s, 0, 1)) ** 0.5
        effort += 0.3 * touched * np.sin(40 * t)
    return make_log(t, q[:, None], v[:, None], effort[:, None])


def audit(log: JointLog, source: str = "joint", **detect: Any) -> Audit:
    cfg = config(source, **detect)
    return audit_log(
        prepare(log, build_robot(cfg.robot, Path(), log.joint_names), cfg), cfg, None, NOBODY, siblings=None
    )


def codes(found: Audit) -> set[str]:
    return {finding.code for finding in found.result.findings}


@pytest.mark.parametrize("lasting_s", [0.3, 1.3])
def test_every_touch_is_one_alarm_even_where_touches_fill_most_of_the_time(lasting_s: float) -> None:
    found = audit(resting(every_s=2.0, lasting_s=lasting_s))
    onsets = [alarm.onset_s for alarm in found.result.collisions]
    assert onsets == pytest.approx([2.0 * k + 1.0 for k in range(10)], abs=0.03)
    assert (found.signals.state == State.JUDGED).mean() > 0.9


@pytest.mark.parametrize("step_nm", [0.5, 2.0])
def test_torques_in_coarse_steps_have_thresholds_above_a_step(step_nm: float) -> None:
    """At rest such a torque does not vary at all, which is no threshold of nothing."""
    fine = resting(every_s=4.0, push_nm=30.0)
    assert fine.effort is not None
    found = audit(replace(fine, effort=step_nm * np.round(fine.effort / step_nm)), gamma_nm="auto")
    assert found.result.rule.gamma_nm["joint1"] > step_nm
    assert len(found.result.contacts) == 5
    same = audit(replace(fine, effort=np.full_like(fine.effort, 5.0)), gamma_nm="auto")
    assert same.result.verdict == "not_judged"


def test_nothing_happens_and_it_is_no_pass() -> None:
    found = audit(resting())
    assert not found.result.collisions
    assert found.result.verdict == "not_judged"
    assert "judged-for-changes" in codes(found)
    assert "fit-doubtful" not in codes(found)


def test_a_load_that_is_always_there_is_part_of_the_level_and_said() -> None:
    found = audit(resting(every_s=1000.0))
    (finding,) = [f for f in found.result.findings if f.code == "judged-for-changes"]
    assert "cannot be seen" in finding.text
    assert "joint1 0.4" in finding.text
    assert finding.forbids_pass


def test_at_the_motor_a_change_is_evidence_and_none_proves_nothing() -> None:
    found = audit(resting(every_s=2.0), source="motor")
    assert len(found.result.collisions) == 10
    assert not (found.signals.state == State.JUDGED).any()
    assert (found.signals.state == State.FRICTION_INTERVAL).mean() > 0.9
    (finding,) = [f for f in found.result.findings if f.code == "judged-for-changes"]
    assert "friction" in finding.text


def test_the_level_follows_slow_drift() -> None:
    log = resting(600.0, every_s=20.0)
    t = log.time_s
    drifted = make_log(t, log.position_rad, log.velocity_rad_s, log.effort + 2.0 * (t / 600.0)[:, None])  # type: ignore[operator]
    found = audit(drifted)
    assert len(found.result.collisions) == 30


def test_what_is_stated_wins_and_a_threshold_inside_the_spread_is_said() -> None:
    assert audit(resting(every_s=2.0), gamma_nm=5.0).result.collisions == ()
    assert "gamma-too-tight" in codes(audit(resting(every_s=2.0), gamma_nm=0.1))


def test_an_arm_that_moves_has_no_quiet_level() -> None:
    log = resting()
    moved = make_log(log.time_s, log.position_rad + 0.02 * np.sin(log.time_s)[:, None], None, log.effort)
    cfg = config("joint")
    assert not quiet_levels(prepare(moved, build_robot(cfg.robot, Path(), log.joint_names), cfg))


def test_an_effort_that_is_no_number_has_no_level_and_no_warning() -> None:
    log = resting()
    dead = make_log(log.time_s, log.position_rad, log.velocity_rad_s, np.full_like(log.position_rad, np.nan))
    cfg = config("joint")
    with warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)
        prepared = prepare(dead, build_robot(cfg.robot, Path(), dead.joint_names), cfg)
        assert not quiet_levels(prepared)


def with_friction(coulomb_nm: float) -> FrictionFile:
    """Friction of the pendulum as an earlier fit has it, with the thresholds of its motion."""
    cfg = config("motor")
    t = PERIOD * np.arange(round(60.0 / PERIOD))
    q = 0.3 + 0.6 * np.sin(0.5 * t) * np.sin(0.11 * t)
    v, a = np.gradient(q, PERIOD), np.gradient(np.gradient(q, PERIOD), PERIOD)
    robot = build_robot(cfg.robot, Path(), ("joint1",))
    rigid = robot.inverse_dynamics(q[:, None], v[:, None], a[:, None])[:, 0]
    effort = rigid + coulomb_nm * np.tanh(v / 0.005) + 0.5 * v + np.random.default_rng(1).normal(0, 0.05, t.size)
    return fit_logs([prepare(make_log(t, q[:, None], v[:, None], effort[:, None]), robot, cfg)], cfg, NOBODY)


@pytest.mark.parametrize("gamma_nm", ["auto", 1.5])
def test_a_friction_file_hides_no_push_that_is_found_without_it(gamma_nm: Any) -> None:
    """Friction that could hold every push is no reason not to look at the change of torque."""
    log = resting(60.0, every_s=6.0, push_nm=3.0)
    friction = with_friction(8.0)
    cfg = config("motor", gamma_nm=gamma_nm)
    prepared = prepare(log, build_robot(cfg.robot, Path(), log.joint_names), cfg)
    known, unknown = (audit_log(prepared, cfg, file, NOBODY, siblings=None).result for file in (friction, None))
    assert len(unknown.contacts) == 10
    assert [c.onset_s for c in known.contacts] == pytest.approx([c.onset_s for c in unknown.contacts], abs=0.02)
    quiet = prepare(resting(60.0), build_robot(cfg.robot, Path(), log.joint_names), cfg)
    assert audit_log(quiet, cfg, friction, NOBODY, siblings=None).result.contacts == ()


def test_a_load_that_friction_cannot_hold_counts_though_it_never_changes() -> None:
    log = resting(20.0)
    assert log.effort is not None
    cfg = config("motor", gamma_nm=1.5)
    held = prepare(replace(log, effort=log.effort + 12.0), build_robot(cfg.robot, Path(), log.joint_names), cfg)
    assert audit_log(held, cfg, with_friction(4.0), NOBODY, siblings=None).result.verdict == "fail"
