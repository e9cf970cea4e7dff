"""Which place is the forearm's outer end: of arms as their makers describe them, and of small ones by hand."""

from __future__ import annotations

from math import pi
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from arms import LEVEL, dh_robot, dh_row

from collaudit.core.config.schema import Config, PolicyConfig, RobotConfig
from collaudit.core.errors import ConfigError
from collaudit.core.robot.arm_places import Place, arm_places, asked_forces, exerted_force
from collaudit.core.robot.robot_building import build_robot
from collaudit.core.robot.robot_model import RobotModel
from collaudit.fixtures.arms import robot_named


def dh(*rows: dict[str, float], convention: str = "standard", **keys: Any) -> RobotModel:
    made = [dh_row(1.0, (0, 0, 0), (0.01, 0.01, 0.01), **row) for row in rows]
    config = Config.of({"robot": dh_robot(made, convention, **keys)})
    return build_robot(config.robot, Path(), tuple(f"joint{k + 1}" for k in range(len(rows))))


def forearm(robot: RobotModel) -> Place | None:
    found = [place for place in arm_places(robot, robot.joint_names, None) if place.name == "forearm"]
    return found[0] if found else None


#: UR3e, whose wrist is not spherical and half as long as its forearm.
UR3E = (
    {"d": 0.15185, "alpha": pi / 2},
    {"a": -0.24355},
    {"a": -0.2132},
    {"d": 0.13105, "alpha": pi / 2},
    {"d": 0.08535, "alpha": -pi / 2},
    {"d": 0.0921},
)


def test_of_the_papers_arm_it_ends_at_the_centre_of_the_wrist() -> None:
    """Joint 4 rolls the forearm about its own length: the elbow is no end of it."""
    found = forearm(robot_named("paper6").model())
    assert found is not None
    assert (found.link, found.columns, found.words) == ("link4", (0, 1, 2, 3), "end of link4")


def test_of_the_seven_axis_arm_it_ends_at_the_centre_of_the_wrist() -> None:
    found = forearm(robot_named("seven").model())
    assert found is not None and (found.link, len(found.columns)) == ("seven_link5", 5)


def test_of_a_ur_it_ends_where_the_wrist_begins() -> None:
    found = forearm(dh(*UR3E))
    assert found is not None and (found.link, len(found.columns)) == ("link3", 3)


@pytest.mark.real
@pytest.mark.parametrize(
    ("urdf", "joints", "link"),
    [
        ("ur10_robot.urdf", "shoulder_pan shoulder_lift elbow wrist_1 wrist_2 wrist_3", "forearm_link"),
        ("ur3_robot.urdf", "shoulder_pan shoulder_lift elbow wrist_1 wrist_2 wrist_3", "forearm_link"),
        ("panda.urdf", "panda", "panda_link4"),
        ("fr3.urdf", "fr3", "fr3_link4"),
    ],
)
def test_of_described_arms(data_dir: Path, urdf: str, joints: str, link: str) -> None:
    names = [f"{joint}_joint" for joint in joints.split()]
    if len(names) == 1:
        names = [f"{joints}_joint{k}" for k in range(1, 8)]
    robot = build_robot(RobotConfig.of({"urdf": str(data_dir / "urdf" / urdf)}), data_dir, tuple(names))
    found = forearm(robot)
    assert found is not None and found.link == link


def test_an_arm_of_up_to_three_joints_has_no_wrist() -> None:
    assert forearm(dh({"a": 0.4}, {"a": 0.3}, **LEVEL)) is None
    robot = dh({"a": 0.4}, {"a": 0.3}, **LEVEL)
    assert [place.name for place in arm_places(robot, robot.joint_names, None)] == ["link1", "tool"]


# Several arms on one base.

JOINTS = ("torso", "left1", "left2", "right1", "right2")


