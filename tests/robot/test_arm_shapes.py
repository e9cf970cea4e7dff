"""Shapes of links: of the description where it has them, capsules elsewhere, and what is too close."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("coal")

from collaudit.core.config.schema import RobotConfig
from collaudit.core.robot.arm_shapes import ArmShapes, Surroundings
from collaudit.core.robot.robot_building import build_robot

#: Two links in a plane: the second can fold back onto the base's column.
ARM = """<robot name="r"><link name="base"/>
<link name="upper"><inertial><mass value="2"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
{upper}
</link>
<link name="fore"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
{fore}</link><link name="tip"/>
<joint name="a" type="revolute"><parent link="base"/><child link="upper"/><origin xyz="0 0 0.5"/><axis xyz="0 1 0"/>
<limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
<joint name="b" type="revolute"><parent link="upper"/><child link="fore"/><origin xyz="0.5 0 0"/><axis xyz="0 1 0"/>
<limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
<joint name="c" type="fixed"><parent link="fore"/><child link="tip"/><origin xyz="0.5 0 0"/></joint></robot>"""
STL = "solid s\n" + "".join(
    "facet normal 0 0 0\nouter loop\n" + "".join(f"vertex {x} {y} {z}\n" for x, y, z in face) + "endloop\nendfacet\n"
    for face in (
        ((0, 0, 0), (0.4, 0, 0), (0, 0.1, 0)), ((0, 0, 0), (0.4, 0, 0), (0, 0, 0.3)),
        ((0, 0, 0), (0, 0.1, 0), (0, 0, 0.3)), ((0.4, 0, 0), (0, 0.1, 0), (0, 0, 0.3)),
    )
) + "endsolid s\n"  # fmt: skip


def shapes(folder: Path, upper: str = "", fore: str = "", table_z_m: float = -1.0) -> ArmShapes:
    path = folder / "arm.urdf"
    path.write_text(ARM.format(upper=upper, fore=fore))
    robot = build_robot(RobotConfig.of({"urdf": "arm.urdf"}), folder, ["a", "b"])
    return ArmShapes(robot, Surroundings(0.01, table_z_m), path)


def test_a_capsule_weighs_what_its_link_does_in_water(tmp_path: Path) -> None:
    made = shapes(tmp_path)
    r = made.capsules["a"]
    assert np.pi * r**2 * (0.5 + 4 / 3 * r) * 1000 == pytest.approx(2.0)
    assert made.touching(np.zeros((3, 2))) is None
    folded = made.touching(np.array([[0.0, 0.0], [0.0, 3.0]]))  # back along the upper link, to the base's column
    assert folded == (1, "the base and the link of b")


def test_the_table_is_seen(tmp_path: Path) -> None:
    made = shapes(tmp_path, table_z_m=0.0)
    assert made.touching(np.array([[0.3, 0.0]])) is None
    found = made.touching(np.array([[0.3, 1.2]]))
    assert found is not None and "the table" in found[1]


def test_shapes_of_the_description_are_used(tmp_path: Path) -> None:
    box = '<collision><geometry><box size="0.4 0.02 0.6"/></geometry><origin xyz="0.2 0 0"/></collision>'
    assert shapes(tmp_path).touching(np.array([[0.0, 0.0]])) is None
    made = shapes(tmp_path, fore=box, table_z_m=0.25)  # the box hangs 0.3 m below its link's axis
    assert made.described == ("fore",)
    assert "b" not in made.capsules
    assert made.touching(np.array([[0.0, 0.0]])) is not None


def test_meshes_are_read_where_their_files_are(tmp_path: Path) -> None:
    mesh = '<collision><geometry><mesh filename="package://{}/m.stl"/></geometry></collision>'
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "m.stl").write_text(STL)
    found, lost = (shapes(tmp_path, fore=mesh.format(place), table_z_m=-5.0) for place in ("parts", "elsewhere"))
    assert (found.described, lost.described) == (("fore",), ())
    assert "b" in lost.capsules
    low = shapes(tmp_path, fore=mesh.format("parts"), table_z_m=0.25)
    assert low.touching(np.array([[0.0, 0.0]])) is None
    turned = low.touching(np.array([[0.0, 1.57]]))  # 0.4 m of it point down
    assert turned is not None and turned[1] == "fore and the table"
