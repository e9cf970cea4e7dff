"""Pose and speeds at a contact against a planar arm whose kinematics are known."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from arms import dh_robot, dh_row

from collaudit.core.config.schema import RobotConfig
from collaudit.core.contacts.contact_scene import arm_geometry, scene_at, stick_frames
from collaudit.core.data.signals import arm_at
from collaudit.core.robot.robot_building import build_robot

LENGTHS = (0.4, 0.3)


def planar(
    tmp_path: Path, q: list[float], v: list[float], judged: tuple[str, ...] = ("joint1", "joint2")
) -> SimpleNamespace:
    rows = [dh_row(1.0, (-0.1, 0, 0), (0.01,) * 3 + (0, 0, 0), a=a) for a in LENGTHS]
    robot = build_robot(RobotConfig.of(dh_robot(rows)), tmp_path, ("joint1", "joint2"))
    series = SimpleNamespace(position_rad=np.array([q]), velocity_rad_s=np.array([v]), time_s=np.array([7.5]))
    columns = [robot.joint_names.index(joint) for joint in judged]
    return SimpleNamespace(robot=robot, series=series, judged=judged, columns=lambda: columns)


def test_the_stick_figure_of_a_planar_arm(tmp_path: Path) -> None:
    q, v = [0.3, 0.9], [0.5, -0.8]
    log = planar(tmp_path, q, v)
    scene = scene_at(log, 0, stick_frames(log.robot, None))
    assert scene is not None
    elbow = LENGTHS[0] * np.array([np.cos(0.3), np.sin(0.3)])
    tool = elbow + LENGTHS[1] * np.array([np.cos(1.2), np.sin(1.2)])
    points = np.array(scene.points_m)[:, :2]
    np.testing.assert_allclose(points, [(0, 0), elbow, tool], atol=1e-9)
    turn = np.array([[0, -1], [1, 0]])
    speed = 0.5 * turn @ tool - 0.8 * turn @ (tool - elbow)
    assert scene.tool_speed_m_s == pytest.approx(np.linalg.norm(speed), rel=1e-6)
    assert scene.joint_speed_rad_s == {"joint1": 0.5, "joint2": -0.8}
    assert scene.time_s == 7.5


def test_what_is_not_known_is_not_made_up(tmp_path: Path) -> None:
    log = planar(tmp_path, [0.3, np.nan], [0.0, 0.0])
    frames = stick_frames(log.robot, None)
    assert scene_at(log, 0, frames) is None
    assert scene_at(planar(tmp_path, [0.3, 0.1], [0.2, 0.0]), 0, []) is None
    unknown = scene_at(planar(tmp_path, [0.3, 0.1], [0.2, np.nan], ("joint2",)), 0, frames)
    assert unknown is not None
    assert unknown.tool_speed_m_s is None
    assert unknown.joint_speed_rad_s == {"joint2": None}


SLIDING = """<robot name="r"><link name="base"/><link name="a"/><link name="b"/><link name="c"/><link name="tip"/>
<joint name="lift" type="prismatic"><parent link="base"/><child link="a"/><origin xyz="0.1 0 0.2" rpy="0.2 0 0.4"/>
<axis xyz="0 1 1"/><limit lower="0" upper="1" effort="9" velocity="1"/></joint>
<joint name="turn" type="revolute"><parent link="a"/><child link="b"/><origin xyz="0 0.3 0" rpy="1.1 0.3 0"/>
<axis xyz="1 0 0"/><limit lower="-3" upper="3" effort="9" velocity="1"/></joint>
<joint name="half" type="revolute"><parent link="b"/><child link="c"/><origin xyz="0 0 0.4"/><axis xyz="0 -1 0"/>
<mimic joint="turn" multiplier="0.5" offset="0.1"/><limit lower="-3" upper="3" effort="9" velocity="1"/></joint>
<joint name="fix" type="fixed"><parent link="c"/><child link="tip"/><origin xyz="0.2 0 0.1"/></joint></robot>"""


def test_drawn_kinematics_are_those_of_the_model(tmp_path: Path) -> None:
    """A slide along a slanted axis, a turn, and a joint that follows another, against Pinocchio's frames."""
    (tmp_path / "r.urdf").write_text(SLIDING)
    robot = build_robot(RobotConfig.of({"urdf": "r.urdf"}), tmp_path, ("lift", "turn"))
    log = SimpleNamespace(robot=robot, judged=("lift", "turn"))
    arm = arm_geometry(log, "tip")
    assert arm is not None and [link.joint for link in arm.links] == ["lift", "turn", "turn"]
    q = np.array([0.37, -0.8])
    points, axes = arm_at(arm, {"lift": q[0], "turn": q[1]})
    np.testing.assert_allclose(points, robot.frame_positions(q, ["lift", "turn", "half", "tip"]), atol=1e-9)
    later = robot.frame_positions(q + np.array([0.1, 0.0]), ["turn"])[0]
    np.testing.assert_allclose(axes[0], (later - points[1]) / 0.1, atol=1e-9)
    assert arm_geometry(SimpleNamespace(robot=robot, judged=("turn",)), "tip") is None, (
        "the lift's position is not kept"
    )
