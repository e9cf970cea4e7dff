"""What must not pass in silence: a blow inside meant contact, a stalled logger, a joint nobody recorded."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from origins import log_source

from collaudit.core.conditioning.conditioning import condition
from collaudit.core.config.schema import ConditioningConfig, PhasesConfig, RobotConfig
from collaudit.core.data.joint_log import JointLog
from collaudit.core.errors import RobotError
from collaudit.core.prepare.phases import commanded_share, excess_findings
from collaudit.core.robot.robot_building import build_robot
from collaudit.fixtures.arms import robot_named

T = 0.002


def moving(n: int = 5000, noise: float = 1e-6) -> JointLog:
    t = T * np.arange(n)
    rng = np.random.default_rng(0)
    q = np.stack([np.sin(t), np.cos(t)], axis=1) + rng.normal(0, noise, (n, 2))
    v = np.stack([np.cos(t), -np.sin(t)], axis=1)
    source = log_source()
    return JointLog(t, ("a", "b"), q, v, 3.0 * v + rng.normal(0, 0.1, (n, 2)), "Nm", None, source)


def with_stall(log: JointLog, start: int, stop: int) -> JointLog:
    q, v, effort = (np.array(x) for x in (log.position_rad, log.velocity_rad_s, log.effort))
    for column in (q, v, effort):
        column[start:stop] = column[start]
    return replace(log, position_rad=q, velocity_rad_s=v, effort=effort)


@pytest.mark.parametrize("velocity", [True, False])
def test_a_stalled_logger_leaves_a_gap_that_is_said(velocity: bool) -> None:
    log = with_stall(moving(), 2000, 2100)
    series = condition(log if velocity else replace(log, velocity_rad_s=None), ConditioningConfig())
    said = [f for f in series.findings if f.code == "not-measured"]
    assert {f.joint for f in said} == {"a", "b"}
    spans = np.array([(f.start_s, f.end_s) for f in said])
    np.testing.assert_allclose(spans, np.tile([4.0, 4.2], (len(said), 1)), atol=0.005)
    assert len(series.segments) == 2
    assert float(np.nanmax(np.abs(series.acceleration_rad_s2[~series.edge]))) < 3.0, "no jump is differentiated"


def test_standing_still_and_slow_sources_are_no_stall() -> None:
    still = moving()
    still = replace(still, velocity_rad_s=np.zeros_like(still.position_rad))
    held = replace(still, position_rad=np.ones_like(still.position_rad), effort=np.ones_like(still.position_rad))
    assert not condition(held, ConditioningConfig()).off_grid_s
    assert len(condition(held, ConditioningConfig()).segments) == 1
    log = moving()
    slow = 10 * (np.arange(log.time_s.size) // 10)  # every value ten times: a source of 50 Hz logged at 500
    assert log.velocity_rad_s is not None and log.effort is not None
    repeated = replace(
        log, position_rad=log.position_rad[slow], velocity_rad_s=log.velocity_rad_s[slow], effort=log.effort[slow]
    )
    assert len(condition(repeated, ConditioningConfig()).segments) == 1


def test_a_blow_in_contact_is_meant_up_to_what_is_usual() -> None:
    t = T * np.arange(10_000)
    contact = (t > 5) & (t < 15)
    force = np.where(contact, 28.0 + 5.0 * np.sin(t), 0.1)
    share, excess = commanded_share(t, force, contact, PhasesConfig())
    assert (share == 1.0).all()
    assert excess == ()
    force[(t > 8) & (t < 8.2)] = 150.0
    share, (found,) = commanded_share(t, force, contact, PhasesConfig())
    (said,) = excess_findings((found,), PhasesConfig())
    assert said.is_fact and "force_limit_n" in said.text
    assert (said.start_s, said.end_s) == (found.start_s, found.end_s)
    assert (found.start_s, found.end_s) == (pytest.approx(8.0, abs=0.01), pytest.approx(8.2, abs=0.01))
    blow = (t > 8) & (t < 8.2)
    assert (share[~blow] == 1.0).all()
    assert 50.0 < float((share * force)[blow].max()) < 60.0
    share, _ = commanded_share(t, force, contact, PhasesConfig(force_limit_n=40.0))
    assert float((share * force)[blow].max()) == pytest.approx(40.0)


def test_a_joint_missing_between_others_makes_all_torques_unknown() -> None:
    arm = robot_named("paper6")
    config = RobotConfig.of(arm.describe(lambda: 0.0).keys)
    config = config.changed({"armature_kg_m2": None})
    here = [name for name in arm.joints if name != "joint3"]
    folder = Path()
    assert "not-judged-log" in [f.effect for f in build_robot(config, folder, here).findings]
    outer = [f.effect for f in build_robot(config, folder, arm.joints[:4]).findings]
    assert "not-judged-log" not in outer
    parked = build_robot(config.changed({"parked": {"joint3": 0.3}}), folder, here)
    assert "not-judged-log" not in [f.effect for f in parked.findings]
    whole = build_robot(config, folder, arm.joints)
    q = np.array([[0.1, 0.4, 0.3, 0.2, -0.5, 0.6]])
    expected = np.delete(whole.gravity_torque(q), 2, axis=1)
    np.testing.assert_allclose(parked.gravity_torque(np.delete(q, 2, axis=1)), expected, atol=1e-9)
    with pytest.raises(RobotError, match="parked"):
        build_robot(config.changed({"parked": {"joint1": 0.3}}), folder, here)
