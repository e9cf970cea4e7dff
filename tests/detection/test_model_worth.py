"""A model that makes the torque no smaller is said."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from arms import LEVEL, dh_robot, dh_row
from origins import NOBODY
from synthetic import lugre, make_log

from collaudit.core.audit import audit_log
from collaudit.core.config.schema import Config
from collaudit.core.data.audit_result import FrictionFile
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


def said(friction: FrictionFile, **wrong: Any) -> dict[str | None, Finding]:
    cfg = config()
    found = audit_log(
        prepare(log_of(**wrong), build_robot(cfg.robot, Path(), NAMES), cfg), cfg, friction, NOBODY
    ).result
    return {f.joint: f for f in found.findings if f.code == "model-no-gain"}


def test_a_good_model_is_not_mentioned(friction: FrictionFile) -> None:
    assert not said(friction)


@pytest.mark.parametrize("factor", [0.1, -1.0], ids=["gain", "sign"])
def test_a_wrong_gain_or_sign_casts_doubt_on_alarms(friction: FrictionFile, factor: float) -> None:
    assert said(friction, factor=factor)["joint1"].effect == "doubts-alarms"


def test_noise_of_the_acceleration_casts_doubt_on_alarms(friction: FrictionFile) -> None:
    assert said(friction, period=0.01, noise_rad=0.02)["joint1"].effect == "doubts-alarms"