@pytest.fixture
def two_arms(tmp_path: Path) -> RobotModel:
    """Two arms of two joints each on a torso; links of 1 kg, 0.3 m apart."""
    inertia = '<inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/>'
    parents = {"torso": "base", "left1": "torso", "left2": "left1", "right1": "torso", "right2": "right1"}
    text = '<link name="base_link"/>'
    for joint, parent in parents.items():
        text += (
            f'<link name="{joint}_link"><inertial><mass value="1"/><origin xyz="0.2 0 0"/>{inertia}</inertial></link>'
            f'<joint name="{joint}" type="revolute"><parent link="{parent}_link"/><child link="{joint}_link"/>'
            '<origin xyz="0.3 0 0"/><axis xyz="0 1 0"/><limit lower="-2" upper="2" effort="90" velocity="1"/></joint>'
        )
    (tmp_path / "two.urdf").write_text(f'<robot name="two">{text}</robot>')
    return build_robot(RobotConfig.of({"urdf": "two.urdf"}), tmp_path, JOINTS)


def test_each_arm_has_a_tool_which_its_own_joints_feel(two_arms: RobotModel) -> None:
    places = arm_places(two_arms, JOINTS, None)
    assert [place.name for place in places].count("torso_link") == 1
    tools = {place.name: [two_arms.joint_names[k] for k in place.columns] for place in places if place.kind == "tool"}
    assert tools == {"tool of left2": ["torso", "left1", "left2"], "tool of right2": ["torso", "right1", "right2"]}
    asked = asked_forces(
        PolicyConfig.of({"observable_n": {"tool": 40.0}}), two_arms, places, np.zeros((1, 5)), np.full(5, 90.0)
    )
    assert {name: one.force_n for name, one in asked.items()} == {"tool of left2": 40.0, "tool of right2": 40.0}


@pytest.mark.parametrize("judged", [("left1", "left2"), ("torso", "left1", "left2"), ("left2",)])
def test_an_arm_that_is_not_judged_has_no_places(two_arms: RobotModel, judged: tuple[str, ...]) -> None:
    places = arm_places(two_arms, judged, None)
    assert [place.name for place in places] == ["torso_link", "left1_link", "tool"]
    assert places[-1].columns == tuple(map(two_arms.joint_names.index, ("torso", "left1", "left2")))


# What is asked for there.


def asked(robot: RobotModel, poses: Any, limit_nm: float, **stated: Any) -> dict[str, tuple[float, str]]:
    policy = PolicyConfig.of(stated)
    limits = np.full(len(robot.joint_names), limit_nm)
    places = arm_places(robot, robot.joint_names, None)
    found = asked_forces(policy, robot, places, np.asarray(poses, dtype=float), limits)
    return {place: (one.force_n, one.by) for place, one in found.items()}


BENT = [[0.0, -1.1, 1.4, -1.8, -1.5, 0.0]] * 3


def test_the_defaults_hold_for_an_arm_that_is_strong_enough_or_of_unknown_strength() -> None:
    expected = {"tool": (100.0, "default"), "forearm": (150.0, "default")}
    assert asked(dh(*UR3E), BENT, 300.0) == expected
    assert asked(dh(*UR3E), BENT, np.nan) == expected


def test_half_of_what_a_small_arm_can_exert_is_the_most_that_is_asked() -> None:
    robot = dh({"a": 0.4}, **LEVEL)
    (tool,) = arm_places(robot, robot.joint_names, None)
    strength = exerted_force(robot, tool, np.zeros((3, 1)), np.array([20.0]))
    assert strength == pytest.approx(20.0 / (0.4 * 0.8), rel=0.05), "from 80 % of the directions: |y| up to 0.8"
    assert asked(robot, [[0.0]], 20.0) == {"tool": (31.0, "arm-limits")}


def test_what_is_stated_holds_whatever_the_arm_can_do() -> None:
    robot = dh(*UR3E)
    found = asked(robot, BENT, 1.0, observable_n={"tool": 400.0, "link2": 500.0})
    assert found["tool"] == (400.0, "stated") and found["link2"] == (500.0, "stated")
    assert found["forearm"][1] == "arm-limits", "a place that is not stated keeps its default"


def test_a_place_that_the_arm_lacks_is_an_error() -> None:
    with pytest.raises(ConfigError, match="does not have") as caught:
        asked(dh({"a": 0.4}, **LEVEL), [[0.0]], 20.0, observable_n={"forearm": 100.0})
    assert caught.value.expected == "some of tool"
