"""Standard and modified DH rows, prismatic joints, mimicking and continuous joints."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from arms import dh_robot
from movable_joints import movable_joints

from collaudit.core.config.schema import RobotConfig
from collaudit.core.robot.robot_building import build_robot
from collaudit.core.robot.robot_model import RobotModel

HERE = Path()
STANDARD = [
    (0.32, 0.05, -math.pi / 2, 0.1),
    (0.0, 0.27, 0.0, -0.4),
    (0.0, 0.07, -math.pi / 2, 0.0),
    (0.3, 0.0, 0.0, 0.0),
]
INERTIAL = {"mass_kg": 2.0, "com_m": (0.01, 0.02, -0.03), "inertia_kg_m2": (0.02, 0.03, 0.04, 0.001, -0.002, 0.003)}


def rows_standard() -> list[dict[str, Any]]:
    return [{"d": d, "a": a, "alpha": alpha, "theta_offset": offset, **INERTIAL} for d, a, alpha, offset in STANDARD]


def rows_modified() -> list[dict[str, Any]]:
    """The same arm: the length and twist of a row move to the next row, the link frames change."""
    before = [(0.0, 0.0)] + [(a, alpha) for _, a, alpha, _ in STANDARD[:-1]]
    out = []
    for (a, alpha), (d, own_a, own_alpha, offset) in zip(before, STANDARD, strict=True):
        # the standard link frame seen from the modified one: Tx(own_a) Rx(own_alpha)
        turn = pin.utils.rotate("x", own_alpha)
        xx, yy, zz, xy, yz, xz = INERTIAL["inertia_kg_m2"]
        inertia = turn @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ turn.T
        com = turn @ np.array(INERTIAL["com_m"]) + [own_a, 0, 0]
        six = [inertia[i, j] for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2))]
        row = {"d": d, "a": a, "alpha": alpha, "theta_offset": offset}
        out.append({**row, "mass_kg": 2.0, "com_m": com.tolist(), "inertia_kg_m2": [float(x) for x in six]})
    return out


def load(rows: list[dict[str, Any]], convention: str) -> RobotModel:
    config = RobotConfig.of(dh_robot(rows, convention))
    return build_robot(config, HERE, movable_joints(config, HERE))


def test_standard_and_modified_rows_of_one_arm_agree() -> None:
    standard, modified = load(rows_standard(), "standard"), load(rows_modified(), "modified")
    q, v, a = np.random.default_rng(2).uniform(-2, 2, (3, 50, 4))
    np.testing.assert_allclose(standard.inverse_dynamics(q, v, a), modified.inverse_dynamics(q, v, a), atol=1e-12)
    assert standard.sha256 != modified.sha256


def test_standard_rows_place_the_last_frame_as_the_formula_says() -> None:
    robot = load(rows_standard(), "standard")
    q = np.array([0.3, -0.5, 0.9, 0.2])
    pose = np.eye(4)
    for (d, a, alpha, offset), angle in zip(STANDARD, q, strict=True):
        c, s, ca, sa = math.cos(angle + offset), math.sin(angle + offset), math.cos(alpha), math.sin(alpha)
        pose = pose @ [[c, -s * ca, s * sa, a * c], [s, c * ca, -c * sa, a * s], [0, sa, ca, d], [0, 0, 0, 1]]
    assert robot.bodies is not None
    forward = robot.bodies.forward()
    rotation, position, _ = forward.at(forward.arm.frame_number("tool0"), q, np.zeros(3))
    np.testing.assert_allclose(rotation, pose[:3, :3], atol=1e-12)
    np.testing.assert_allclose(position, pose[:3, 3], atol=1e-12)


def test_a_prismatic_row_lifts_its_mass() -> None:
    rows = [{"joint": "prismatic", "d": 0.2, "mass_kg": 4.0}]
    robot = load(rows, "standard")
    assert robot.joint_types == ("prismatic",)
    one = np.array([[2.0]])
    np.testing.assert_allclose(robot.inverse_dynamics(0 * one, 0 * one, one), [[4.0 * (9.80665 + 2.0)]])


FINGERS = """<robot name="gripper"><link name="base"/>
<link name="wheel"><inertial><mass value="1"/><origin xyz="0.2 0 0"/>
  <inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="left"><inertial><mass value="0.5"/>
  <inertia ixx="1e-4" iyy="1e-4" izz="1e-4" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="right"><inertial><mass value="0.5"/>
  <inertia ixx="1e-4" iyy="1e-4" izz="1e-4" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="turn" type="continuous"><parent link="base"/><child link="wheel"/><axis xyz="0 1 0"/></joint>
