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
from collaudit.core.robot.robot_building import build_robot
from collaudit.core.robot.robot_model import RobotModel
from collaudit.core.verdict.arm_places import Place, arm_places, asked_forces, exerted_force
from collaudit.fixtures.robots.robot_registry import robot_named


def dh(*rows: dict[str, float], convention: str = "standard", **keys: Any) -> RobotModel:
    made = [dh_row(1.0, (0, 0, 0), (0.01, 0.01, 0.01), **row) for row in rows]
    config = Config.of({"robot": dh_robot(made, convention, **keys)})
    return build_robot(config.robot, Path(), tuple(f"joint{k + 1}" for k in range(len(rows))))


def forearm(robot: RobotModel) -> Place | None:
    found = [place for place in arm_places(robot, None) if place.name == "forearm"]
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
    assert (found.link, found.joints, found.words) == ("link4", 4, "end of link4")


def test_of_the_seven_axis_arm_it_ends_at_the_centre_of_the_wrist() -> None:
    found = forearm(robot_named("seven").model())
    assert found is not None and (found.link, found.joints) == ("seven_link5", 5)


def test_of_a_ur_it_ends_where_the_wrist_begins() -> None:
    found = forearm(dh(*UR3E))
    assert found is not None and (found.link, found.joints) == ("link3", 3)


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
    assert [place.name for place in arm_places(dh({"a": 0.4}, {"a": 0.3}, **LEVEL), None)] == ["link1", "tool"]


# What is asked for there.


def asked(robot: RobotModel, poses: Any, limit_nm: float, **stated: Any) -> dict[str, tuple[float, str]]:
    policy = PolicyConfig.of(stated)
    limits = np.full(len(robot.joint_names), limit_nm)
    found = asked_forces(policy, robot, arm_places(robot, None), np.asarray(poses, dtype=float), limits)
    return {place: (one.force_n, one.by) for place, one in found.items()}


BENT = [[0.0, -1.1, 1.4, -1.8, -1.5, 0.0]] * 3


def test_the_defaults_hold_for_an_arm_that_is_strong_enough_or_of_unknown_strength() -> None:
    expected = {"tool": (100.0, "default"), "forearm": (150.0, "default")}
    assert asked(dh(*UR3E), BENT, 300.0) == expected
    assert asked(dh(*UR3E), BENT, np.nan) == expected


def test_half_of_what_a_small_arm_can_exert_is_the_most_that_is_asked() -> None:
    robot = dh({"a": 0.4}, **LEVEL)
    (tool,) = arm_places(robot, None)
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
