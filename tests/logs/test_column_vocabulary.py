"""Columns as robot software heads them: every vocabulary, joint count, base and column order against the truth."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from vocabularies import VOCABULARIES, header

from collaudit.core.config.schema import LogConfig
from collaudit.core.errors import ConfigError, LogError
from collaudit.core.logs.log_description import describe
from collaudit.core.logs.log_guess import guess_csv_columns
from collaudit.core.logs.log_reading import read_log
from collaudit.core.logs.tables.column_assignment import recognise
from collaudit.core.logs.tables.column_groups import choose, groups_of

RAW: dict[str, Any] = {"units": {"effort": "raw", "time": "s", "position": "rad", "velocity": "rad/s"}}


@pytest.mark.parametrize("base", [0, 1])
@pytest.mark.parametrize("joints", [1, 2, 6, 7])
@pytest.mark.parametrize("name", VOCABULARIES)
def test_measured_columns_are_found_in_the_order_of_their_numbers(
    tmp_path: Path, name: str, joints: int, base: int
) -> None:
    robot = [f"axis_{letter}" for letter in "abcdefg"[:joints]]
    wanted = VOCABULARIES[name][1]
    for seed in range(3):
        columns = header(name, joints, base, seed)
        rows = [[0.01 * k, *(0.01 * n + 0.1 * k for n in range(1, len(columns)))] for k in range(5)]
        path = tmp_path / f"{seed}.csv"
        path.write_text("\n".join([",".join(columns), *(",".join(f"{x:.6f}" for x in row) for row in rows)]) + "\n")
        log = read_log((path,), LogConfig.of(RAW), robot_joints=robot)
        assert log.joint_names == tuple(robot)
        for stem, values in zip(wanted, (log.position_rad, log.velocity_rad_s, log.effort), strict=True):
            truth = [columns.index(stem.replace("#", str(base + k))) for k in range(joints)] if stem else []
            if not stem:
                assert values is None
            else:
                assert values is not None
                np.testing.assert_allclose(values, np.array(rows)[:, truth], atol=1e-6)
        passed = " ".join(finding.text for finding in log.findings if "passed over" in finding.text)
        assert "desired" in passed or not any(re.search("_d(es)?[_#[]", other) for other in VOCABULARIES[name][2])


@pytest.mark.parametrize("joints", [5, 7])
def test_another_count_is_refused_with_the_line_to_add(tmp_path: Path, joints: int) -> None:
    robot = [f"axis_{letter}" for letter in "abcdef"]
    for name in VOCABULARIES:
        columns = header(name, joints, 1, 0)
        path = tmp_path / "x.csv"
        path.write_text(",".join(columns) + "\n" + "\n".join(",".join([str(k)] * len(columns)) for k in range(4)))
        with pytest.raises(LogError) as caught:
            read_log((path,), LogConfig.of(RAW), robot_joints=robot)
        assert '[log] joint_names = { "joint1" = "axis_a"' in caught.value.render()


def _write(path: Path, text: str) -> Path:
    columns = text.split(",")
    rows = [",".join(f"{0.01 * k + n}" for n in range(len(columns))) for k in range(5)]
    path.write_text("\n".join([text, *rows]) + "\n")
    return path


def test_what_names_leave_open_is_asked(tmp_path: Path) -> None:
    path = _write(tmp_path / "x.csv", "t,q_1,q_2,torque_sensor_a_1,torque_sensor_a_2,motor_torque_1,motor_torque_2")
    with pytest.raises(LogError, match="measured effort") as caught:
        read_log((path,), LogConfig(), robot_joints=None)
    hint = caught.value.hint or ""
    assert 'position = "q_{i}"' in hint and 'effort = "torque_sensor_a_{i}"' in hint
    guess = guess_csv_columns([path])
    assert guess is not None and set(guess.open["effort"]) == {"torque_sensor_a_{i}", "motor_torque_{i}"}


def test_counts_that_differ_between_quantities_are_refused(tmp_path: Path) -> None:
    path = _write(tmp_path / "x.csv", "t,q0,q1,q2,tau1,tau2")
    with pytest.raises(LogError, match="different joints"):
        read_log((path,), LogConfig(), robot_joints=None)


def test_bases_may_differ_between_quantities(tmp_path: Path) -> None:
    path = _write(tmp_path / "x.csv", "t,q0,q1,tau2,tau1")
    log = read_log((path,), LogConfig.of(RAW), robot_joints=["a", "b"])
    assert log.effort is not None and log.effort[0].tolist() == [4.0, 3.0]


def test_a_pattern_from_one_never_drops_column_zero(tmp_path: Path) -> None:
    path = _write(tmp_path / "x.csv", "t,q0,q1,q2")
    with pytest.raises(LogError, match="count from 0") as caught:
        read_log((path,), LogConfig.of({"csv": {"time": "t", "position": "q{i}"}}), robot_joints=None)
    assert "q{i0}" in (caught.value.hint or "")


def test_units_of_names_are_used(tmp_path: Path) -> None:
    path = _write(tmp_path / "x.csv", "t,q_deg_1,q_deg_2,dq_degps_1,dq_degps_2")
    log = read_log((path,), LogConfig(), robot_joints=None)
    assert log.position_rad[0].tolist() == pytest.approx(np.deg2rad([1, 2]).tolist())
    assert log.velocity_rad_s is not None
    assert log.velocity_rad_s[0].tolist() == pytest.approx(np.deg2rad([3, 4]).tolist())


@pytest.mark.parametrize("form", ["AxisAct_A{}", "$AXIS_ACT.A{}", "$AXIS_ACT_MEAS.A{}"])
def test_positions_under_the_name_of_a_controllers_variable_are_degrees(tmp_path: Path, form: str) -> None:
    columns = [*(form.format(k) for k in (1, 2)), *(f"$TORQUE_AXIS_ACT[{k}]" for k in (1, 2))]
    log = read_log((_write(tmp_path / "x.csv", ",".join(["t", *columns])),), LogConfig(), robot_joints=["a", "b"])
    assert log.position_rad[0].tolist() == pytest.approx(np.deg2rad([1, 2]).tolist())
    assert log.effort is not None and log.effort[0].tolist() == [3.0, 4.0]


def test_units_that_are_not_converted_are_passed_over() -> None:
    groups = groups_of(["q_1", "q_2", "tau_mNm_1", "tau_mNm_2"])
    choice = choose(groups, "effort")
    assert choice.taken is None and [group.said for group in choice.passed] == ["tau_mNm_{i} (plain in mNm)"]


@pytest.mark.parametrize("drives", ["tau_percent_{}", "tau_permille_{}", "i_mA_{}", "i_A_{}"])
def test_torques_come_before_what_drives_count_in(drives: str) -> None:
    names = [pattern.format(k) for pattern in ("q_{}", "tau_nm_{}", drives) for k in (1, 2)]
    taken = choose(groups_of(names), "effort").taken
    assert taken is not None and taken.pattern == "tau_nm_{i}"
    alone = choose(groups_of(names[:2] + names[4:]), "effort").taken
    assert alone is not None and alone.pattern == drives.format("{i}")


def test_single_columns_of_desired_and_actual_values_are_no_joints(tmp_path: Path) -> None:
    path = _write(tmp_path / "x.csv", "t,step,q_des,q_act,dq_des,dq_act,torque")
    with pytest.raises(LogError, match="no columns of joint positions"):
        read_log((path,), LogConfig(), robot_joints=None)


def test_joints_named_in_paths_and_labels(tmp_path: Path) -> None:
    path = _write(tmp_path / "x.csv", "__time,/joint_states/lift/position,/joint_states/pan/position,label")
    log = read_log((path,), LogConfig(), robot_joints=["pan", "lift"])
    assert log.position_rad[0].tolist() == [2.0, 1.0]
    (label,) = (column for column in describe((path,)).columns if column.name == "label")
    assert label.role == "label?" and "[log] labels" in label.why
    guess = guess_csv_columns([path])
    assert guess is not None and guess.csv.position == "joint_states/{joint}/position"
    again = read_log((path,), LogConfig(csv=guess.csv), robot_joints=["pan", "lift"])
    assert again.joint_names == ("pan", "lift")


@pytest.mark.parametrize("side", ["link", "load", "joint"])
def test_the_joints_own_side_comes_before_the_motors(side: str) -> None:
    names = ["time", *(f"motor_q{k}" for k in range(6)), *(f"{side}_q{k}" for k in range(6))]
    for order in (names, names[:1] + names[:0:-1]):
        taken = choose(groups_of(order), "position").taken
        assert taken is not None
        assert [order[column] for column in taken.columns] == [f"{side}_q{k}" for k in range(6)]


def _echo(path: Path, names: Sequence[Sequence[str]]) -> Path:
    """As ``rostopic echo -p`` writes joint states: the names in columns of their own."""
    columns = ["%time", *(f"field.{q}{k}" for q in ("name", "position", "effort") for k in range(len(names[0])))]
    rows = [[f"{0.01 * n:.2f}", *own, *(str(0.1 * n + k) for k in range(2 * len(own)))] for n, own in enumerate(names)]
    path.write_text("\n".join(",".join(row) for row in [columns, *rows]) + "\n")
    return path


@pytest.mark.parametrize("stated", [{}, {"csv": {"position": "field.position{i0}", "effort": "field.effort{i0}"}}])
def test_names_beside_a_message_s_columns_settle_their_order(tmp_path: Path, stated: dict[str, Any]) -> None:
    robot = ["shoulder_pan", "shoulder_lift", "elbow"]
    path = _echo(tmp_path / "x.csv", [sorted(robot)] * 9)
    log = read_log((path,), LogConfig.of({**RAW, **stated}), robot_joints=robot)
    assert log.joint_names == tuple(robot)
    assert log.position_rad[0].tolist() == [2.0, 1.0, 0.0]
    guess = guess_csv_columns([path])
    assert guess is not None and guess.joints == tuple(sorted(robot))


def test_names_that_take_turns_are_no_columns_of_joints(tmp_path: Path) -> None:
    path = _echo(tmp_path / "x.csv", [["a", "b"], ["b", "a"]] * 5)
    with pytest.raises(LogError, match="several publishers take turns"):
        read_log((path,), LogConfig.of(RAW), robot_joints=["a", "b"])


def test_matlab_s_names_of_a_message_s_columns(tmp_path: Path) -> None:
    path = _write(tmp_path / "x.csv", "x__time,x_joint_states_position_0_,x_joint_states_position_1_")
    assert read_log((path,), LogConfig(), robot_joints=["a", "b"]).position_rad[0].tolist() == [1.0, 2.0]
    with pytest.raises(LogError, match="by the alphabet"):
        read_log((path,), LogConfig(), robot_joints=["b", "a"])


@pytest.mark.parametrize("stated", [{}, {"csv": {"position": "actual_joint_position_{i0}"}}])
def test_doosan_s_state_is_in_degrees_and_a_like_named_one_is_not(tmp_path: Path, stated: dict[str, Any]) -> None:
    # dsr_msgs2/RobotStateRt of Doosan: [deg]; raw_joint_torque is the sensor's, actual_joint_torque an estimate.
    own = _write(tmp_path / "a.csv", "t,actual_joint_position_0,actual_joint_torque_0,raw_joint_torque_0")
    other = _write(tmp_path / "b.csv", "t,actual_joint_position_0,actual_joint_torque_0")
    for path, first, effort in ((own, np.deg2rad(1.0), 3.0), (other, 1.0, 2.0)):
        log = read_log((path,), LogConfig.of({"units": {"time": "s"}, **stated}), robot_joints=["a"])
        assert log.position_rad[0, 0] == pytest.approx(first)
        assert stated or (log.effort is not None and log.effort[0, 0] == effort)


MOTOR = "t,motor_q0,motor_q1,motor_dq0,motor_dq1,motor_torque0,motor_torque1"


def test_positions_of_the_motors_side_alone_are_asked_about(tmp_path: Path) -> None:
    path = _write(tmp_path / "x.csv", MOTOR)
    with pytest.raises(LogError, match="the motors' by their names") as caught:
        read_log((path,), LogConfig(), robot_joints=["a", "b"])
    hint = caught.value.hint or ""
    assert '[log.csv] position = "motor_q{i0}"' in hint and "[robot] reduction" in hint
    assert 'velocity = "motor_dq{i0}"' in hint and 'effort = "motor_torque{i0}"' in hint
    stated = {"csv": {"position": "motor_q{i0}", "effort": "motor_torque{i0}"}, **RAW}
    log = read_log((path,), LogConfig.of(stated), robot_joints=["a", "b"])
    assert log.position_rad[0].tolist() == [1.0, 2.0]


def test_a_velocity_of_the_motors_side_is_none_of_the_joints(tmp_path: Path) -> None:
    path = _write(tmp_path / "x.csv", "t,q0,q1,motor_dq0,motor_dq1,tau0,tau1")
    log = read_log((path,), LogConfig.of(RAW), robot_joints=["a", "b"])
    assert log.velocity_rad_s is None
    assert any("motor_dq{i0}" in finding.text for finding in log.findings if "passed over" in finding.text)


@pytest.mark.parametrize("word", ["tau", "measured_torque", "trq"])
def test_columns_named_by_joints_are_known_by_the_words_of_numbered_ones(tmp_path: Path, word: str) -> None:
    path = _write(tmp_path / "x.csv", f"t,left_q,right_q,left_{word},right_{word},left_{word}_cmd,right_{word}_cmd")
    log = read_log((path,), LogConfig(), robot_joints=["left", "right"])
    assert log.effort is not None
    assert log.effort[0].tolist() == [3.0, 4.0]


def test_a_word_for_currents_makes_named_columns_currents(tmp_path: Path) -> None:
    path = _write(tmp_path / "x.csv", "t,left_q,right_q,left_curr,right_curr")
    with pytest.raises(ConfigError, match="the efforts are currents"):
        read_log((path,), LogConfig(), robot_joints=["left", "right"])


@pytest.mark.parametrize(
    "columns",
    [
        ["current_orientation_w", "current_orientation_x", "current_position_y"],
        ["q_velocity_cmd_a", "q_velocity_cmd_b"],
        ["theta_dot_left", "theta_ddot_left"],
        ["angle_velocity_joint1", "angle_velocity_joint2"],
        ["tau_ext_hat_1", "tau_ext_hat_2", "tauExt1", "tauExt2"],
    ],
)
def test_columns_of_another_quantity_are_not_named_by_joints(columns: list[str]) -> None:
    found, choices = recognise(["t", *columns], 0)
    taken = {(quantity, columns[column - 1]) for quantity, of in found.items() for column in of.columns}
    assert taken <= {("velocity", "theta_dot_left")}
    assert not any(choice.taken for quantity, choice in choices.items() if quantity != "velocity")


@pytest.mark.parametrize("form", ["{}.{}", "{1}_{0}", "/joint_states/{}/{}"])
def test_joints_with_names_of_which_some_have_a_number(form: str) -> None:
    """The commonest arm: three of its six joints are numbered, and are no arm of their own."""
    joints = ["shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint", *(f"wrist_{k}_joint" for k in (1, 2, 3))]
    columns = [form.format(joint, word) for word in ("position", "velocity", "effort") for joint in joints]
    found, choices = recognise(["t", *columns], 0)
    assert {quantity: list(of.joints) for quantity, of in found.items()} == dict.fromkeys(
        ("position", "velocity", "effort"), joints
    )
    assert not any(choice.open for choice in choices.values())


def test_theta_of_a_joint_is_no_motor(tmp_path: Path) -> None:
    path = _write(tmp_path / "x.csv", "t,theta1,theta2,tau1,tau2")
    assert read_log((path,), LogConfig.of(RAW), robot_joints=["a", "b"]).position_rad[0].tolist() == [1, 2]


def test_a_number_in_brackets_is_no_unit() -> None:
    """Numbers that begin with 2 are of no whole arm, and these columns are not all of the joint ``js``."""
    found, _ = recognise(["t", "/js/tau[2]", "/js/tau[3]"], 0)
    assert not found


def test_two_columns_of_one_joint_are_refused(tmp_path: Path) -> None:
    path = _write(tmp_path / "x.csv", "t,left_q,left_q,left_tau")
    with pytest.raises(LogError, match="two columns hold the position of left"):
        read_log((path,), LogConfig.of(RAW), robot_joints=["left"])


@pytest.mark.parametrize("form", ["{q}_{j}", "{j}.{q}", "{j}_{q}"])
@pytest.mark.parametrize("turns", [("Pitch", "Wrist_Pitch", "Wrist_Roll"), ("yaw", "roll", "pitch")])
def test_joints_that_are_called_by_a_turn_are_joints_beside_others(
    tmp_path: Path, form: str, turns: tuple[str, ...]
) -> None:
    joints = ["Rotation", *turns, "Jaw"]
    columns = [form.format(q=q, j=j) for q in ("position", "velocity", "torque") for j in joints]
    log = read_log((_write(tmp_path / "x.csv", ",".join(["t", *columns])),), LogConfig(), robot_joints=None)
    assert set(log.joint_names) == set(joints)
    assert log.effort is not None and log.effort.shape[1] == len(joints)


@pytest.mark.parametrize("others", [["position_roll", "position_pitch"], ["torque_roll", "torque_pitch"]])
def test_an_orientation_beside_joints_is_none(tmp_path: Path, others: list[str]) -> None:
    columns = [f"{q}_{j}" for q in ("position", "torque") for j in ("base", "elbow")]
    log = read_log((_write(tmp_path / "x.csv", ",".join(["t", *columns, *others])),), LogConfig(), robot_joints=None)
    assert len(log.joint_names) == 2
