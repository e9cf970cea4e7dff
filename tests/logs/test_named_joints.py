"""Columns named by joints whose names hold numbers: they keep their names; columns that only count stay numbered."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from collaudit.core.config.schema import LogConfig
from collaudit.core.errors import ConfigError, LogError
from collaudit.core.logs.inputs import group_inputs
from collaudit.core.logs.log_description import describe
from collaudit.core.logs.log_guess import arms_of, guess_csv_columns
from collaudit.core.logs.log_reading import read_log
from collaudit.core.logs.signals.joint_naming import map_names
from collaudit.core.logs.tables.column_assignment import recognise

UR = ["shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint", *(f"wrist_{k}_joint" for k in (1, 2, 3))]
BAXTER = [f"{side}_{name}" for side in ("right", "left") for name in ("s0", "s1", "e0", "e1", "w0", "w1", "w2")]
ARM = [f"arm_{k}_joint" for k in range(1, 8)]
TIAGO = ["wheel_right_joint", "wheel_left_joint", "torso_lift_joint", "head_1_joint", "head_2_joint", *ARM]
MOTION = ("position", "velocity", "effort")
SETTINGS: dict[str, Any] = {"units": {"effort": "raw", "time": "s", "position": "rad", "velocity": "rad/s"}}


def columns(joints: list[str], words: tuple[str, ...] = MOTION, form: str = "{}.{}") -> list[str]:
    return [form.format(joint, word) for word in words for joint in joints]


def table(path: Path, names: list[str]) -> Path:
    rows = np.arange(20.0)[:, None] * 0.01 + np.arange(len(names) + 1)
    frame = pd.DataFrame(rows, columns=["time", *names])
    if path.suffix == ".parquet":
        frame.to_parquet(path)
    else:
        frame.to_csv(path, index=False)
    return path


def test_axes_of_a_robot_are_its_joints_whatever_they_are_called() -> None:
    """x, y and z are parts of a pose, except where the robot's joints have these names."""
    axes = ["x", "y", "z"]
    names = ["time", *columns(axes)]
    assert [list(of.joints) for of in recognise(names, 0, axes)[0].values()] == [axes] * 3
    assert recognise(names, 0)[0] == {}


@pytest.mark.parametrize("form", ["{}.{}", "{1}_{0}", "/joint_states/{}/{}"])
@pytest.mark.parametrize(
    "joints", [BAXTER[7:], BAXTER, [f"{side}_{name}" for side in ("left", "right") for name in UR], UR]
)
def test_names_that_numbering_would_lose_are_kept(joints: list[str], form: str) -> None:
    found, choices = recognise(["time", *columns(joints, (*MOTION, "temperature"), form)], 0)
    assert {quantity: list(of.joints) for quantity, of in found.items()} == dict.fromkeys(
        (*MOTION, "temperature"), joints
    )
    assert not any(choice.open for choice in choices.values())


def test_names_of_the_robot_are_kept_and_numbers_are_not() -> None:
    names = ["time", *columns(ARM)]
    assert {of.pattern for of in recognise(names, 0, TIAGO)[0].values()} == {f"{{joint}}.{word}" for word in MOTION}
    assert recognise(names, 0)[0]["position"].pattern == "arm_{i}_joint.position"
    whole = recognise(["time", *columns(TIAGO)], 0, TIAGO)[0]
    assert [list(of.joints) for of in whole.values()] == [TIAGO] * 3
    for forms in (("position_{}", "effort_{}"), ("q{}", "tau{}"), ("joint_{}_pos", "joint_{}_tau"), ("joint{}.q",)):
        counted = [form.format(k) for form in forms for k in range(1, 7)]
        for robot in (UR, [f"joint{k}" for k in range(1, 7)], ["joint_1"]):
            found = recognise(["time", *counted], 0, robot)[0]
            assert found["position"].pattern == forms[0].replace("{}", "{i}")