<joint name="finger" type="prismatic"><parent link="wheel"/><child link="left"/><axis xyz="0 0 1"/>
  <limit lower="0" upper="0.04" effort="20" velocity="1"/></joint>
<joint name="other" type="prismatic"><parent link="wheel"/><child link="right"/><axis xyz="0 0 -1"/>
  <limit lower="0" upper="0.04" effort="20" velocity="1"/><mimic joint="finger" multiplier="2" offset="0.01"/></joint>
</robot>"""


@pytest.fixture
def gripper(tmp_path: Path) -> RobotModel:
    (tmp_path / "g.urdf").write_text(FINGERS)
    config = RobotConfig(urdf=Path("g.urdf"), joints=["turn", "finger"])
    assert movable_joints(config, tmp_path) == ("turn", "finger")
    return build_robot(config, tmp_path, ["finger", "turn"])


@pytest.mark.parametrize(("joints", "judged"), [(None, ("turn",)), (["turn", "finger"], ("turn", "finger"))])
def test_a_gripper_is_judged_only_if_it_is_named(
    tmp_path: Path, joints: list[str] | None, judged: tuple[str, ...]
) -> None:
    """Its fingers are held where they are; the link that carries them ends the arm, and bears the tool."""
    (tmp_path / "g.urdf").write_text(FINGERS)
    robot = build_robot(RobotConfig(urdf=Path("g.urdf"), joints=joints), tmp_path, ["finger", "turn"])
    assert robot.joint_names == judged
    told = ["those of a gripper: finger" in finding.text and finding.excludes for finding in robot.findings]
    assert told == [True] * (joints is None)


def test_what_follows_a_parked_joint_is_parked_with_it(gripper: RobotModel, tmp_path: Path) -> None:
    config = RobotConfig(urdf=Path("g.urdf"), joints=["turn"], parked={"finger": 0.03})
    parked = build_robot(config, tmp_path, ["turn"])
    ends = ["left", "right"]
    expected = gripper.frame_positions(np.array([0.4, 0.03]), ends)
    np.testing.assert_allclose(parked.frame_positions(np.array([0.4]), ends), expected, atol=1e-12)
    assert not any("held at zero" in finding.text for finding in parked.findings)


def test_a_log_of_a_gripper_alone_is_judged(tmp_path: Path) -> None:
    (tmp_path / "g.urdf").write_text(FINGERS.replace('name="turn"', 'name="gripper_turn"'))
    robot = build_robot(RobotConfig(urdf=Path("g.urdf")), tmp_path, ["gripper_turn", "finger"])
    assert robot.joint_names == ("gripper_turn", "finger")


def test_continuous_joints_have_one_position(gripper: RobotModel) -> None:
    """Turned by q about y, the wheel's mass at 0.2 m sinks by 0.2 sin q: torque -m g 0.2 cos q (fingers at rest)."""
    q = np.array([[0.4, 0.0], [7.0, 0.0]])
    fingers = 0.5 * 9.80665 * (0.0 - 0.01) * np.sin(q[:, 0])
    expected = -1.0 * 9.80665 * 0.2 * np.cos(q[:, 0]) - fingers
    np.testing.assert_allclose(gripper.gravity_torque(q)[:, 0], expected, atol=1e-12)
    assert np.isnan(gripper.position_limits[0]).all()
    assert gripper.effort_limit_nm[1] == 20


def test_mimicking_joints_follow_and_load_their_leader(gripper: RobotModel) -> None:
    """One finger slides up by x, the other down by 2x: the leader feels (m_l - 2 m_r) g, and moves m_l + 4 m_r."""
    zero = np.zeros((1, 2))
    push = np.array([[0.0, 1.0]])
    gravity = gripper.gravity_torque(zero)[0, 1]
    assert gravity == pytest.approx((0.5 - 2 * 0.5) * 9.80665)
    assert gripper.inverse_dynamics(zero, zero, push)[0, 1] - gravity == pytest.approx(0.5 + 4 * 0.5)
