"""The tool that a wrist sensor carries: its inertia is no contact, and a calibrated one is in the arm's model."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from identified import identify
from origins import log_source

from collaudit.core.config.schema import Config, RobotConfig
from collaudit.core.data.joint_log import JointLog, WrenchSeries
from collaudit.core.friction.least_squares import solve
from collaudit.core.identification.channel_audit import audit_channels
from collaudit.core.prepare.calibration import Calibration, with_tool
from collaudit.core.prepare.preparation import calibrated, prepare
from collaudit.core.prepare.prepared import Prepared
from collaudit.core.robot.robot_building import build_robot
from collaudit.fixtures.arms import robot_named
from collaudit.fixtures.experiments import Path as Motion
from collaudit.fixtures.plant import Trace
from collaudit.fixtures.simulated_robot import FixtureRobot, record


def quiet(arm: FixtureRobot) -> FixtureRobot:
    none = tuple(0.0 for _ in arm.joints)
    sensors = replace(arm.sensors, torque_noise_nm=none, torque_drift_nm=none, ripple_nm=none, wrench_noise=(0.0, 0.0))
    return replace(arm, sensors=sensors)


@pytest.fixture(scope="module")
def moved() -> tuple[FixtureRobot, Trace]:
    """Poses at rest and quick moves between them, exactly followed, without friction."""
    arm = quiet(robot_named("paper6"))
    rng = np.random.default_rng(3)
    path = Motion(arm.home)
    for _ in range(8):
        path.hold(1.2)
        path.move(np.array(arm.home) + rng.uniform(-1.0, 1.0, 6), 1.5, 6.0)
    path.hold(1.0)
    q, v, a = path.sampled(0.1)
    drive = arm.model().inverse_dynamics(q, v, a)
    return arm, Trace(q, v, drive, np.zeros((len(q), 6)))


def seen(moved: tuple[FixtureRobot, Trace], mass_kg: float, bias: object) -> tuple[Prepared, Config]:
    arm, trace = moved
    model = arm.model()
    recording = record(trace, arm, model, np.random.default_rng(1))
    time_s = (recording.stamp_ns - recording.stamp_ns[0]) * 1e-9
    keys = dict(arm.describe(lambda: 0.0).keys)
    keys["tool"] = {**keys["tool"], "mass_kg": mass_kg}
    config = Config.of(
        {
            "robot": keys,
            "log": {"wrench_frame": arm.sensor_frame, "wrench_sign": arm.log.wrench_sign, "wrench_bias": bias},
        }
    )
    robot = build_robot(RobotConfig.of(keys), Path(), arm.joints)
    source = log_source("simulated")
    wrench = WrenchSeries(time_s, recording.wrench, "/w")
    log = JointLog(time_s, arm.joints, recording.position, None, recording.effort, "Nm", wrench, source)
    return prepare(log, robot, config), config


def level(prepared: Prepared) -> float:
    """Largest RMS over joints of what model and contact leave, N·m."""
    assert prepared.series.effort is not None
    assert prepared.rigid_nm is not None
    assert prepared.contact_nm is not None
    rest = (prepared.series.effort - prepared.rigid_nm - prepared.contact_nm)[~prepared.series.edge]
    return float(np.sqrt(np.nanmean(rest**2, axis=0)).max())


def test_accelerating_the_tool_is_no_contact(moved: tuple[FixtureRobot, Trace]) -> None:
    prepared, _ = seen(moved, 0.8, list(moved[0].sensors.wrench_offset))
    assert prepared.contact_nm is not None
    assert np.sqrt(np.nanmean(prepared.contact_nm[~prepared.series.edge] ** 2, axis=0)).max() < 0.05


def test_a_calibrated_tool_is_in_the_model(moved: tuple[FixtureRobot, Trace]) -> None:
    """A tool that is not described: the file's calibration brings the residual to that of a described one."""
    described, _ = seen(moved, 0.8, "estimate")
    unknown, config = seen(moved, 0.0, "calibrated")
    facts, _ = audit_channels(unknown, config)
    known = calibrated(unknown, Calibration.of_sensor({"log": facts}, config), config)
    assert level(unknown) > 1.0
    assert level(known) < 1.5 * level(described) + 0.02
    assert any(f.where == "friction file" and "0.8 kg" in f.text for f in known.findings)


def test_a_calibrated_tool_stays_in_the_model_beside_what_is_identified(moved: tuple[FixtureRobot, Trace]) -> None:
    """Rotors alone were identified: masses are those on file and of the calibrated tool, in the fit and after it."""
    unknown, config = seen(moved, 0.0, "calibrated")
    config = config.changed({"fit": config.fit.changed({"estimate": ["friction", "rotor"]})})
    facts, _ = audit_channels(unknown, config)
    sensor = Calibration.of_sensor({"log": facts}, config)
    known = calibrated(unknown, sensor, config)
    found = identify([known], config)
    assert found is not None and not found.masses
    both = calibrated(unknown, replace(sensor, identified=found), config)
    np.testing.assert_allclose(both.robot.inertial_parameters, known.robot.inertial_parameters)
    chosen = config.changed({"fit": config.fit.changed({"estimate": "auto"})})  # its fit leaves the tool to the choice
    alone = calibrated(unknown, replace(sensor, identified=found), chosen)
    np.testing.assert_allclose(alone.robot.inertial_parameters, unknown.robot.inertial_parameters)
    assert (known.robot.inertial_parameters != unknown.robot.inertial_parameters).any()


def test_a_tool_on_file_is_not_carried_twice(moved: tuple[FixtureRobot, Trace]) -> None:
    prepared, config = seen(moved, 0.8, "calibrated")
    facts, _ = audit_channels(prepared, config)
    assert facts.sensor is not None
    robot, mass, before = with_tool(prepared.robot, facts.sensor, config)
    assert mass == pytest.approx(before, abs=1e-3)
    assert robot.inertial_parameters == pytest.approx(prepared.robot.inertial_parameters, abs=1e-3)


def test_a_column_that_is_gone_in_rounding_is_solvable() -> None:
    """As an exponential at speeds far above where it fades: two logs of unlike speeds ended in a bug."""
    fit = solve(np.column_stack([np.ones(5), np.zeros(5), np.arange(5.0)]), 2.0 + 3.0 * np.arange(5.0))
    assert fit.estimate[[0, 2]] == pytest.approx([2.0, 3.0])
