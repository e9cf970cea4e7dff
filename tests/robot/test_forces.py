"""J(q)^T F against Pinocchio's frame Jacobians, on every kind of frame, for real arms too."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from movable_joints import movable_joints

from collaudit.core.config.schema import RobotConfig
from collaudit.core.errors import NotJudgedError, RobotError
from collaudit.core.robot.robot_building import build_robot

SKEWED = """<robot name="skewed"><link name="base"/><link name="a"/><link name="b"/><link name="c"/><link name="tip"/>
<joint name="j1" type="revolute"><parent link="base"/><child link="a"/><origin xyz="0.1 0.2 0.3" rpy="0.4 -0.2 1"/>
  <axis xyz="0.6 0 0.8"/><limit lower="-3" upper="3" effort="9" velocity="1"/></joint>
<joint name="j2" type="prismatic"><parent link="a"/><child link="b"/><origin xyz="0 0.2 0.1" rpy="1 0 0"/>
  <axis xyz="0 0.6 -0.8"/><limit lower="-3" upper="3" effort="9" velocity="1"/></joint>
<joint name="j3" type="continuous"><parent link="b"/><child link="c"/><origin xyz="0.3 0 0" rpy="0 1 0"/>
  <axis xyz="-1 0 0"/></joint>
<joint name="fix" type="fixed"><parent link="c"/><child link="tip"/><origin xyz="0 0.1 0.2" rpy="0.1 0.2 0.3"/></joint>
</robot>"""


def by_jacobian(path: Path, names: tuple[str, ...], q: np.ndarray, wrench: np.ndarray, frame: str) -> np.ndarray:
    """J^T F by the library, sample by sample, on an independently built model."""
    model = pin.buildModelFromUrdf(str(path))
    locked = [model.getJointId(n) for n in list(model.names)[1:] if n not in names]
    model = pin.buildReducedModel(model, locked, pin.neutral(model))
    data, frame_id = model.createData(), model.getFrameId(frame)
    order = [names.index(n) for n in list(model.names)[1:]]
    out = np.empty_like(q)
    for k in range(len(q)):
        full = pin.neutral(model)
        for joint, column in zip(list(model.joints)[1:], order, strict=True):
            angle = q[k, column]
            full[joint.idx_q : joint.idx_q + joint.nq] = [angle] if joint.nq == 1 else [np.cos(angle), np.sin(angle)]
        jacobian = pin.computeFrameJacobian(model, data, full, frame_id, pin.LOCAL)
        out[k, order] = jacobian.T @ wrench[k]
    return out


@pytest.mark.parametrize("frame", ["tip", "c", "b", "base", "j2"])
def test_any_axis_any_frame(tmp_path: Path, frame: str) -> None:
    path = tmp_path / "skewed.urdf"
    path.write_text(SKEWED)
    robot = build_robot(RobotConfig(urdf=Path("skewed.urdf")), tmp_path, ["j1", "j2", "j3"])
    rng = np.random.default_rng(3)
    q, wrench = rng.uniform(-2, 2, (20, 3)), rng.normal(size=(20, 6))
    expected = by_jacobian(path, robot.joint_names, q, wrench, frame)
    np.testing.assert_allclose(robot.wrench_torque(q, wrench, frame), expected, atol=1e-12)


@pytest.mark.real
@pytest.mark.parametrize(
    ("urdf", "frame", "count"),
    [
        ("ur3_robot", "tool0", 6),
        ("ur10_robot", "tool0", 6),
        ("panda", "panda_hand", 8),
        ("tiago_no_hand", "arm_7_link", 7),
    ],
)
def test_real_arms(data_dir: Path, urdf: str, frame: str, count: int) -> None:
    path = data_dir / "urdf" / f"{urdf}.urdf"
    config = RobotConfig(urdf=path)
    names = movable_joints(config, data_dir)
    arm = [n for n in names if "tiago" not in urdf or n.startswith("arm_")]
    assert len(arm) == count
    robot = build_robot(config.changed({"joints": arm}), data_dir, arm)  # the Panda's finger, too
    assert robot.has_inertials
    rng = np.random.default_rng(4)
    q, wrench = rng.uniform(-2, 2, (50, count)), rng.normal(size=(50, 6))
    expected = by_jacobian(path, robot.joint_names, q, wrench, frame)
    np.testing.assert_allclose(robot.wrench_torque(q, wrench, frame), expected, atol=1e-11)


@pytest.mark.real
def test_gravity_in_a_frame_matches_its_pose(data_dir: Path) -> None:
    config = RobotConfig.of(
        {
            "urdf": data_dir / "urdf" / "ur10_robot.urdf",
            "base_rpy_deg": (20, -30, 50),
            "tool": {"frame": "tool0", "mass_kg": 2.0, "com_m": (0.01, 0.02, 0.1)},
        }
    )
    robot = build_robot(config, data_dir, movable_joints(config, data_dir))
    q = np.random.default_rng(5).uniform(-2, 2, (10, 6))
    assert robot.bodies is not None
    forward = robot.bodies.forward()
    for k, wrench in enumerate(robot.tool_wrench(q, "ee_link")):
        sensor, origin, _ = forward.at(forward.arm.frame_number("ee_link"), q[k], np.zeros(3))
        _, place, _ = forward.at(forward.arm.frame_number("tool0"), q[k], np.array([0.01, 0.02, 0.1]))
        weight = 2.0 * robot.gravity_base_m_s2
        arm = place - origin
        np.testing.assert_allclose(wrench[:3], sensor.T @ weight, atol=1e-12)
        np.testing.assert_allclose(wrench[3:], sensor.T @ np.cross(arm, weight), atol=1e-12)


@pytest.mark.real
def test_the_tool_must_not_move_against_its_sensor(data_dir: Path) -> None:
    config = RobotConfig.of({"urdf": data_dir / "urdf" / "ur10_robot.urdf", "tool": {"frame": "tool0", "mass_kg": 1.0}})
    robot = build_robot(config, data_dir, movable_joints(config, data_dir))
    with pytest.raises(RobotError, match="a joint lies between"):
        robot.tool_wrench(np.zeros((1, 6)), "forearm_link")
    with pytest.raises(RobotError, match="did you mean 'tool0'"):
        robot.wrench_torque(np.zeros((1, 6)), np.zeros((1, 6)), "toool0")


def test_without_a_robot_nothing_is_made_up() -> None:
    robot = build_robot(RobotConfig(), Path(), ["a", "b"])
    assert robot.joint_names == ("a", "b") and not robot.has_inertials
    assert [f.code for f in robot.findings] == ["model-approximate"]
    with pytest.raises(NotJudgedError):
        robot.inverse_dynamics(*np.zeros((3, 1, 2)))
    with pytest.raises(NotJudgedError):
        robot.wrench_torque(np.zeros((1, 2)), np.zeros((1, 6)), "tool0")


@pytest.mark.parametrize("frame", ["a", "b", "tip"])
def test_a_force_in_base_axes_is_that_of_the_frame_turned(tmp_path: Path, frame: str) -> None:
    path = tmp_path / "skewed.urdf"
    path.write_text(SKEWED)
    names = ("j1", "j2", "j3")
    robot = build_robot(RobotConfig.of({"urdf": str(path)}), tmp_path, names)
    q, force = np.random.default_rng(3).uniform(-1.0, 1.0, (6, 3)), np.array([3.0, -2.0, 5.0])
    own = robot.torque_per_newton(q, frame)
    turned = np.stack([own[k] @ robot.frame_rotation(q[k], frame).T for k in range(len(q))])
    np.testing.assert_allclose(robot.base_torque_per_newton(q, frame) @ force, turned @ force, atol=1e-12)


@pytest.mark.parametrize("frame", [None, "tip", "c"])
def test_a_tool_is_mounted_where_it_is_looked_for(tmp_path: Path, frame: str | None) -> None:
    """Without a stated frame that is the last link, not the frame that a description happens to list last."""
    path = tmp_path / "arm.urdf"
    mass = '<inertial><mass value="4"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
    path.write_text(SKEWED.replace('<link name="c"/>', f'<link name="c">{mass}</link>'))
    config = RobotConfig(urdf=path)
    tool = config.tool.changed({"com_m": (0.01, 0.02, 0.03), "frame": frame})
    bare, laden = (
        build_robot(config.changed({"tool": tool.changed({"mass_kg": mass})}), tmp_path, ["j1", "j2", "j3"])
        for mass in (0.0, 0.5)
    )
    assert laden.tool is not None and laden.tool.frame == laden.tool_frame == (frame or "c")
    turn, place, body = laden.in_joint(None)
    more = (laden.inertial_parameters - bare.inertial_parameters)[10 * body : 10 * body + 4]
    assert more == pytest.approx([0.5, *(0.5 * (turn @ np.array([0.01, 0.02, 0.03]) + place))], abs=1e-9)
