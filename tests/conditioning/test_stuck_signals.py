"""Stuck efforts and frozen positions are missing values; coarse, slow and resting signals are left as they are."""

from __future__ import annotations

import numpy as np
import pytest
from synthetic import PERIOD, make_log

from collaudit.core.conditioning.conditioning import condition
from collaudit.core.conditioning.stuck_signals import _period, without_stuck
from collaudit.core.config.schema import ConditioningConfig
from collaudit.core.data.joint_log import JointLog

STUCK = slice(2000, 2200)


def swinging(noise: float = 0.1, joints: int = 2) -> JointLog:
    t = PERIOD * np.arange(5000)
    phase = np.arange(joints)
    q = 0.8 * np.sin(0.9 * t[:, None] + phase)
    v = 0.72 * np.cos(0.9 * t[:, None] + phase)
    effort = 10 * np.cos(q) + np.random.default_rng(0).normal(0, noise, q.shape)
    return make_log(t, q, v, effort, [f"joint{k + 1}" for k in range(joints)])


def changed(log: JointLog, **columns: np.ndarray) -> JointLog:
    from dataclasses import replace

    return replace(log, **columns)  # type: ignore[arg-type]


def codes(log: JointLog) -> list[str]:
    return [finding.code for finding in log.findings]


def test_a_healthy_log_is_left_alone() -> None:
    log = swinging()
    assert without_stuck(log) is log


def test_a_stuck_effort_is_missing_for_its_span_only() -> None:
    effort = swinging().effort.copy()  # type: ignore[union-attr]
    effort[STUCK, 1] = effort[STUCK.start - 1, 1]
    found = without_stuck(changed(swinging(), effort=effort))
    assert codes(found) == ["sensor-stuck"]
    (finding,) = found.findings
    assert finding.joint == "joint2"
    assert finding.forbids_pass
    assert finding.start_s == pytest.approx(STUCK.start * PERIOD, abs=2 * PERIOD)
    assert finding.end_s == pytest.approx(STUCK.stop * PERIOD, abs=2 * PERIOD)
    assert found.effort is not None
    assert np.isnan(found.effort[STUCK, 1]).all()
    assert np.isfinite(found.effort[:, 0]).all()
    assert np.isnan(found.effort[:, 1]).sum() == 200


def test_the_shortest_stuck_stretch_takes_50_ms() -> None:
    least = round(0.05 / PERIOD)
    for length, said in ((least, ["sensor-stuck"]), (least - 1, [])):
        effort = swinging().effort.copy()  # type: ignore[union-attr]
        effort[2000 : 2000 + length, 1] = effort[1999, 1]
        assert codes(without_stuck(changed(swinging(), effort=effort))) == said


def test_all_efforts_stuck_are_missing_of_joints_at_rest_too() -> None:
    log = swinging()
    q, v, effort = log.position_rad.copy(), log.velocity_rad_s.copy(), log.effort.copy()  # type: ignore[union-attr]
    q[:, 1], v[:, 1] = 0.3, 0.0
    effort[STUCK] = effort[STUCK.start - 1]
    found = without_stuck(changed(log, position_rad=q, velocity_rad_s=v, effort=effort))
    assert {finding.joint for finding in found.findings} == {"joint1", "joint2"}


@pytest.mark.parametrize("hold", [2, 5, 20])
def test_a_drive_that_updates_slowly_is_not_stuck(hold: int) -> None:
    effort = swinging().effort.copy()  # type: ignore[union-attr]
    effort = np.repeat(effort[::hold], hold, axis=0)[: effort.shape[0]]
    log = changed(swinging(), effort=effort)
    assert without_stuck(log) is log


@pytest.mark.parametrize("step", [0.5, 2.0])
def test_coarse_steps_are_not_stuck(step: float) -> None:
    effort = step * np.round(swinging(noise=0.05).effort / step)  # type: ignore[operator]
    log = changed(swinging(), effort=effort)
    assert without_stuck(log) is log


@pytest.mark.parametrize("logged", [True, False])
def test_a_frozen_position_of_a_moving_joint_is_missing(logged: bool) -> None:
    log = swinging()
    q = log.position_rad.copy()
    span = slice(100, 300)  # joint 1 passes its middle at speed
    q[span, 0] = q[span.start - 1, 0]
    found = without_stuck(changed(log, position_rad=q, velocity_rad_s=log.velocity_rad_s if logged else None))
    assert codes(found) == ["position-frozen"]
    assert np.isnan(found.position_rad[span, 0]).all()
    series = condition(changed(log, position_rad=q), ConditioningConfig())
    assert "position-frozen" in {f.code for f in series.findings}
    assert np.isnan(series.position_rad[span, 0]).any() or not series.segments[0].stop > span.stop


def test_a_joint_that_stops_is_not_frozen() -> None:
    t = PERIOD * np.arange(4000)
    v = np.clip(2.0 - t, 0.0, 1.0) * (t < 5)
    q = np.cumsum(v) * PERIOD
    v = np.concatenate([np.zeros(30), v])[: v.size]  # a velocity that the drive filters comes late
    effort = np.random.default_rng(0).normal(0, 0.1, t.size)
    log = make_log(t, q[:, None], v[:, None], effort[:, None])
    assert without_stuck(log) is log


def test_the_usual_step_is_told_beside_unknown_stamps() -> None:
    t = 0.002 * np.arange(1000.0)
    t[1:] += 0.001 * (np.arange(999) % 5 < 2).cumsum()  # two in five of the steps are longer
    t[100::7] = np.nan
    assert _period(t) == np.nanmedian(np.diff(t)) == pytest.approx(0.002)
    assert _period(np.full(1000, np.nan)) is None
