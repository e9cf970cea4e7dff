"""One ranking of topics and columns: measured before commanded, efforts before none; lone commands are refused."""

from __future__ import annotations

from pathlib import Path

import log_writers as w
import numpy as np
import pytest
from simulated_logs import Maker

from collaudit.core.config import load_config
from collaudit.core.config.schema import LogConfig
from collaudit.core.errors import ConfigError, LogError
from collaudit.core.logs.log_description import describe
from collaudit.core.logs.log_reading import read_log
from collaudit.core.logs.signals.signal_names import is_usable, role_of_path

NAMES = ("a", "b", "c")
COMMANDED = (
    "/joint_command",
    "/arm/joint_states_desired",
    "/desired_joint_states",
    "/desired/joint_states",
    "/ipo",
    "/joint_setpoint",
    "/joint_reference",
    "/target/joint_states",
    "/jointStatesCmd",
    "/joint_states_d",
)
MEASURED = (
    "/joint_states",
    "/model/arm/joint_state",
    "/arm_control/joint_states",
    "/d/joint_states",
    "/joint_states_filtered",
    "/dynamic_joint_states",
    "/effort_controller/feedback",
)


def bag(path: Path, **efforts: float | None) -> Path:
    """JointState topics by name (``/`` written ``__``): the same motion, each with an effort of its own or none."""
    said = []
    for k in range(60):
        at = np.sin(0.01 * k + np.arange(3))
        for topic, effort in efforts.items():
            force = [] if effort is None else [effort] * 3
            stamp = w.EPOCH + k * w.PERIOD
            said.append(w.joint_state(NAMES, at, at, force, stamp_ns=stamp, topic=topic.replace("__", "/")))
    return w.write_mcap(path, said)


def test_words_of_a_topic_say_what_it_is() -> None:
    assert {name for name in (*COMMANDED, *MEASURED) if not is_usable(role_of_path(name))} == {*COMMANDED}


@pytest.mark.parametrize("commanded", COMMANDED)
@pytest.mark.parametrize("measured", ["/joint_states", "/zz/joint_states"])
@pytest.mark.parametrize("robot", [NAMES, None])
def test_measured_comes_before_commanded(tmp_path: Path, commanded: str, measured: str, robot: tuple[str, ...]) -> None:
    path = bag(tmp_path / "x.mcap", **{commanded: 9.0, measured: 5.0})
    log = read_log((path,), LogConfig(), robot_joints=robot)
    assert log.source.topic == measured and log.effort is not None and log.effort[0, 0] == 5.0


@pytest.mark.parametrize("name", ["/joint_states", "/a/joint_states", "/z"])
def test_the_one_topic_with_efforts_is_taken(tmp_path: Path, name: str) -> None:
    path = bag(tmp_path / "x.mcap", **{"/controller_state": None, name: 5.0, "/left": None})
    assert read_log((path,), LogConfig(), robot_joints=NAMES).source.topic == name


def test_a_question_proposes_nothing_commanded(tmp_path: Path) -> None:
    path = bag(tmp_path / "x.mcap", **{"/a_command": 1.0, "/left/joint_states": 2.0, "/right/joint_states": 3.0})
    with pytest.raises(ConfigError, match="several topics") as caught:
        read_log((path,), LogConfig(), robot_joints=NAMES)
    assert caught.value.hint == 'choose one: [log] joint_states = "/left/joint_states"'
    assert "command" not in caught.value.render()


@pytest.mark.parametrize("topic", COMMANDED)
def test_a_lone_commanded_topic_is_read_only_when_both_are_stated(tmp_path: Path, topic: str) -> None:
    path = bag(tmp_path / "x.mcap", **{topic: 9.0})
    for stated in ({}, {"joint_states": topic}, {"effort_kind": "motor-torque"}):
        with pytest.raises(LogError, match="measured by their names") as caught:
            read_log((path,), LogConfig.of(stated), robot_joints=NAMES)
        assert f'[log] joint_states = "{topic}"; [log] effort_kind = ' in (caught.value.hint or "")
    both = LogConfig.of({"joint_states": topic, "effort_kind": "motor-torque"})
    assert read_log((path,), both, robot_joints=NAMES).effort is not None
    assert describe((path,)).topics[0].signal in ("desired", "commanded")
    assert describe((path,), both).topics[0].signal == "measured"


def test_commanded_efforts_beside_measured_positions_are_not_taken(tmp_path: Path) -> None:
    path = bag(tmp_path / "x.mcap", **{"/joint_states": None, "/joint_command": 9.0})
    log = read_log((path,), LogConfig(), robot_joints=NAMES)
    assert log.source.topic == "/joint_states" and log.effort is None


