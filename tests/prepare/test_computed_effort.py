"""Efforts without noise and friction are a model's: nothing is judged by them unless their kind is stated."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from simulated_logs import Maker

from collaudit.core import api
from collaudit.core.config import load_config
from collaudit.core.data.joint_log import JointLog
from collaudit.core.prepare.preparation import prepare


def codes(log: JointLog, made_files: object, **stated: object) -> set[str]:
    loaded = load_config(made_files.config, {"log.effort_kind": "auto", **stated})  # type: ignore[attr-defined]
    ready = prepare(log, api.load_robot(loaded, log.joint_names), loaded.config)
    return {finding.code for finding in ready.findings if finding.severity == "error"}


@pytest.fixture
def model(made: Maker, robot: str) -> tuple[JointLog, object]:
    """A log whose efforts are the model's torque along its own, smooth motion."""
    files = made("free-clean", robot, duration_s=5.0)
    loaded = load_config(files.config)
    log = api.open_log(files.log, loaded)
    time_s, rate = np.arange(0.0, 20.0, 0.004), 1.0 + 0.2 * np.arange(len(log.joint_names))
    phase = np.outer(time_s, rate)
    position, velocity, acceleration = 0.5 * np.sin(phase), 0.5 * rate * np.cos(phase), -0.5 * rate**2 * np.sin(phase)
    torque = api.load_robot(loaded, log.joint_names).inverse_dynamics(position, velocity, acceleration)
    signals = {"position_rad": position, "velocity_rad_s": velocity, "effort": torque}
    return replace(log, time_s=time_s, wrench=None, annotations=(), phases=(), **signals), files


def test_a_model_s_torque_is_not_judged_unless_its_kind_is_stated(model: tuple[JointLog, object]) -> None:
    log, files = model
    assert "effort-no-torque" in codes(log, files)
    assert "effort-no-torque" not in codes(log, files, **{"log.effort_kind": "motor-torque"})


@pytest.mark.parametrize("wrong", ["payload", "scale", "offset"])
def test_another_model_s_torque_is_one(model: tuple[JointLog, object], wrong: str) -> None:
    log, files = model
    assert log.effort is not None
    changed = {"payload": 1.0 + 0.1 * np.arange(log.effort.shape[1]), "scale": 0.8, "offset": 1.0}[wrong]
    effort = log.effort * changed + (0.5 if wrong == "offset" else 0.0)
    assert "effort-no-torque" in codes(replace(log, effort=effort), files)


def test_friction_or_noise_is_a_measurement(model: tuple[JointLog, object]) -> None:
    log, files = model
    assert log.effort is not None and log.velocity_rad_s is not None
    friction = 2.0 * np.tanh(log.velocity_rad_s / 0.01) + log.velocity_rad_s
    noise = np.random.default_rng(1).normal(0.0, 1e-3, log.effort.shape)
    for added in (friction, noise, friction + noise):
        assert "effort-no-torque" not in codes(replace(log, effort=log.effort + added), files)
