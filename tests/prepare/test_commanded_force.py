"""What hangs on a wrist sensor and is stated nowhere is told: it would count as an intended force."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from three_joints import arm, log_of, settings

from collaudit.core.data.joint_log import WrenchSeries
from collaudit.core.findings import Finding
from collaudit.core.prepare.preparation import prepare

CONFIG = settings()


def told(mass_kg: float, sign: int = 1, push_n: float = 0.0, stated: int = 1) -> list[Finding]:
    """Findings on the offset of a sensor at the last link; it reads sign · (F - W) and an offset, with noise."""
    robot = arm(CONFIG)
    log = log_of(robot, np.ones(3), seed=5)
    frame = robot.link_of(robot.joint_names[-1])
    assert frame is not None
    reading = -mass_kg * robot.gravity_in(log.position_rad, frame) + np.array([3.0, -2.0, 8.0])
    reading += 0.2 * np.random.default_rng(6).standard_normal(reading.shape)
    reading[2000:6000:2, 0] += push_n
    wrench = np.concatenate([sign * reading, np.zeros_like(reading)], axis=1)
    config = CONFIG.changed({"log": CONFIG.log.changed({"wrench_frame": frame, "wrench_sign": stated})})
    made = prepare(replace(log, wrench=WrenchSeries(log.time_s, wrench, "/wrench")), robot, config)
    return [f for f in made.findings if f.code == "log-wrench-bias" and "follows gravity" in f.text]


def test_a_tool_that_nothing_states_is_weighed() -> None:
    (found,) = told(0.7)
    assert "mass of 0.7 kg" in found.text and "less than hangs on it" in found.text and found.severity == "warning"


def test_an_inverted_sensor_weighs_less_than_nothing() -> None:
    (found,) = told(0.7, sign=-1)
    assert "mass of -0.7 kg" in found.text and "wrench_sign" in found.text
    (right,) = told(0.7, sign=-1, stated=-1)
    assert "mass of 0.7 kg" in right.text


@pytest.mark.parametrize(("mass_kg", "push_n"), [(0.0, 0.0), (0.05, 0.0), (0.7, 60.0)])
def test_noise_little_weight_and_work_with_force_are_no_tool(mass_kg: float, push_n: float) -> None:
    assert told(mass_kg, push_n=push_n) == []