@pytest.mark.parametrize("field", ["cmd.tau", "state.tau_J_d", "desired.effort", "tau_cmd"])
def test_a_stated_field_of_commands_needs_its_kind(tmp_path: Path, field: str) -> None:
    settings = {"joint_states": "/joint_states", "fields": {"position": "position", "effort": field}}
    path = bag(tmp_path / "x.mcap", **{"/joint_states": 5.0})
    with pytest.raises(LogError, match="measured by their names"):
        read_log((path,), LogConfig.of(settings), robot_joints=NAMES)


COLUMNS = ("tau_J_d#", "cmd.tau_J_d[#]", "target_moment_#", "desired/effort_#", "tau_setpoint#", "tau_hat_#", "tau_SP#")


def table(path: Path, header: list[str]) -> Path:
    rows = np.column_stack([np.arange(50) * 0.01, *(np.sin(np.arange(50) + k) for k in range(len(header) - 1))])
    np.savetxt(path, rows, delimiter=",", header=",".join(header), comments="", fmt="%.6f")
    return path


@pytest.mark.parametrize("effort", COLUMNS)
@pytest.mark.parametrize("listed", [False, True])
def test_a_lone_column_of_commands_is_read_only_when_both_are_stated(tmp_path: Path, effort: str, listed: bool) -> None:
    columns = [effort.replace("#", str(k)) for k in (1, 2)]
    path = table(tmp_path / "x.csv", ["t", "q1", "q2", *columns])
    with pytest.raises(LogError, match="no column of a measured effort"):
        read_log((path,), LogConfig(), robot_joints=None)
    stated = columns if listed else effort.replace("#", "{i}")
    csv = {"time": "t", "position": "q{i}", "effort": stated}
    with pytest.raises(LogError, match="measured by their names") as caught:
        read_log((path,), LogConfig.of({"csv": csv}), robot_joints=None)
    assert "[log] effort_kind = " in (caught.value.hint or "")
    both = LogConfig.of({"csv": csv, "effort_kind": "motor-torque"})
    assert read_log((path,), both, robot_joints=None).effort is not None


@pytest.mark.parametrize("name", ["tau_desired.csv", "commanded_torque.csv", "torque_setpoint.csv"])
def test_a_file_named_after_commands_is_no_measurement(tmp_path: Path, name: str) -> None:
    position = table(tmp_path / "position.csv", ["t", "joint1", "joint2"])
    effort = table(tmp_path / name, ["t", "joint1", "joint2"])
    assert read_log((position, effort), LogConfig(), robot_joints=None).effort is None
    csv = {"time": "t", "position": "position.csv:joint{i}", "effort": f"{name}:joint{{i}}"}
    with pytest.raises(LogError, match="measured by their names"):
        read_log((position, effort), LogConfig.of({"csv": csv}), robot_joints=None)
    both = LogConfig.of({"csv": csv, "effort_kind": "motor-torque"})
    assert read_log((position, effort), both, robot_joints=None).effort is not None
    measured = table(tmp_path / "torque.csv", ["t", "joint1", "joint2"])
    assert read_log((position, measured), LogConfig(), robot_joints=None).effort is not None


def test_a_commanded_topic_beside_a_simulated_arm_s_is_never_taken(made: Maker, robot: str, tmp_path: Path) -> None:
    files = made("free-clean", robot, duration_s=5.0)
    log = read_log(files.log, load_config(files.config).config.log, robot_joints=None)
    assert log.effort is not None and log.velocity_rad_s is not None
    signals = (log.position_rad, log.velocity_rad_s, log.effort)
    said = [
        w.joint_state(log.joint_names, *rows, stamp_ns=w.EPOCH + round(1e9 * time_s), topic=topic)
        for time_s, *rows in zip(log.time_s[:900], *map(np.ascontiguousarray, signals), strict=False)
        for topic, rows in (("/joint_state_commands", (rows[0], rows[1], 0.9 * rows[2])), ("/joint_states", rows))
    ]
    path = w.write_mcap(tmp_path / "x.mcap", said)
    read = read_log((path,), LogConfig(), robot_joints=log.joint_names)
    assert read.source.topic == "/joint_states"
    np.testing.assert_array_equal(read.effort, log.effort[:900])


@pytest.mark.parametrize("names", [("/a/states", "/b/states"), ("/b/states", "/a/states")])
def test_efforts_with_noise_come_before_a_model_s(tmp_path: Path, names: tuple[str, str]) -> None:
    rng, said = np.random.default_rng(1), []
    for k in range(200):
        at = np.sin(0.004 * k + np.arange(3))
        for topic, force in zip(names, (at, at + rng.normal(0.0, 1e-3, 3)), strict=True):
            said.append(w.joint_state(NAMES, at, at, force, stamp_ns=w.EPOCH + k * w.PERIOD, topic=topic))
    path = w.write_mcap(tmp_path / "x.mcap", said)
    assert read_log((path,), LogConfig(), robot_joints=NAMES).source.topic == names[1]
    noisy = {topic.name: topic.effort_noise for topic in describe((path,)).topics}
    assert noisy == {names[0]: False, names[1]: True}
