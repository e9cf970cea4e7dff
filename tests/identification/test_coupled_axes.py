"""Friction of a motor that turns with two joints is told apart from theirs, and taken off wherever torque is judged."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from arms import dh_robot, dh_row
from origins import log_source
from three_joints import sines

from collaudit.core.conditioning.motor_side import at_joints
from collaudit.core.config.schema import Config
from collaudit.core.data.audit_result import Provenance
from collaudit.core.data.joint_log import JointLog
from collaudit.core.fitting import fit_logs
from collaudit.core.friction.arm_fit import fit_coupled
from collaudit.core.prepare.calibration import Calibration, coupled_doubt
from collaudit.core.prepare.preparation import calibrated, prepare
from collaudit.core.prepare.prepared import Prepared
from collaudit.core.residual.detector import detector_named
from collaudit.core.residual.residual import ResidualInputs
from collaudit.core.robot.robot_building import build_robot
from collaudit.core.robot.robot_model import RobotModel

NAMES = ("joint1", "joint2", "joint3")
R = np.array([[40.0, 0, 0], [0, 45.0, 0], [0, 32.0, 32.0]])
COULOMB, VISCOUS, INERTIA = 2.0, 1.5, 0.05


def config_of(model: str = "auto", **fit: object) -> Config:
    rows = [
        dh_row(6.0, (0, 0.02, 0), (0.05, 0.05, 0.05), d=0.3, a=0.05, alpha=-np.pi / 2),
        dh_row(5.0, (-0.15, 0, 0.02), (0.02, 0.06, 0.06), a=0.35),
        dh_row(3.0, (-0.12, 0.01, 0), (0.01, 0.03, 0.03), a=0.30),
    ]
    robot = dh_robot(rows, armature_kg_m2=[0.8, 0.8, 0.4], reduction=R.tolist())
    return Config.of({"robot": robot, "fit": fit, "friction": {"model": model}})


def arm(config: Config) -> RobotModel:
    return build_robot(config.robot, Path(), NAMES)


def joint_log(truth: RobotModel, seed: int) -> JointLog:
    """Smooth motion of all joints; torque in closed form, friction of each joint, noise alike over 0.1 s."""
    rng = np.random.default_rng(seed)
    t = np.arange(0, 60.0, 0.008)
    q, v, a = sines(rng, t, 3)
    torque = truth.inverse_dynamics(q, v, a) + np.array([6.0, 5.0, 3.0]) * np.sign(v) + np.array([8.0, 6.0, 4.0]) * v
    noise = rng.standard_normal(torque.shape)
    torque += 0.3 * noise + np.apply_along_axis(lambda x: np.convolve(x, np.ones(12) / 12, "same"), 0, noise)
    return JointLog(t, NAMES, q, v, torque, "Nm", None, log_source())


def motor_log(config: Config, seed: int = 0, inertia: float = 0.0) -> JointLog:
    """The three-joint arm of test_identify, logged by its motors; motor 3 turns with joints 2 and 3."""
    log = joint_log(arm(config), seed)
    assert log.velocity_rad_s is not None
    assert log.effort is not None
    s = log.velocity_rad_s @ np.array([0, 1.0, 1.0])
    on_axis = COULOMB * np.sign(s) + VISCOUS * s + inertia * np.gradient(s, log.time_s)
    effort = log.effort + on_axis[:, None] * np.array([0, 1.0, 1.0])
    return replace(
        log,
        position_rad=log.position_rad @ R.T,
        velocity_rad_s=log.velocity_rad_s @ R.T,
        effort=effort @ np.linalg.inv(R),
    )


def prepared_log(config: Config, seed: int = 0, inertia: float = 0.0) -> Prepared:
    return prepare(at_joints(motor_log(config, seed, inertia), config.robot, NAMES), arm(config), config)


def test_the_truth_lies_in_the_intervals() -> None:
    config, held = config_of(), 0
    for seed in range(6):
        fits, findings = fit_coupled([prepared_log(config, seed)], config, with_inertia=False)
        axis = fits["joint3"]
        assert axis.weights == {"joint2": 1.0, "joint3": 1.0}
        assert axis.inertia_kg_m2 is None
        for key, truth in (("coulomb_nm", COULOMB), ("viscous_nm_s_per_rad", VISCOUS)):
            low, high = axis.ci95[key]
            assert low is not None
            assert high is not None
            assert high - low < 1.5
            held += low <= truth <= high
        assert findings == []
    assert held >= 10  # of 12; over 30 seeds 27 and 29 held


def test_a_noisy_joint_counts_less() -> None:
    """The axis acts on two joints: where one of them is noisy, the other tells it as well as before."""
    config, widths = config_of(), []
    for noise_nm in (0.0, 30.0):
        log = at_joints(motor_log(config), config.robot, NAMES)
        assert log.effort is not None
        noise = np.random.default_rng(5).normal(0.0, noise_nm, len(log.effort))[:, None] * [0.0, 1.0, 0.0]
        prepared = prepare(replace(log, effort=log.effort + noise), arm(config), config)
        low, high = fit_coupled([prepared], config, with_inertia=False)[0]["joint3"].ci95["coulomb_nm"]
        assert low is not None and high is not None
        widths.append(high - low)
    assert widths[1] < 2.0 * widths[0]


def test_the_drive_inertia_of_the_axis_is_told_where_inertials_are() -> None:
    config = config_of(estimate=["friction", "inertials"])
    held = 0
    for seed in range(1, 11):
        fits, _ = fit_coupled([prepared_log(config, seed, INERTIA)], config, with_inertia=True)
        low, high = fits["joint3"].ci95["inertia_kg_m2"]
        assert low is not None
        assert high is not None
        assert high - low < 0.1
        held += low <= INERTIA <= high
    assert held >= 6  # of 10; over 30 seeds 25 held


def test_single_joints_keep_their_own_friction_and_the_residual_loses_the_axis() -> None:
    config = config_of("coulomb-viscous", motion="any")
    logs = [prepared_log(config, seed) for seed in (0, 1)]
    file = fit_logs([logs[0]], config, Provenance("0", {}, None))
    assert "joint3" in file.coupled
    assert file.joints["joint3"].parameters["A_nm"] == pytest.approx(3.0, abs=0.5)
    known = calibrated(logs[1], Calibration.of(file, config), config)
    residual = level(known, file, config)
    blind = level(logs[1], replace(file, coupled={}), config)
    assert residual[1] < 0.6 * blind[1]
    assert residual[2] < 0.6 * blind[2]


def level(prepared: Prepared, file: object, config: Config) -> np.ndarray:
    """RMS of the residual of each joint."""
    from collaudit.core.friction.joint_fits import friction_models

    laws, _ = friction_models(file.joints, prepared.judged_series)  # type: ignore[attr-defined]
    found = detector_named("direct").residual(prepared, ResidualInputs(laws, frozenset()), config.detect)
    return np.sqrt(np.nanmean(np.where(found.state == 0, found.torque_nm, np.nan) ** 2, axis=0))


def test_an_axis_in_doubt_raises_the_threshold_only_around_its_reversals() -> None:
    config = config_of()
    log = prepared_log(config)
    fits, _ = fit_coupled([log], config, with_inertia=False)
    doubt = coupled_doubt(log.series, fits)
    s = log.series.velocity_rad_s @ np.array([0, 1.0, 1.0])
    assert np.all(doubt[:, 0] == 0)
    assert doubt[np.abs(s) < 0.01, 2].min() > 0.9 * fits["joint3"].coulomb_nm
    assert np.median(doubt[np.abs(s) > 0.3, 2]) < 0.5


def test_an_axis_that_never_differs_from_its_joint_is_not_told_apart() -> None:
    config = config_of()
    log = motor_log(config)
    still = log.position_rad.copy()
    still[:, 1] = 0.3 * R[1, 1]  # joint 2 at rest: motor 3 turns as joint 3 does
    still[:, 2] += R[2, 1] * (0.3 - log.position_rad[:, 1] / R[1, 1])
    moved = replace(log, position_rad=still, velocity_rad_s=None)
    prepared = prepare(at_joints(moved, config.robot, NAMES), arm(config), config)
    fits, findings = fit_coupled([prepared], config, with_inertia=False)
    assert not fits
    assert "could not be determined" in findings[0].text
    assert findings[0].severity == "warning"
