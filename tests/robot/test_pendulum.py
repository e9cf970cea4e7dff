"""Inverse dynamics against a two-link pendulum worked out by hand, and what changes it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from arms import dh_robot, dh_row

from collaudit.core.config.schema import RobotConfig
from collaudit.core.robot.robot_building import build_robot

HERE = Path()
L1, L2, C1, C2 = 0.4, 0.3, 0.17, 0.11  # link lengths and centres of mass from their joints, m
M1, M2, I1, I2 = 3.0, 2.0, 0.05, 0.03  # kg, kg·m² about the centres of mass
G = 9.80665


def pendulum(**more: Any) -> RobotConfig:
    """Two standard DH rows turning about z; rolled by 90°, gravity is along -y, so that q = 0 is horizontal."""
    rows = [
        dh_row(M1, (C1 - L1, 0, 0), (I1, I1, I1), a=L1),
        dh_row(M2, (C2 - L2, 0, 0), (I2, I2, I2), a=L2),
    ]
    return RobotConfig.of({**dh_robot(rows, base_rpy_deg=(90, 0, 0)), **more})


def by_hand(q: np.ndarray, v: np.ndarray, a: np.ndarray) -> np.ndarray:
    """M(q) a + C(q, v) v + G(q) of the planar two-link arm (any mechanics textbook)."""
    q1, q2 = q.T
    h = M2 * L1 * C2
    m11 = M1 * C1**2 + I1 + M2 * (L1**2 + C2**2 + 2 * L1 * C2 * np.cos(q2)) + I2
    m12 = M2 * (C2**2 + L1 * C2 * np.cos(q2)) + I2
    m22 = M2 * C2**2 + I2
    coriolis = h * np.sin(q2)[:, None] * np.column_stack([-(2 * v[:, 0] * v[:, 1] + v[:, 1] ** 2), v[:, 0] ** 2])
    g2 = M2 * G * C2 * np.cos(q1 + q2)
    g1 = (M1 * C1 + M2 * L1) * G * np.cos(q1) + g2
    inertia = np.column_stack([m11 * a[:, 0] + m12 * a[:, 1], m12 * a[:, 0] + m22 * a[:, 1]])
    return inertia + coriolis + np.column_stack([g1, g2])


@pytest.fixture
def motion() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(1)
    q, v, a = rng.uniform(-2, 2, (3, 40, 2))
    return q, v, a


def test_matches_the_hand_derived_equations(motion: Any) -> None:
    robot = build_robot(pendulum(), HERE, ["joint1", "joint2"])
    np.testing.assert_allclose(robot.inverse_dynamics(*motion), by_hand(*motion), atol=1e-12)
    still = np.zeros_like(motion[0])
    np.testing.assert_allclose(robot.gravity_torque(motion[0]), by_hand(motion[0], still, still), atol=1e-12)


def test_rotor_inertia_adds_to_the_diagonal(motion: Any) -> None:
    plain = build_robot(pendulum(), HERE, ["joint1", "joint2"])
    by_list = build_robot(pendulum(armature_kg_m2=[0.2, 0.5]), HERE, ["joint1", "joint2"])
    by_name = build_robot(pendulum(armature_kg_m2={"joint2": 0.5, "joint1": 0.2}), HERE, ["joint1", "joint2"])
    extra = motion[2] * np.array([0.2, 0.5])
    np.testing.assert_allclose(by_list.inverse_dynamics(*motion) - plain.inverse_dynamics(*motion), extra, atol=1e-12)
    np.testing.assert_array_equal(by_list.inverse_dynamics(*motion), by_name.inverse_dynamics(*motion))
    assert plain.sha256 != by_list.sha256


def test_base_tilt_turns_gravity(motion: Any) -> None:
    """Gravity along world -z with the base rolled by +90° is gravity along -y of the base."""
    robot = build_robot(pendulum(), HERE, ["joint1", "joint2"])
    np.testing.assert_allclose(robot.gravity_base_m_s2, [0, -G, 0], atol=1e-12)
    np.testing.assert_allclose(robot.inverse_dynamics(*motion), by_hand(*motion), atol=1e-10)


def test_tool_is_a_point_mass_on_the_last_link(motion: Any) -> None:
    q, _, _ = motion
    robot = build_robot(pendulum(tool={"mass_kg": 1.5, "com_m": (0.1, 0, 0)}), HERE, ["joint1", "joint2"])
    plain = build_robot(pendulum(), HERE, ["joint1", "joint2"])
    extra = robot.gravity_torque(q) - plain.gravity_torque(q)
    reach = (L2 + 0.1) * np.cos(q.sum(axis=1))
    np.testing.assert_allclose(extra[:, 1], 1.5 * G * reach, atol=1e-12)
    np.testing.assert_allclose(extra[:, 0], 1.5 * G * (L1 * np.cos(q[:, 0]) + reach), atol=1e-12)
    wrench = robot.tool_wrench(q, "link2")
    np.testing.assert_allclose(np.linalg.norm(wrench[:, :3], axis=1), 1.5 * G)
    np.testing.assert_allclose(-robot.wrench_torque(q, wrench, "link2"), extra, atol=1e-12)


def test_rows_that_are_not_numbers_stay_so(motion: Any) -> None:
    q, v, a = (x.copy() for x in motion)
    robot = build_robot(pendulum(), HERE, ["joint1", "joint2"])
    v[3, 1] = np.nan
    out = robot.inverse_dynamics(q, v, a)
    assert np.isnan(out[3]).all()
    keep = np.arange(len(q)) != 3
    np.testing.assert_allclose(out[keep], by_hand(q, v, a)[keep], atol=1e-12)


def test_joint_order_of_the_log_does_not_matter(motion: Any) -> None:
    robot = build_robot(pendulum(), HERE, ["joint2", "joint1"])
    assert robot.joint_names == ("joint1", "joint2")


def test_a_joint_missing_from_the_log_is_held_at_zero() -> None:
    robot = build_robot(pendulum(), HERE, ["joint2"])
    assert [f.code for f in robot.findings] == ["model-joint-missing"]
    q = np.array([[0.3], [1.0]])
    np.testing.assert_allclose(robot.gravity_torque(q)[:, 0], M2 * G * C2 * np.cos(q[:, 0]), atol=1e-12)
