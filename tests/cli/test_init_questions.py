"""``init`` writes the right joints or asks; the folder's own collaudit.toml is found and said."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import log_writers as w
import numpy as np
import pytest

NAMES = ["pan_joint", "lift_joint", "elbow_joint"]


def urdf(path: Path, names: list[str]) -> Path:
    """A serial arm of links of 1 kg."""
    inertia = '<inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/>'
    link = '<link name="l{}"><inertial><origin xyz="0.2 0 0"/><mass value="1"/>' + inertia + "</inertial></link>"
    joint = (
        '<joint name="{0}" type="revolute"><parent link="l{1}"/><child link="l{2}"/><origin xyz="0.3 0 0"/>'
        '<axis xyz="0 1 0"/><limit lower="-3" upper="3" effort="99" velocity="3"/></joint>'
    )
    parts = [link.format(k) for k in range(len(names) + 1)]
    parts += [joint.format(name, k, k + 1) for k, name in enumerate(names)]
    path.write_text(f'<robot name="r">{"".join(parts)}</robot>')
    return path


def log(path: Path, header: str) -> Path:
    count = len(header.split(","))
    time = np.arange(400) * 0.01
    rows = np.column_stack([time, *(np.sin(time + k) for k in range(1, count))])
    np.savetxt(path, rows, delimiter=",", header=header, comments="", fmt="%.6f")
    return path


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An own working folder with a robot in it."""
    monkeypatch.chdir(tmp_path)
    urdf(Path("arm.urdf"), NAMES)
    return tmp_path


@pytest.mark.parametrize(
    "header", ["t,q1,q2,q3,tau1,tau2,tau3", "t,q2,q0,q1,tau_J_d0,tau_J_d1,tau_J_d2,tau1,tau3,tau2"]
)
def test_numbered_columns_are_written_by_order(folder: Path, collaudit, header: str) -> None:
    log(Path("x.csv"), header)
    collaudit("init", "x.csv", "--urdf", "arm.urdf", "-o", "c.toml")
    written = tomllib.loads(Path("c.toml").read_text())
    assert written["log"]["joint_names"] == {f"joint{k + 1}": name for k, name in enumerate(NAMES)}
    assert written["robot"]["urdf"] == "arm.urdf"
    assert written["log"]["csv"]["effort"] == "tau{i}"


def test_another_count_is_a_question_in_the_file(folder: Path, collaudit) -> None:
    log(Path("x.csv"), "t,q1,q2,tau1,tau2")
    outcome = collaudit("init", "x.csv", "--urdf", "arm.urdf", "-o", "c.toml")
    assert outcome.code == 3
    assert 'joint_names = { "joint1" = "pan_joint", "joint2" = "lift_joint" }' in outcome.err
    text = Path("c.toml").read_text()
    assert "QUESTION: the log has 2 joints and the robot 3" in text
    assert '# joint_names = { joint1 = "pan_joint", joint2 = "lift_joint" }' in text
    assert collaudit("detect", "x.csv", "-c", "c.toml").code == 3
    stated = "log.joint_names={ joint1 = 'pan_joint', joint2 = 'lift_joint' }"
    assert collaudit("inspect", "x.csv", "-c", "c.toml", "--set", stated).code == 0


def test_columns_that_names_leave_open_are_choices(folder: Path, collaudit) -> None:
    log(
        Path("x.csv"),
        "t,q1,q2,q3," + ",".join(f"{kind}_{k}" for kind in ("motor_torque", "sensor_torque") for k in (1, 2, 3)),
    )
    outcome = collaudit("init", "x.csv", "--urdf", "arm.urdf", "-o", "c.toml")
    text = Path("c.toml").read_text()
    assert outcome.code == 3 and "measured effort" in outcome.err
    assert '# effort = "motor_torque_{i}"' in text and '# effort = "sensor_torque_{i}"' in text
    Path("c.toml").write_text(text.replace('# effort = "sensor_torque_{i}"', 'effort = "sensor_torque_{i}"'))
    assert "open" not in collaudit("inspect", "x.csv", "-c", "c.toml").err


def test_units_and_labels_of_column_names_are_written(folder: Path, collaudit) -> None:
    log(Path("x.csv"), "t,q_deg_1,q_deg_2,q_deg_3,i_A_1,i_A_2,i_A_3,tau_model_nm_1,tau_model_nm_2,tau_model_nm_3,label")
    outcome = collaudit("init", "x.csv", "--urdf", "arm.urdf", "-o", "c.toml")
    assert outcome.code == 3 and "effort-kind" in outcome.err
    text = Path("c.toml").read_text()
    assert "torque_constant_nm_per_a" in text, "what would state it"
    written = tomllib.loads(text)["log"]
    assert written["units"]["position"] == "deg" and written["units"]["effort"] == "raw", "no constant can be told here"
    assert '# labels = ["label"]' in text and "Passed over for effort: tau_model_nm_{i} (model)" in text


