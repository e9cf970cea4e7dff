"""``collaudit fit --urdf-out``: written beside the friction, refused before the fit where it cannot be."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from collaudit.core.robot.urdf_file import read_urdf


def test_a_robot_of_rows_is_refused(arm: Any, collaudit: Any, tmp_path: Path) -> None:
    run = collaudit("fit", arm.clean, "-c", arm.config, "--urdf-out", tmp_path / "x.urdf")
    assert run.code == 2 and "described by a URDF" in run.err
    assert not (tmp_path / "x.urdf").exists()


URDF = """<robot name="two"><link name="base"/>
<link name="upper"><inertial><origin xyz="0.2 0 0"/><mass value="4"/>
  <inertia ixx="0.01" iyy="0.06" izz="0.06" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="lower"><inertial><origin xyz="0.15 0 0"/><mass value="2"/>
  <inertia ixx="0.01" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="joint1" type="continuous"><parent link="base"/><child link="upper"/><axis xyz="0 0 1"/></joint>
<joint name="joint2" type="continuous"><parent link="upper"/><child link="lower"/><origin xyz="0.4 0 0"/>
  <axis xyz="0 1 0"/></joint></robot>
"""


@pytest.mark.parametrize("same", [False, True])
def test_it_is_written_and_never_over_the_description(same: bool, arm: Any, collaudit: Any, tmp_path: Path) -> None:
    (tmp_path / "two.urdf").write_text(URDF)
    settings = arm.config.read_text()
    columns = settings[settings.index("[log.csv]") :]
    config = tmp_path / "two.toml"
    config.write_text(f'[robot]\nurdf = "two.urdf"\nbase_rpy_deg = [90, 0, 0]\n{columns}')
    target = tmp_path / ("two.urdf" if same else "fitted.urdf")
    run = collaudit("fit", arm.clean, "-c", config, "-o", tmp_path / "f.json", "--urdf-out", target)
    if same:
        assert run.code == 2 and (tmp_path / "two.urdf").read_text() == URDF
        return
    assert run.code == 0, run.err
    joints, _ = read_urdf(target.read_bytes(), "fitted.urdf")
    assert [joint.name for joint in joints] == ["joint1", "joint2"]
    assert b"<dynamics" in target.read_bytes() and "description written to" in run.err
