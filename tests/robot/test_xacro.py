"""Descriptions written as xacro."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from collaudit.core.config.schema import RobotConfig
from collaudit.core.errors import RobotError
from collaudit.core.robot.robot_description import describe_robot

LINK = """<robot xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:macro name="part" params="name mass">
<link name="${name}"><inertial><mass value="${2*mass}"/><origin xyz="0 0 0.1"/>
<inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link></xacro:macro></robot>"""
ARM = """<robot name="arm" xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:include filename="{include}"/>
<link name="base"/><xacro:part name="upper" mass="1.5"/>
<joint name="lift" type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 1 0"/>
<limit lower="-1" upper="1" velocity="1" effort="10"/></joint></robot>"""


def arm(folder: Path, include: str = "part.xacro") -> RobotConfig:
    (folder / "part.xacro").write_text(LINK, encoding="utf-8")
    (folder / "arm.urdf.xacro").write_text(ARM.format(include=include), encoding="utf-8")
    return RobotConfig.of({"urdf": str(folder / "arm.urdf.xacro")})


def test_a_xacro_is_expanded_with_what_it_includes(tmp_path: Path) -> None:
    pytest.importorskip("xacrodoc")
    robot = describe_robot(arm(tmp_path), tmp_path)
    assert robot is not None
    assert robot.movable == ("lift",)
    assert robot.urdf_xml is not None
    assert 'value="3.0"' in robot.urdf_xml
    (tmp_path / "part.xacro").write_text(LINK.replace("2*mass", "4*mass"), encoding="utf-8")
    other = describe_robot(RobotConfig.of({"urdf": str(tmp_path / "arm.urdf.xacro")}), tmp_path)
    assert other is not None
    assert other.content_sha256 != robot.content_sha256, "the hash is of what the arm is, included files too"


def test_faults_are_one_message(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("xacrodoc")
    with pytest.raises(RobotError, match="cannot be expanded"):
        describe_robot(arm(tmp_path, "absent.xacro"), tmp_path)
    monkeypatch.setitem(sys.modules, "xacrodoc", None)
    with pytest.raises(RobotError, match="unexpanded xacro") as caught:
        describe_robot(arm(tmp_path), tmp_path)
    assert "collaudit[xacro]" in str(caught.value.hint)
