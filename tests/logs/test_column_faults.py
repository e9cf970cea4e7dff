"""A table that names do not explain is refused with its real cause, and the line that is offered reads it."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import numpy as np
import pytest

from collaudit.core.config.schema import LogConfig
from collaudit.core.errors import LogError
from collaudit.core.logs.log_description import describe
from collaudit.core.logs.log_reading import read_log
from collaudit.core.logs.tables.column_roles import find_wrench


def numbered(stem: str, numbers: range | tuple[int, ...]) -> list[str]:
    return [stem.replace("#", str(number)) for number in numbers]


def table(path: Path, names: list[str]) -> Path:
    time = np.arange(60) * 0.01
    rows = np.column_stack([time, *(np.sin(time + k) + k for k in range(1, len(names)))])
    np.savetxt(path, rows, delimiter=",", header=",".join(names), comments="", fmt="%.6f")
    return path


def refusal(path: Path, **settings: object) -> LogError:
    with pytest.raises(LogError) as caught:
        read_log((path,), LogConfig.of(settings), robot_joints=None)
    return caught.value


HOLE = ["t", *numbered("q#", (1, 2, 4)), *numbered("tau#", (1, 2, 4))]
TWICE = ["t", "q1", "q1", "q3", *numbered("tau#", (1, 2, 3))]
SIDES = ["t", *(n for side in ("left", "right") for s in ("q#", "tau#") for n in numbered(f"{side}_{s}", (1, 2, 3)))]
BEHIND = ["t", *(n for s in ("q#", "tau#") for side in ("left", "right") for n in numbered(f"{s}_{side}", (0, 1)))]
DESIRED = ["t", *numbered("q_des_#", (0, 1)), *numbered("tau_cmd_#", (0, 1))]
COMMANDED = ["t", *numbered("q_#", (0, 1)), *numbered("tau_cmd_#", (0, 1))]
FROM_TWO = ["t", *numbered("q#", (2, 3, 4)), *numbered("tau#", (2, 3, 4))]
COUNTS = ["t", *numbered("q_counts_#", (1, 2)), *numbered("tau_#", (1, 2))]


@pytest.mark.parametrize(
    ("names", "cause"),
    [
        (HOLE, "the position columns are numbered and q3 is missing"),
        (FROM_TWO, "the position columns are numbered and q1 is missing"),
        (["t", *numbered("q#", (1, 2, 3)), "tau1", "tau3"], "the effort columns are numbered and tau2 is missing"),
        (TWICE, "two columns are called q1"),
        (SIDES, "the position columns are of several arms or sides: left, right"),
        (BEHIND, "the position columns are of several arms or sides: left, right"),
        (
            ["t", "upper_q1", "upper_q2", "tau1", "tau2"],
            "the position columns have a word in their names that is not known: upper",
        ),
        (DESIRED, "no column of a measured position was recognised"),
        (COMMANDED, "no column of a measured effort was recognised"),
        (COUNTS, "no column of a measured position was recognised"),
    ],
)
def test_the_cause_is_said(tmp_path: Path, names: list[str], cause: str) -> None:
    error = refusal(table(tmp_path / "x.csv", names))
    assert error.message.startswith(cause), error.render()
    assert "[log.csv]" in (error.hint or "")


@pytest.mark.parametrize(
    ("names", "joints"), [(HOLE, 3), (FROM_TWO, 3), (TWICE, 3), (SIDES, 3), (BEHIND, 2), (DESIRED, 2), (COMMANDED, 2)]
)
def test_the_line_that_is_offered_reads_the_table(tmp_path: Path, names: list[str], joints: int) -> None:
    path = table(tmp_path / "x.csv", names)
    hint = refusal(path).hint or ""
    line = re.search(r"\[log\.csv\] (.*?)(, and which|, or \[log|; \[log\] |$)", hint)
    assert line is not None, hint
    stated = tomllib.loads(line[1].replace("; ", "\n"))
    kind = re.search('effort_kind = "([a-z-]+)"', hint)
    settings = {"csv": stated, **({"effort_kind": kind[1]} if kind else {})}
    log = read_log((path,), LogConfig.of(settings), robot_joints=None)
    assert log.position_rad.shape[1] == joints
    first = re.search(r"\d", next(name for name in names if name.startswith(("q", "left_q"))))
    assert first is not None
    column = 1 if names is not BEHIND else names.index("q0_left")
    np.testing.assert_allclose(log.position_rad[0, 0], np.sin(column) + column, atol=1e-6)
    assert log.effort is not None and np.isfinite(log.effort).all()


def test_a_list_and_numbers_of_other_joints_are_not_paired(tmp_path: Path) -> None:
    path = table(tmp_path / "x.csv", ["t", "q1", "q2", "q4", *numbered("tau#", (1, 2, 3, 4))])
    error = refusal(path, csv={"position": ["q1", "q2", "q4"], "effort": "tau{i}"})
    assert "of different joints" in error.message, "tau3 is not the effort of q4"


def test_what_is_passed_over_is_named_in_a_question(tmp_path: Path) -> None:
    names = ["t", *numbered("q#", (1, 2)), *numbered("motor_torque_#", (1, 2)), *numbered("sensor_torque_#", (1, 2))]
    error = refusal(table(tmp_path / "x.csv", [*names, *numbered("tau_model_#", (1, 2))]))
    assert "tau_model_{i} (model)" in (error.found or "")


@pytest.mark.parametrize("kinds", [("torque_sensor_a_#", "torque_sensor_b_#"), ("raw_torque_#", "cal_torque_#")])
def test_a_word_that_decides_nothing_is_a_question(tmp_path: Path, kinds: tuple[str, str]) -> None:
    names = ["t", *numbered("q#", (1, 2)), *(name for kind in kinds for name in numbered(kind, (1, 2)))]
    error = refusal(table(tmp_path / "x.csv", names))
    assert "several groups of columns could be the measured effort" in error.message
    assert all(kind.replace("#", "{i}") in (error.found or "") for kind in kinds)


def test_an_unknown_word_beside_measured_columns_is_passed_over_by_name(tmp_path: Path) -> None:
    names = ["t", *(name for kind in ("q#", "tau#", "master_q#", "gripper_q#") for name in numbered(kind, (1, 2)))]
    path = table(tmp_path / "x.csv", [*names, *numbered("finger_q#", (1,))])
    log = read_log((path,), LogConfig(), robot_joints=None)
    said = next(f.text for f in log.findings if "passed over" in f.text)
    assert "master_q{i} (unknown word), gripper_q{i} (unknown word)" in said and "finger" not in said


def test_inspect_says_desired_and_why(tmp_path: Path) -> None:
    path = table(tmp_path / "x.csv", ["t", *numbered("q#", (1, 2)), *numbered("q_des#", (1, 2)),
                                      *numbered("tau#", (1, 2)), *numbered("tau_cmd#", (1, 2))])  # fmt: skip
    found = {column.name: (column.role, column.why) for column in describe((path,), LogConfig()).columns}
    assert found["q_des1"][0] == "desired position" and "not taken for a measurement" in found["q_des1"][1]
    assert found["tau_cmd2"][0] == "commanded effort"
    assert found["q1"][0] == "position"


SIX = ("x", "y", "z")
WRENCHES = [
    ["Fx", "Fy", "Fz", "Mx", "My", "Mz"],
    ["Fx [N]", "Fy [N]", "Fz [N]", "Tx [Nm]", "Ty [Nm]", "Tz [Nm]"],
    [f"/ft/wrench/{kind}/{axis}" for kind in ("force", "torque") for axis in SIX],
    [f"field.wrench.{kind}.{axis}" for kind in ("force", "torque") for axis in SIX],
    [f"force_{axis}" for axis in SIX] + [f"torque_{axis}" for axis in SIX],
    [f"actual_TCP_force_{k}" for k in range(6)],
    [f"ft{k}" for k in range(1, 7)],
]


@pytest.mark.parametrize("six", WRENCHES)
def test_wrench_columns_are_offered_in_their_order(six: list[str], tmp_path: Path) -> None:
    shuffled = ["t", "q1", "tau1", *reversed(six), "label"]
    found = find_wrench(shuffled)
    assert found is not None and list(found.names) == six and not found.estimated
    path = table(tmp_path / "x.csv", ["t", "q1", "tau1", *six])
    offered = [column for column in describe((path,), LogConfig()).columns if column.role == "wrench?"]
    assert [column.name for column in offered] == six and "[log.csv] wrench" in offered[0].why
    stated = {"csv": {"position": "q{i}", "effort": "tau{i}", "wrench": six}, "wrench_frame": "tool0"}
    log = read_log((path,), LogConfig.of(stated), robot_joints=None)
    assert log.wrench is not None and log.wrench.wrench[0, 5] == pytest.approx(np.sin(8) + 8, abs=1e-6)


@pytest.mark.parametrize(
    "names",
    [
        [f"O_F_ext_hat_K_{k}" for k in range(6)],
        [f"{kind}_est_{axis}" for kind in ("force", "torque") for axis in SIX],
    ],
)
def test_an_estimated_wrench_is_no_sensor(names: list[str], tmp_path: Path) -> None:
    found = find_wrench(names)
    assert found is not None and found.estimated
    path = table(tmp_path / "x.csv", ["t", "q1", "tau1", *names])
    roles = {column.name: column.role for column in describe((path,), LogConfig()).columns}
    assert {roles[name] for name in names} == {"estimated wrench"}


@pytest.mark.parametrize("names", [["x", "y", "z", "rx", "ry", "rz"], ["Fx", "Fy", "Fz"], ["t1", "t2", "t3", "m1"]])
def test_other_columns_are_no_wrench(names: list[str]) -> None:
    assert find_wrench(names) is None