def test_paths_stay_as_given(folder: Path, collaudit) -> None:
    log(Path("x.csv"), "t,q1,q2,q3,tau1,tau2,tau3")
    Path("other").mkdir()
    collaudit("init", "x.csv", "--urdf", folder / "arm.urdf", "-o", "other/c.toml")
    assert tomllib.loads(Path("other/c.toml").read_text())["robot"]["urdf"] == str(folder / "arm.urdf")
    collaudit("init", "x.csv", "--urdf", "arm.urdf", "-o", "other/d.toml")
    assert tomllib.loads(Path("other/d.toml").read_text())["robot"]["urdf"] == "../arm.urdf"


def test_paths_of_a_configuration_are_found_from_the_new_one(folder: Path, collaudit) -> None:  # type: ignore[no-untyped-def]
    for name in ("sub/types", "other"):
        Path(name).mkdir(parents=True)
    urdf(Path("sub/arm.urdf"), ["a", "b"])
    log(Path("x.csv"), "t,q1,q2,tau1,tau2")
    Path("sub/c.toml").write_text(
        '[robot]\nurdf = "arm.urdf"\n[log]\nmsg_path = ["types"]\n[fleet.robots.r]\npaths = ["*"]\nconfig = "r.toml"\n'
    )
    collaudit("init", "x.csv", "-c", "sub/c.toml", "-o", "other/d.toml")
    made = tomllib.loads(Path("other/d.toml").read_text())
    assert made["robot"]["urdf"] == "../sub/arm.urdf"
    assert made["log"]["msg_path"] == ["../sub/types"]
    assert made["fleet"]["robots"]["r"]["config"] == "../sub/r.toml"


def test_the_folder_s_configuration_is_used_and_said(folder: Path, collaudit) -> None:
    log(Path("x.csv"), "t,q1,q2,q3,tau1,tau2,tau3")
    assert collaudit("init", "x.csv", "--urdf", "arm.urdf", "-o", "collaudit.toml").code in (0, 3)
    shown = collaudit("inspect", "x.csv", "-v")
    assert shown.err.count("settings of collaudit.toml in this folder are used") == 1
    assert "judged as free motion" in shown.out, "the robot of the file was read"
    Path("mine.toml").write_text("")
    assert "settings of" not in collaudit("inspect", "x.csv", "-c", "mine.toml").err
    fresh = collaudit("init", "x.csv", "-o", "collaudit.toml", "--force")
    assert "settings of" not in fresh.err, "a file that is replaced is not read"
    assert "urdf" not in tomllib.loads(Path("collaudit.toml").read_text()).get("robot", {})


def test_a_guess_of_the_folder_s_configuration_stays_one(folder: Path, collaudit) -> None:  # type: ignore[no-untyped-def]
    robot = ("--urdf", urdf(folder / "arm.urdf", ["a", "b"]))
    run = log(folder / "run.csv", "t,q1,q2,tau1,tau2")
    collaudit("init", run, *robot, "-o", "collaudit.toml")
    first = (folder / "collaudit.toml").read_text(encoding="utf-8")
    assert "GUESS:" in first
    collaudit("init", run, *robot, "-o", "again.toml")
    again = (folder / "again.toml").read_text(encoding="utf-8")
    assert again.count("GUESS:") == first.count("GUESS:")
    stated = re.sub('(gamma_nm = "auto")  # GUESS: .*', r"\1", first)
    (folder / "collaudit.toml").write_text(stated, encoding="utf-8")
    collaudit("init", run, "--set", "robot.tool.mass_kg=0.5", "-o", "third.toml")
    third = (folder / "third.toml").read_text(encoding="utf-8")
    assert 'gamma_nm = "auto"  # as given' in third
    assert "mass_kg = 0.5  # as given" in third
    assert third.count("GUESS:") == first.count("GUESS:") - 2


def test_wrench_columns_stand_in_the_file(folder: Path, collaudit) -> None:
    log(Path("x.csv"), "t,q1,q2,q3,tau1,tau2,tau3,Fx,Fy,Fz,Mx,My,Mz")
    collaudit("init", "x.csv", "--urdf", "arm.urdf", "-o", "c.toml")
    text = Path("c.toml").read_text()
    assert '# wrench = ["Fx", "Fy", "Fz", "Mx", "My", "Mz"]' in text and '# wrench_frame = "ft_sensor"' in text


