"""What hangs on a wrist sensor and is stated nowhere is told: it would count as an intended force."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.typing import NDArray
from three_joints import arm, log_of, settings

from collaudit.core.data.joint_log import WrenchSeries
from collaudit.core.findings import Finding
from collaudit.core.prepare.commanded_force import _still_weighed
from collaudit.core.prepare.preparation import prepare
from collaudit.core.robot.pinocchio_model import PointMass

AXES = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
TOOL = {"mass_kg": 0.7, "com_m": [0.02, 0.01, 0.08]}


def told(
    mass_kg: float,
    sign: int = 1,
    push_n: float = 0.0,
    stated: int = 1,
    tool: dict[str, object] | None = None,
    axes: NDArray[np.float64] | None = None,
    force_n: float = 0.0,
) -> list[Finding]:
    """Findings on the offset of a sensor at the last link; it reads sign · (F - W) and an offset, with noise."""
    base = settings(tool=tool)
    robot = arm(base)
    log = log_of(robot, np.ones(3), seed=5)
    frame = robot.link_of(robot.joint_names[-1])
    assert frame is not None
    centre = (0.0, 0.0, 0.0) if tool is None else (0.02, 0.01, 0.08)
    weight = robot.weight_in(log.position_rad, PointMass(frame, mass_kg, centre))
    reading = -weight + np.array([3.0, -2.0, 8.0, 0.1, 0.2, 0.3])
    reading += 0.2 * np.random.default_rng(6).standard_normal(reading.shape) * np.array([1.0] * 3 + [0.05] * 3)
    reading[2000:6000:2, 0] += push_n
    reading[:, 2] += force_n * np.sin(0.7 * log.time_s)
    turn = np.eye(3) if axes is None else axes
    wrench = sign * np.concatenate([reading[:, :3] @ turn.T, reading[:, 3:] @ turn.T], axis=1)
    config = base.changed({"log": base.log.changed({"wrench_frame": frame, "wrench_sign": stated})})
    made = prepare(replace(log, wrench=WrenchSeries(log.time_s, wrench, "/wrench")), robot, config)
    return [f for f in made.findings if f.code == "log-wrench" and "follows gravity" in f.text]


def test_a_tool_that_nothing_states_is_weighed() -> None:
    (found,) = told(0.7)
    assert "mass of 0.7 kg" in found.text and "less than hangs on it" in found.text and found.severity == "warning"


def test_an_inverted_sensor_weighs_less_than_nothing() -> None:
    (found,) = told(0.7, sign=-1)
    assert "mass of -0.7 kg" in found.text and "wrench_sign, wrench_frame" in found.text
    (right,) = told(0.7, sign=-1, stated=-1)
    assert "mass of 0.7 kg" in right.text


@pytest.mark.parametrize(("mass_kg", "push_n"), [(0.0, 0.0), (0.05, 0.0), (0.7, 60.0)])
def test_noise_little_weight_and_work_with_force_are_no_tool(mass_kg: float, push_n: float) -> None:
    assert told(mass_kg, push_n=push_n) == []


def test_a_sensor_in_other_axes_than_stated_is_told() -> None:
    assert told(0.7, tool=TOOL) == []
    (turned,) = told(0.7, tool=TOOL, axes=AXES)
    assert "wrench_frame is wrong" in turned.text and turned.severity == "warning"


def test_a_wrong_centre_of_mass_is_told() -> None:
    (found,) = told(0.7, tool={**TOOL, "com_m": [0.02, 0.01, 0.28]})
    assert "torque at the sensor" in found.text and "centre of mass" in found.text


def test_work_with_force_that_comes_and_goes_is_no_weight() -> None:
    assert told(0.7, tool=TOOL, force_n=30.0) == []


@pytest.mark.parametrize(("second", "codes"), [(0.0, []), (5.0, ["log-wrench"])])
def test_axes_are_told_only_where_gravity_turns_about_two(second: float, codes: list[str]) -> None:
    """Turned about one axis alone, any drift that goes with the pose looks like a weight in other axes."""
    t = np.linspace(0.0, 40.0, 2000)
    pull = np.column_stack([5.0 * np.sin(t), second * np.cos(1.7 * t), np.zeros(t.size)])
    force = np.column_stack([0.0 * t, 0.7 * pull[:, 0], -0.7 * pull[:, 1], np.zeros((t.size, 3))])
    robot = SimpleNamespace(gravity_in=lambda q, frame: pull)
    found = _still_weighed(force, robot, np.zeros((t.size, 6)), "flange")  # type: ignore[arg-type]
    assert [one.code for one in found] == codes
