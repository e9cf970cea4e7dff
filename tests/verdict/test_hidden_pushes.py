"""A push stays found, not judged or stated, whatever the log does to positions, units, signs and stamps around it."""

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

from collaudit.core.audit import audit_log
from collaudit.core.config.schema import Config
from collaudit.core.data.audit_result import Audit, FrictionFile
from collaudit.core.data.joint_log import JointLog
from collaudit.core.fitting import fit_logs
from collaudit.core.prepare.preparation import prepare
from collaudit.core.robot.robot_building import build_robot

FRICTION = (6.0, 2.0, 8.0, 4.0)
PUSHES = ((8.4, 8.6, 9.0), (16.2, 16.6, -9.0))
OFFSET = np.pi - 0.4  # so that the swing crosses pi


def config(**sections: Any) -> Config:
    pendulum = dh_row(6.0, (0, 0, 0), (0, 0, 0.05), a=0.4)
    robot = dh_robot([pendulum], armature_kg_m2=[0.3], **LEVEL)
    return Config.of({"robot": robot, **sections})


def torque(q: np.ndarray, v: np.ndarray, a: np.ndarray) -> np.ndarray:
    return np.asarray((0.05 + 6.0 * 0.16 + 0.3) * a + 6.0 * 9.80665 * 0.4 * np.cos(q) + lugre(v, *FRICTION))


def pushed(sign: float = 1.0) -> JointLog:
    t = PERIOD * np.arange(20_000)
    q, v, a = OFFSET + 0.9 * np.sin(0.8 * t), 0.72 * np.cos(0.8 * t), -0.576 * np.sin(0.8 * t)
    effort = torque(q, v, a) + np.random.default_rng(0).normal(0, 0.2, t.size)
    for start, end, push in PUSHES:
        effort += push * ((t >= start) & (t < end))
    return make_log(t, q[:, None], v[:, None], sign * effort[:, None])


@pytest.fixture(scope="module")
def friction() -> FrictionFile:
    q, v = strokes(np.geomspace(0.02, 1.2, 16))
    noise = np.random.default_rng(1).normal(0, 0.2, q.size)
    effort = torque(q, v, np.gradient(v, PERIOD)) + noise
    log = make_log(PERIOD * np.arange(q.size), q[:, None], v[:, None], effort[:, None])
    return fit_logs([prepare(log, build_robot(config().robot, Path(), log.joint_names), config())], config(), NOBODY)


def audit(log: JointLog, friction: FrictionFile, sections: Mapping[str, Any] | None = None) -> Audit:
    cfg = config(**(sections or {}))
    return audit_log(
        prepare(log, build_robot(cfg.robot, Path(), log.joint_names), cfg), cfg, friction, NOBODY, siblings=None
    )


def onsets(found: Audit) -> list[float]:
    return [c.onset_s for c in found.result.collisions]


def codes(found: Audit) -> set[str]:
    return {f.code for f in found.result.findings}


BOTH = pytest.approx([8.4, 16.2], abs=2 * PERIOD)


@pytest.mark.parametrize("velocity", [True, False])
def test_a_wrapped_angle_hides_nothing(friction: FrictionFile, velocity: bool) -> None:
    log = pushed()
    q = log.position_rad
    wrapped = replace(log, position_rad=np.mod(q + np.pi, 2 * np.pi) - np.pi)
    assert np.abs(np.diff(wrapped.position_rad[:, 0])).max() > 6
    if not velocity:
        wrapped = replace(wrapped, velocity_rad_s=None)
    found = audit(wrapped, friction)
    assert onsets(found) == BOTH
    assert found.result.verdict == "fail"
    assert any("starts again after a turn" in f.text for f in found.result.findings)


def test_a_lost_stretch_with_a_jump_hides_nothing_else(friction: FrictionFile) -> None:
    log = pushed()
    keep = np.r_[0:3000, 4000:7500, 7501:20_000]  # the stamps go on as if nothing were lost
    assert log.velocity_rad_s is not None and log.effort is not None
    q = log.position_rad[keep]
    log = make_log(PERIOD * np.arange(keep.size), q, log.velocity_rad_s[keep], log.effort[keep])
    found = audit(log, friction)
    assert onsets(found) == pytest.approx([8.4 - 2.002 + 0.002, 16.2 - 2.002], abs=3 * PERIOD)
    assert "not-measured" in codes(found)
    assert np.nanmax(np.abs(found.signals.velocity_rad_s)) < 0.8


def test_turns_hide_nothing(friction: FrictionFile) -> None:
    log = pushed()
    found = audit(replace(log, position_rad=log.position_rad + 6 * np.pi), friction)
    assert onsets(found) == BOTH


def test_a_unit_that_is_stated_wrongly_never_passes(friction: FrictionFile) -> None:
    log = pushed()
    assert log.velocity_rad_s is not None
    log = replace(log, position_rad=np.rad2deg(log.position_rad), velocity_rad_s=np.rad2deg(log.velocity_rad_s))
    stated = audit(log, friction, {"log": {"units": {"position": "rad"}}})
    assert stated.result.verdict != "pass"
    (said,) = [f for f in stated.result.findings if f.code == "log-unit-suspect"]
    assert said.severity == "warning"
    assert audit(log, friction).result.verdict == "not_judged"


@pytest.mark.parametrize("sign", [1, -1])
def test_a_stated_sign_keeps_the_model(friction: FrictionFile, sign: int) -> None:
    """The data run against the sign that is stated: judged by what is stated, with the evidence."""
    inverted = pushed(-1.0)
    guessed = audit(inverted, friction)
    assert guessed.result.verdict == "not_judged"
    stated = audit(inverted, friction, {"log": {"units": {"effort_sign": {"joint1": sign}}}})
    assert stated.result.verdict == "fail"
    (said,) = [f for f in stated.result.findings if f.code == "effort-sign-inverted"]
    assert said.severity == "warning"


def test_a_wrong_velocity_that_is_asked_for_is_used_and_said(friction: FrictionFile) -> None:
    log = pushed()
    assert log.velocity_rad_s is not None
    log = replace(log, velocity_rad_s=np.rad2deg(log.velocity_rad_s))
    assert onsets(audit(log, friction)) == BOTH
    asked = audit(log, friction, {"conditioning": {"velocity": "logged"}})
    assert asked.result.verdict != "pass"
    assert any("as [conditioning] velocity asks" in f.text for f in asked.result.findings)


def test_values_that_are_garbage_hide_nothing(friction: FrictionFile) -> None:
    from collaudit.core.logs.signals.joint_values import without_impossible

    log = pushed()
    assert log.effort is not None
    effort, q = log.effort.copy(), log.position_rad.copy()
    effort[[100, 5000]] = [[1e308], [-1e30]]
    q[12_000] = 1e154
    found = audit(without_impossible(replace(log, effort=effort, position_rad=q), "row"), friction)
    assert onsets(found) == BOTH
    assert "log-nan" in codes(found)
