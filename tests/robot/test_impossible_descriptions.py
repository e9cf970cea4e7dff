"""Robot descriptions whose numbers no arm has are refused, naming joint or link; many joints take no square of time."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import pytest

from collaudit.core.config.schema import RobotConfig
from collaudit.core.errors import RobotError
from collaudit.core.robot.robot_building import build_robot

LINK = (
    '<link name="{name}"><inertial><origin xyz="0 0 0.1"/><mass value="2"/>'
    '<inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>'
)
JOINT = (
    '<joint name="j{i}" type="revolute"><parent link="{parent}"/><child link="l{i}"/><origin xyz="0 0 0.3"/>'
    '<axis xyz="0 1 0"/><limit lower="-3" upper="3" effort="50" velocity="2"/></joint>'
)


def urdf(folder: Path, joints: int = 2, *changes: tuple[str, str]) -> RobotConfig:
    parts = ['<robot name="r"><link name="base"/>']
    for i in range(joints):
        parts += [LINK.format(name=f"l{i}"), JOINT.format(i=i, parent=f"l{i - 1}" if i % 50 else "base")]
    text = "\n".join(parts) + "</robot>"
    for old, new in changes:
        assert old in text
        text = text.replace(old, new, 1)
    path = folder / "arm.urdf"
    path.write_text(text)
    return RobotConfig(urdf=path)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('mass value="2"', 'mass value="1e308"', "beyond what an arm can have"),
        ('mass value="2"', 'mass value="nan"', "finite number"),
        ('mass value="2"', 'mass value="inf"', "finite number"),
        ('mass value="2"', 'mass value="-2"', "negative"),
        ('mass value="2"', 'mass value="two"', "finite number"),
        ('ixx="0.1"', 'ixx="nan"', "finite number"),
        ('izz="0.1"', 'izz="1e30"', "beyond what an arm can have"),
        ('axis xyz="0 1 0"', 'axis xyz="0 0 0"', "no direction"),
        ('axis xyz="0 1 0"', 'axis xyz="nan 1 0"', "finite numbers"),
        ('axis xyz="0 1 0"', 'axis xyz="0 1"', "3 finite numbers"),
        ('origin xyz="0 0 0.3"', 'origin xyz="0 0 300"', "beyond what an arm can have"),
        ('origin xyz="0 0 0.3"', 'origin xyz="0 inf 0"', "finite numbers"),
        ('origin xyz="0 0 0.1"', 'origin xyz="0 -300 0"', "beyond what an arm can have"),
        ('lower="-3" upper="3"', 'lower="3" upper="-3"', "swapped"),
        ('lower="-3"', 'lower="nan"', "finite number"),
        ('effort="50"', 'effort="1e999"', "finite number"),
    ],
)
def test_numbers_that_no_arm_has(old: str, new: str, words: str, tmp_path: Path) -> None:
    config = urdf(tmp_path, 2, (old, new))
    with pytest.raises(RobotError, match=words) as caught:
        build_robot(config, Path(), ["j0", "j1"])
    assert "arm.urdf" in str(caught.value.render())


@pytest.mark.parametrize("row", [{"a": 300.0}, {"d": -60.0}, {"mass_kg": 1e12}, {"mass_kg": 1.0, "com_m": [0, 99, 0]}])
def test_rows_that_no_arm_has(row: dict[str, object]) -> None:
    config = RobotConfig.of({"dh_convention": "standard", "dh": [row]})
    with pytest.raises(RobotError, match="beyond what an arm can have"):
        build_robot(config, Path(), ["joint1"])


def test_three_thousand_joints_are_looked_up_as_quickly_as_thirty(tmp_path: Path) -> None:
    """As a ratio a joint, XML and Pinocchio included: with a search of all joints for each it was 30 and more."""

    def seconds_a_joint(joints: int, repeats: int) -> float:
        config = urdf(tmp_path, joints)
        took = []
        for _ in range(repeats):
            start = time.process_time()
            build_robot(config, Path(), ["j0", "j1", "j2"])
            took.append(time.process_time() - start)
        return min(took) / joints

    seconds_a_joint(30, 1)  # imports
    assert seconds_a_joint(3000, 2) < 10 * seconds_a_joint(30, 20)


def test_a_fixed_joint_needs_no_axis(tmp_path: Path) -> None:
    """Robots in the field have ``<axis xyz="0 0 0"/>`` there; only what moves needs a direction."""
    flange = (
        f'{LINK.format(name="flange")}<joint name="mount" type="fixed"><parent link="l1"/><child link="flange"/>'
        '<axis xyz="0 0 0"/></joint></robot>'
    )
    robot = build_robot(urdf(tmp_path, 2, ("</robot>", flange)), Path(), ["j0", "j1"])
    assert robot.joint_names == ("j0", "j1")


def test_a_fixed_joint_may_have_the_name_of_its_link(tmp_path: Path) -> None:
    """Links and joints have names of their own kind; as a frame the link is meant."""
    fixed = '<joint name="hand" type="fixed"><parent link="l1"/><child link="hand"/><origin xyz="0 0 0.2"/></joint>'
    config = urdf(tmp_path, 2, ("</robot>", f'<link name="hand"/>{fixed}</robot>'))
    robot = build_robot(config, tmp_path, ["j0", "j1"])
    assert robot.wrench_torque(np.zeros((1, 2)), np.array([[1.0, 0, 0, 0, 0, 0]]), "hand") == pytest.approx(
        np.array([[0.5, 0.2]]), abs=1e-9
    )
