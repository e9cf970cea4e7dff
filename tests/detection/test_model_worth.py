"""A model that makes the torque no smaller is said."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from arms import LEVEL, dh_robot, dh_row
from origins import NOBODY
from synthetic import lugre, make_log

from collaudit.core.audit import audit_log
from collaudit.core.config.schema import Config
from collaudit.core.data.audit_result import AuditResult, FrictionFile
from collaudit.core.data.joint_log import JointLog
from collaudit.core.findings import Finding
from collaudit.core.fitting import fit_logs
from collaudit.core.prepare.preparation import prepare
from collaudit.core.robot.robot_building import build_robot

NAMES = ("joint1", "joint2")
ROBOT = dh_robot(
    [dh_row(4.0, (0, 0, 0), (0, 0, 0.05), a=0.4), dh_row(2.0, (0, 0, 0), (0, 0, 0.02), a=0.3)],
    armature_kg_m2=[0.3, 0.3],
    **LEVEL,
)
FRICTION = ((2.0, 0.8, 10.0, 1.5), (1.0, 0.3, 10.0, 0.5))
#: The file states what the checks of sign and gain would otherwise catch first.
STATED = {"units": {"effort_sign": dict.fromkeys(NAMES, 1)}}


def config() -> Config:
    return Config.of({"robot": ROBOT, "log": STATED})


def motion(period: float, seconds: float = 60.0) -> np.ndarray:
    t = period * np.arange(round(seconds / period))
    return np.column_stack(
        [0.5 * np.sin(1.1 * t) + 0.2 * np.sin(2.9 * t), 0.5 * np.cos(1.3 * t) + 0.2 * np.sin(2.3 * t)]
    )


def log_of(period: float = 0.002, factor: float = 1.0, late_s: float = 0.0, noise_rad: float = 0.0) -> JointLog:
    """A log whose effort is ``factor`` times what it should be, late, or has noise on its positions and no velocity."""
    q = motion(period)
    v = np.gradient(q, period, axis=0)
    robot = build_robot(config().robot, Path(), NAMES)
    rigid = robot.inverse_dynamics(q, v, np.gradient(v, period, axis=0))
    effort = factor * rigid + np.column_stack([lugre(v[:, j], *FRICTION[j]) for j in range(2)])
    effort += np.random.default_rng(0).normal(0, 0.02, q.shape)
    effort = np.roll(effort, round(late_s / period), axis=0)
    if noise_rad:
        q = q + np.random.default_rng(1).normal(0, noise_rad, q.shape)
    return make_log(period * np.arange(len(q)), q, None if noise_rad else v, effort, NAMES)


@pytest.fixture(scope="module")
def friction() -> FrictionFile:
    cfg = Config.of({"robot": ROBOT, "fit": {"motion": "any"}})
    return fit_logs([prepare(log_of(), build_robot(cfg.robot, Path(), NAMES), cfg)], cfg, NOBODY)


def judged(log: JointLog, friction: FrictionFile, robot: dict[str, Any] = ROBOT, **detect: Any) -> AuditResult:
    cfg = Config.of({"robot": robot, "log": STATED, "detect": detect})
    return audit_log(
        prepare(log, build_robot(cfg.robot, Path(), NAMES), cfg), cfg, friction, NOBODY, siblings=None
    ).result


def said(friction: FrictionFile, **wrong: Any) -> dict[str | None, Finding]:
    return {f.joint: f for f in judged(log_of(**wrong), friction).findings if f.code == "residual-level"}


def test_a_good_model_is_not_mentioned(friction: FrictionFile) -> None:
    assert not said(friction)


def test_a_wrong_sign_casts_doubt_on_alarms(friction: FrictionFile) -> None:
    assert said(friction, factor=-1.0)["joint1"].effect == "doubts-alarms"


def test_efforts_in_another_scale_are_not_judged(friction: FrictionFile) -> None:
    found = judged(log_of(factor=0.1), friction, gamma_nm=0.5)
    assert (found.verdict, found.contacts) == ("not_judged", ())


LIGHT = dh_robot([dh_row(1e-3, (0, 0, 0), (0, 0, 1e-6), a=0.4), dh_row(1e-3, (0, 0, 0), (0, 0, 1e-6), a=0.3)], **LEVEL)


@pytest.mark.parametrize("pushed", [False, True], ids=["clean", "pushed"])
def test_an_effort_without_friction_is_not_judged_and_pushes_on_the_other_joint_fail(
    friction: FrictionFile, pushed: bool
) -> None:
    """No torque of this model loads the joints, and their efforts hold friction: that of joint1 is noise."""
    log = log_of(factor=0.0)
    effort = np.array(log.effort)
    effort[:, 0] = np.random.default_rng(2).normal(0, 0.02, len(effort))
    if pushed:
        effort[20_000:20_500, 1] += 5.0
    found = judged(replace(log, effort=effort), friction, LIGHT, gamma_nm=1.0, persistence_ms=25.0)
    assert {f.joint: f.effect for f in found.findings if f.code == "residual-level"} == {"joint1": "not-judged-joint"}
    assert found.verdict == ("fail" if pushed else "not_judged")
    assert {joint for contact in found.contacts for joint in contact.joints} == ({"joint2"} if pushed else set())
    assert found.residual["joint1"].judged_s == 0.0


def test_noise_of_the_acceleration_casts_doubt_on_alarms(friction: FrictionFile) -> None:
    assert said(friction, period=0.01, noise_rad=0.01)["joint1"].effect == "doubts-alarms"