@pytest.mark.parametrize("suffix", ["csv", "parquet"])
@pytest.mark.parametrize(
    "stated",
    [{}, {word: f"arm_{{i}}_joint.{word}" for word in MOTION}, {word: columns(ARM, (word,))[::-1] for word in MOTION}],
)
def test_a_table_named_by_the_robot_needs_no_mapping(tmp_path: Path, suffix: str, stated: dict[str, Any]) -> None:
    path = table(tmp_path / f"log.{suffix}", columns(ARM))
    log = read_log((path,), LogConfig.of({**SETTINGS, "csv": {"time": "time", **stated}}), robot_joints=TIAGO)
    assert log.joint_names == tuple(ARM)
    assert log.position_rad[0].tolist() == [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]
    assert log.effort is not None and log.effort[0].tolist() == [15.0, 16.0, 17.0, 18.0, 19.0, 20.0, 21.0]
    assert describe((path,), None, TIAGO).topics[0].joints == tuple(ARM)
    guess = guess_csv_columns((path,), TIAGO)
    assert guess is not None and guess.csv.position == "{joint}.position"


def test_two_arms_in_one_table_are_told_apart_by_their_names(tmp_path: Path) -> None:
    names = columns([f"{side}_{name}" for side in ("left", "right") for name in UR])
    path = table(tmp_path / "log.csv", names)
    arms = arms_of(describe((path,)), UR, (), {})
    assert {side: list(arm.joints) for side, arm in arms.items()} == {
        side: [f"{side}_{name}" for name in UR] for side in ("left", "right")
    }
    for side, first in (("left", 1.0), ("right", 7.0)):
        stated = {word: f"{side}_{{joint}}.{word}" for word in MOTION}
        log = read_log((path,), LogConfig.of({**SETTINGS, "csv": {"time": "time", **stated}}), robot_joints=UR)
        assert log.joint_names == tuple(UR) and log.position_rad[0, 0] == first


def test_no_joint_is_proposed_for_one_of_another_limb() -> None:
    for log in (["left_w0", "left_w1"], ["left_arm_1", "left_arm_2", "left_arm_3"]):
        with pytest.raises(LogError) as caught:
            map_names(log, {}, ["head_pan", *(name.replace("_w", "_wrist") for name in BAXTER)], "x.csv")
        assert '"head_pan"' not in caught.value.render() and f'"{log[0]}" = ' in caught.value.render()
    with pytest.raises(LogError, match="none of the log's joints") as caught:
        map_names(["left_w0"], {"left_w0": "gone"}, ["head_pan", *BAXTER], "x.csv")
    assert '"left_w0" = "…"' in caught.value.render()


def test_a_stated_name_wins_over_a_joint_of_another_arm_that_is_called_so() -> None:
    log = ["elbow", "wrist", "right_elbow", "right_wrist"]
    found = map_names(log, {"right_elbow": "elbow", "right_wrist": "wrist"}, ["elbow", "wrist"], "x.csv")
    assert found.log == ("right_elbow", "right_wrist") and found.model == ("elbow", "wrist")
    assert any("own elbow, wrist: left out" in f.text for f in found.findings)
    with pytest.raises(ConfigError, match="both the robot's 'elbow'"):
        map_names(log, {"right_elbow": "elbow", "right_wrist": "elbow"}, ["elbow", "wrist"], "x.csv")


@pytest.mark.parametrize("extra", [["rail"], ["lift", "rail"], ["axis_e1"]])
@pytest.mark.parametrize("form", ["q_{}", "{}_pos", "pos.{}"])
def test_a_joint_beside_numbered_ones_is_the_robots(extra: list[str], form: str) -> None:
    """An arm on a rail: numbering would lose the rail."""
    robot = [*extra, *(f"joint{k}" for k in range(1, 7))]
    effort = form.replace("q_", "tau_").replace("pos", "tau")
    columns_of = [shape.format(joint) for shape in (form, effort) for joint in robot]
    found = recognise(["time", *columns_of], 0, robot)[0]
    assert set(found["position"].joints) == set(found["effort"].joints) == set(robot)
    without = recognise(["time", *columns_of], 0, [])[0]
    assert set(without["position"].joints) == set(robot), "it has an effort, as the others do"
    other = recognise(["time", *columns_of], 0, UR)[0]
    assert other["position"].is_numbered, "joints of another name are told by their order"