def test_one_arm_of_two_is_offered_and_taken(folder: Path, collaudit) -> None:
    urdf(Path("arm.urdf"), [f"{side}_{name}" for side in ("left", "right") for name in NAMES])
    log(Path("x.csv"), "t,q1,q2,q3,tau1,tau2,tau3")
    outcome = collaudit("init", "x.csv", "--urdf", "arm.urdf", "-o", "c.toml")
    assert outcome.code == 3
    line = 'joints = ["right_pan_joint", "right_lift_joint", "right_elbow_joint"]'
    assert f"[robot] {line}" in outcome.err
    text = Path("c.toml").read_text()
    assert f"# {line}" in text
    right = ("--set", f"robot.{line}")
    collaudit("init", "x.csv", "--urdf", "arm.urdf", *right, "-o", "d.toml")
    written = tomllib.loads(Path("d.toml").read_text())
    assert written["log"]["joint_names"] == {f"joint{k + 1}": f"right_{name}" for k, name in enumerate(NAMES)}
    shown = collaudit("inspect", "x.csv", "--urdf", "arm.urdf", *right)
    assert "taken as the robot's joints in its order: right_pan_joint, right_lift_joint" in shown.out


@pytest.mark.parametrize("effort", [9.0, None], ids=["with its own efforts", "without efforts"])
def test_measured_joint_states_are_taken_beside_commanded_ones(folder: Path, collaudit, effort: float | None) -> None:
    """Both have the robot's joints; the choice is a guess that names the other topic."""
    said = []
    for k in range(200):
        at = np.sin(0.01 * k + np.arange(3))
        force = [] if effort is None else [effort] * 3
        said.append(w.joint_state(NAMES, at, at, force, stamp_ns=w.EPOCH + k * w.PERIOD, topic="/joint_command"))
        said.append(w.joint_state(NAMES, at, at, at, stamp_ns=w.EPOCH + k * w.PERIOD, topic="/joint_states"))
    w.write_mcap(Path("x.mcap"), said)
    collaudit("init", "x.mcap", "--urdf", "arm.urdf", "-o", "c.toml")
    (line,) = [line for line in Path("c.toml").read_text().splitlines() if line.startswith("joint_states")]
    assert line.startswith('joint_states = "/joint_states"') and "GUESS" in line and "/joint_command" in line


@pytest.mark.parametrize("apart", [False, True], ids=["own type", "efforts apart"])
def test_what_no_profile_reads_is_drafted_as_guesses(folder: Path, collaudit, apart: bool) -> None:
    """Fields of an own type, and the topic of the efforts, are guessed in the file alone."""
    kind, types, said = "trajectory_msgs/msg/JointTrajectoryPoint", w.ROS2.types, []
    zero = types["builtin_interfaces/msg/Duration"](sec=0, nanosec=0)
    for k in range(200):
        at, stamp = np.sin(0.01 * k + np.arange(3)), w.EPOCH + k * w.PERIOD
        if apart:
            said.append(w.joint_state(NAMES, at, at, stamp_ns=stamp))
            said.append(w.joint_state(NAMES, [], [], at, stamp_ns=stamp, topic="/torques"))
        else:
            value = types[kind](positions=at, velocities=at, accelerations=at, effort=at, time_from_start=zero)
            said.append(w.Said("/own", kind, stamp, value))
    w.write_mcap(Path("x.mcap"), said)
    collaudit("init", "x.mcap", "--urdf", "arm.urdf", "-o", "c.toml")
    made = tomllib.loads(Path("c.toml").read_text())["log"]
    if apart:
        assert (made["joint_states"], made["efforts"]) == ("/joint_states", "/torques")
    else:
        assert made["fields"] == {"position": "positions", "velocity": "velocities", "effort": "effort"}
    assert "none of its messages" not in collaudit("inspect", "x.mcap", "-c", "c.toml").err


def test_the_cause_of_a_refusal_stands_in_the_file(folder: Path, collaudit) -> None:
    log(Path("x.csv"), "t,q1,q3,tau1,tau3")
    outcome = collaudit("init", "x.csv", "--urdf", "arm.urdf", "-o", "c.toml")
    assert outcome.code == 3 and "q2 is missing" in outcome.err
    text = Path("c.toml").read_text()
    assert "# MISSING: x.csv: the position columns are numbered and q2 is missing" in text


def test_motor_angles_are_a_question_with_both_answers(folder: Path, collaudit) -> None:
    log(Path("x.csv"), "t,motor_q1,motor_q2,motor_q3,motor_torque1,motor_torque2,motor_torque3")
    outcome = collaudit("init", "x.csv", "--urdf", "arm.urdf", "-o", "c.toml")
    assert outcome.code == 3 and "the motors' by their names" in outcome.err
    text = Path("c.toml").read_text()
    assert '# position = "motor_q{i}"' in text and "reduction = [100.0, …]" in text
    Path("c.toml").write_text(text.replace("# position = ", "position = "))
    assert "motors'" not in collaudit("inspect", "x.csv", "-c", "c.toml").err
    Path("r.toml").write_text('[robot]\nurdf = "arm.urdf"\nreduction = [50.0, 50.0, 50.0]\n')
    collaudit("init", "x.csv", "-c", "r.toml", "-o", "d.toml")
    assert tomllib.loads(Path("d.toml").read_text())["log"]["csv"]["position"] == "motor_q{i}"
