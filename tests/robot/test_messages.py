"""What a user is told when a robot description cannot be used, or only in part."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from collaudit.core.config.schema import RobotConfig
from collaudit.core.errors import ConfigError, NotJudgedError, RobotError
from collaudit.core.robot.robot_building import build_robot
from collaudit.core.robot.robot_description import describe_robot

LINK = (
    "<link name='{0}'><inertial><mass value='{1}'/>"
    "<inertia ixx='1' iyy='1' izz='1' ixy='0' ixz='0' iyz='0'/></inertial></link>"
)
JOINT = "<joint name='{0}' type='{3}'><parent link='{1}'/><child link='{2}'/><axis xyz='0 1 0'/></joint>"


def arm(masses: tuple[float, ...] = (1.0, 1.0), kind: str = "revolute") -> str:
    links = "".join(LINK.format(f"l{i}", m) if m else f"<link name='l{i}'/>" for i, m in enumerate(masses, 1))
    joints = "".join(JOINT.format(f"j{i}", f"l{i - 1}", f"l{i}", kind) for i in range(1, len(masses) + 1))
    return f"<robot name='r'>\n<link name='l0'/>{links}\n{joints}</robot>"


def load(tmp_path: Path, text: str | bytes, joints: Any = ("j1", "j2"), **settings: Any) -> Any:
    (tmp_path / "arm.urdf").write_bytes(text if isinstance(text, bytes) else text.encode())
    return build_robot(RobotConfig.of({"urdf": "arm.urdf", **settings}), tmp_path, joints)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("<robot name='r'>\n<link name='a'>\n</robot>", "arm.urdf:3:3: the robot description is not well-formed XML"),
        ("hello", "arm.urdf:1:1: the robot description is not well-formed XML"),
        ("", "not well-formed XML"),
        (b"\x89PNG\r\n\x1a\n\x00\x00", "not well-formed XML"),
        ("<sdf/>", "expected: <robot>"),
        ("<robot xmlns:xacro='http://ros.org/wiki/xacro'><xacro:include/></robot>", "xacro"),
        ("<robot name='r'/>", "no links"),
        (arm(kind="floating"), "found:    floating"),
        (arm().replace("child link='l2'", "child link='l9'"), "found:    l9"),
        (arm().replace("<axis xyz='0 1 0'/>", "<limit lower='x'/>"), "lower is not a finite number"),
        (arm().replace("name='j2'", "name='j1'"), "two joints have the same name"),
        (arm().replace("<link name='l0'/>", "<link name='l0'/><link name='stray'/>"), "do not form one tree"),
    ],
)
def test_a_description_that_cannot_be_used(tmp_path: Path, text: str | bytes, expected: str) -> None:
    with pytest.raises(RobotError) as caught:
        load(tmp_path, text)
    assert expected in str(caught.value)


def test_a_missing_file_is_named_as_configured(tmp_path: Path) -> None:
    with pytest.raises(RobotError, match=r"arms/none\.urdf: the robot description cannot be read"):
        describe_robot(RobotConfig(urdf=Path("arms/none.urdf")), tmp_path)


def test_unknown_names_are_answered_with_the_known_ones(tmp_path: Path) -> None:
    with pytest.raises(RobotError, match="one of j1, j2"):
        load(tmp_path, arm(), ["j1", "elbow"])
    with pytest.raises(RobotError, match=r"robot\.joints"):
        config = RobotConfig.of({"urdf": "arm.urdf", "joints": ["j1", "j3"]})
        build_robot(config, tmp_path, ["j1"])
    with pytest.raises(RobotError, match=r"robot\.tool\.frame"):
        load(tmp_path, arm(), tool={"frame": "tcp", "mass_kg": 1})
    with pytest.raises(ConfigError, match=r"\[robot\] armature_kg_m2"):
        load(tmp_path, arm(), armature_kg_m2={"j9": 1.0})
    with pytest.raises(ConfigError, match="3 values"):
        load(tmp_path, arm(), armature_kg_m2=[1.0, 2.0, 3.0])


def test_links_without_mass_are_named(tmp_path: Path) -> None:
    robot = load(tmp_path, arm((1.0, 0.0)))
    assert robot.has_inertials
    assert robot.weightless == {"j2": ("j1", "j2")}
    assert not load(tmp_path, arm((1.0, 0.0)), tool={"mass_kg": 0.5}).weightless, "the tool is its mass"


def test_no_masses_at_all(tmp_path: Path) -> None:
    robot = load(tmp_path, arm((0.0, 0.0)), tool={"mass_kg": 1.0})
    assert not robot.has_inertials and robot.findings[0].code == "model-approximate"
    with pytest.raises(NotJudgedError, match="no inertials"):
        robot.gravity_torque(np.zeros((1, 2)))
    assert robot.wrench_torque(np.zeros((1, 2)), np.zeros((1, 6)), "l2").shape == (1, 2)


def test_impossible_inertia_is_said(tmp_path: Path) -> None:
    robot = load(tmp_path, arm().replace("ixx='1'", "ixx='9'", 1))
    assert any("No rigid body" in f.text and "l1" in f.text for f in robot.findings)


def test_a_tool_to_be_estimated_is_left_out_and_said(tmp_path: Path) -> None:
    robot = load(tmp_path, arm(), tool={"mass_kg": "estimate"})
    assert robot.tool is None and "estimate" in robot.findings[0].text
    np.testing.assert_array_equal(robot.tool_wrench(np.zeros((2, 2)), "l2"), np.zeros((2, 6)))


def test_the_model_hash_is_free_of_paths(tmp_path: Path) -> None:
    for folder in ("a", "b"):
        (tmp_path / folder).mkdir()
    first, second = load(tmp_path / "a", arm()), load(tmp_path / "b", arm())
    assert first.sha256 == second.sha256
    assert first.sha256 != load(tmp_path / "a", arm((1.0, 2.0))).sha256
    assert first.sha256 != load(tmp_path / "a", arm(), base_rpy_deg=(0, 0, 1)).sha256


def test_holding_a_heavy_joint_warns_and_a_light_one_informs(tmp_path: Path) -> None:
    for mass, severity in ((1.0, "warning"), (0.05, "info")):
        (finding,) = load(tmp_path, arm((1.0, mass)), joints=["j1"]).findings
        assert (finding.code, finding.severity) == ("model-joint-missing", severity)


def test_a_tool_in_grams_is_refused(tmp_path: Path) -> None:
    assert load(tmp_path, arm(), tool={"mass_kg": 0.7}).has_inertials
    with pytest.raises(RobotError, match="heavier than the whole robot") as refused:
        load(tmp_path, arm(), tool={"mass_kg": 700})
    assert "g" in (refused.value.hint or "")


def test_the_other_arm_of_two_is_on_no_chain_of_the_first(tmp_path: Path) -> None:
    tree = {"torso": ("l0", "l1"), "left1": ("l1", "l2"), "left2": ("l2", "l3"), "right": ("l1", "l4")}
    text = "<link name='l0'/>" + "".join(LINK.format(f"l{k}", 1.0) for k in range(1, 5))
    text += "".join(JOINT.format(name, *ends, "revolute") for name, ends in tree.items())
    bodies = load(tmp_path, f"<robot name='r'>{text}</robot>", tuple(tree)).bodies
    assert bodies.on_chain(["torso", "left2", "right"], ["left1"]) == ["torso", "left2"]
    assert bodies.sides("left1", ["torso", "left2"]) == (True, True)
    assert bodies.sides("right", ["torso", "left2"]) == (True, False)
    assert bodies.sides("right", ["left1"]) == (False, False)


def test_a_joint_that_the_log_lacks_is_an_exclusion_on_the_chain_of_judged_ones_only(tmp_path: Path) -> None:
    tree = {"torso": ("l0", "l1"), "left1": ("l1", "l2"), "left2": ("l2", "l3"), "right": ("l1", "l4")}
    text = "<link name='l0'/>" + "".join(LINK.format(f"l{k}", 1.0) for k in range(1, 5))
    text += "".join(JOINT.format(name, *ends, "revolute") for name, ends in tree.items())
    for joints, excluded in ((("torso", "left1", "left2"), True), (("left1", "left2"), True), (("left1",), True)):
        (finding,) = load(tmp_path, f"<robot name='r'>{text}</robot>", joints).findings
        assert finding.code == "model-joint-missing" and finding.excludes is excluded
    parked = {"torso": 0.3}
    (finding,) = load(tmp_path, f"<robot name='r'>{text}</robot>", ("left1", "left2"), parked=parked).findings
    assert not finding.excludes, "the other arm is held, and the torso was stated"