WORDS = (
    MOTION,
    ("q", "qd", "tau"),
    ("pos", "vel", "eff"),
    ("angle", "speed", "effort"),
    ("actual_q", "actual_qd", "torque"),
)
NAMES = [*UR, *TIAGO[2:5], "Rotation", "Wrist_Roll", "j1", "joint_2", "A3", "SP", "EP", "axis4", "thumb", "S", "L", "B"]


@pytest.mark.parametrize("between", ["_", ".", "/", " ", "-"])
def test_no_joint_is_lost_whatever_it_is_called(between: str) -> None:
    """By its name where the robot is known; else as many columns as there are joints, or none."""
    rng = np.random.default_rng(62)
    for _ in range(100):
        joints = [str(name) for name in rng.choice(NAMES, int(rng.integers(2, 8)), replace=False)]
        form = f"{{0}}{between}{{1}}" if rng.random() < 0.5 else f"{{1}}{between}{{0}}"
        names = columns(joints, WORDS[rng.integers(len(WORDS))], form)
        rng.shuffle(names)
        found, _ = recognise(["t", *names], 0, joints)
        assert {quantity: set(each.joints) for quantity, each in found.items()} == {
            quantity: set(joints) for quantity in MOTION
        }, names
        unknown = recognise(["t", *names], 0)[0].values()
        assert all(len(each.columns) == len(joints) for each in unknown), names


def test_words_alone_are_one_joint() -> None:
    """A bench of one joint: a column each, without number or name; a table of rows a joint has a column besides."""
    found, _ = recognise(["time", "position", "velocity", "effort"], 0)
    assert {key: each.columns for key, each in found.items()} == {"position": (1,), "velocity": (2,), "effort": (3,)}
    for others in (["name", "position", "velocity", "effort"], ["position", "velocity"], ["q", "tau", "current"]):
        assert not recognise(["time", *others], 0)[0]


@pytest.mark.parametrize(("name", "joints"), [("joint_{}", 3), ("axis{}", 3), ("run{}", 1)])
def test_a_file_a_joint_is_one_log_and_runs_of_a_joint_are_several(name: str, joints: int, tmp_path: Path) -> None:
    rows = np.arange(20.0)[:, None] * 0.01 + np.arange(4)
    paths = [tmp_path / f"{name.format(k)}.csv" for k in (1, 2, 3)]
    for k, path in enumerate(paths):
        pd.DataFrame(rows + np.array([0, k, k, k]), columns=["time", "position", "velocity", "effort"]).to_csv(
            path, index=False
        )
    settings = LogConfig.of(SETTINGS)
    groups = group_inputs(paths, settings)
    assert [len(group) for group in groups] == [joints] * (3 // joints)
    log = read_log(groups[0], settings, robot_joints=None)
    assert log.joint_names == tuple(f"joint{k}" for k in range(1, joints + 1))
    assert log.position_rad[0].tolist() == [1.0 + k for k in range(joints)]


@pytest.mark.parametrize("joints", [["shoulder", "elbow"], ["J1", "gripper"], ["1", "2"]])
@pytest.mark.parametrize(
    ("words", "asked"),
    [
        (("tau_a", "tau_b"), True),
        (("tau", "torque"), True),
        (("tau_meas", "tau_x"), False),
        (("torque", "current"), False),
    ],
)
def test_rivals_are_asked_about_whatever_joints_are_called(
    joints: list[str], words: tuple[str, str], asked: bool
) -> None:
    """Two efforts that names do not tell apart: one of them may be what the controller computes."""
    names = [f"{word}_{joint}" for word in ("q", *words) for joint in joints]
    found, choices = recognise(["t", *names], 0)
    assert bool(choices["effort"].open) == asked and ("effort" in found) != asked
    assert found["position"].columns == (1, 2)
    assert asked or found["effort"].columns == (3, 4)
