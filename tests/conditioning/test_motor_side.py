"""Motor angles and torques come to the joints as R and its transpose say, with what is missing kept apart."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from origins import log_source

from collaudit.core.conditioning.motor_side import at_joints
from collaudit.core.config.schema import RobotConfig
from collaudit.core.data.joint_log import JointLog
from collaudit.core.errors import ConfigError

R = np.array([[50.0, 0.0, 0.0], [0.0, -48.0, 0.0], [0.0, 32.0, 32.0]])
NAMES = ("a", "b", "c")


def motion(n: int = 400) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    t = np.arange(n) * 0.002
    phase = np.array([0.0, 1.0, 2.0])
    q = 0.8 * np.sin(1.3 * t[:, None] + phase)
    v = 0.8 * 1.3 * np.cos(1.3 * t[:, None] + phase)
    tau = np.column_stack([5 + t, -3 + 0 * t, np.sin(t)])
    return t, q, v, tau


def motor_log(**changed: Any) -> JointLog:
    t, q, v, tau = motion()
    values: dict[str, Any] = {
        "time_s": t,
        "joint_names": NAMES,
        "position_rad": q @ R.T,
        "velocity_rad_s": v @ R.T,
        "effort": tau @ np.linalg.inv(R),  # tau_joint = R^T tau_motor
        "effort_unit": "Nm",
        "wrench": None,
        "source": log_source(),
    }
    return JointLog(**{**values, **changed})


def config(**keys: Any) -> RobotConfig:
    return RobotConfig.of(keys)


def test_angles_velocities_and_torques_come_to_the_joints() -> None:
    _, q, v, tau = motion()
    log = at_joints(motor_log(), config(reduction=R.tolist(), joint_offset_rad={"b": 0.5}), NAMES)
    np.testing.assert_allclose(log.position_rad, q + np.array([0, 0.5, 0]), atol=1e-12)
    np.testing.assert_allclose(log.velocity_rad_s, v, atol=1e-12)
    np.testing.assert_allclose(log.effort, tau, atol=1e-12)
    power = np.sum(motor_log().effort * motor_log().velocity_rad_s, axis=1)  # type: ignore[operator]
    np.testing.assert_allclose(np.sum(log.effort * log.velocity_rad_s, axis=1), power)  # type: ignore[operator]
    (found,) = log.findings
    assert "The motor of 'c' also turns with 'b' (32)" in found.text


def test_nothing_stated_changes_nothing() -> None:
    log = motor_log()
    assert at_joints(log, config(), NAMES) is log


def test_a_vector_and_a_table_by_name_are_a_diagonal_matrix() -> None:
    by_list = at_joints(motor_log(), config(reduction=[50, -48, 32]), NAMES)
    by_name = at_joints(motor_log(), config(reduction={"c": 32, "a": 50, "b": -48}), NAMES)
    np.testing.assert_array_equal(by_list.effort, by_name.effort)
    np.testing.assert_allclose(by_list.position_rad[:, 1], motor_log().position_rad[:, 1] / -48)


def test_a_list_follows_the_order_of_the_joints_not_of_the_log() -> None:
    log = motor_log()
    other = at_joints(log, config(reduction=[32, 50, -48], joints=["c", "a", "b"]), NAMES)
    np.testing.assert_allclose(other.position_rad[:, 0], log.position_rad[:, 0] / 50)


def test_only_the_signals_of_the_motors_are_brought_over() -> None:
    log = motor_log()
    found = at_joints(log, config(reduction=[50, -48, 32], motor_side=["effort"]), NAMES)
    np.testing.assert_array_equal(found.position_rad, log.position_rad)
    np.testing.assert_allclose(found.effort[:, 1], -48 * log.effort[:, 1])  # type: ignore[index]


def test_a_missing_value_spoils_only_the_joints_it_belongs_to() -> None:
    effort = motor_log().effort.copy()  # type: ignore[union-attr]
    effort[7, 2] = np.nan
    log = at_joints(motor_log(effort=effort), config(reduction=R.tolist()), NAMES)
    assert np.isnan(log.effort[7]).tolist() == [False, True, True]  # type: ignore[index]
    position = motor_log().position_rad.copy()
    position[9, 2] = np.nan
    log = at_joints(motor_log(position_rad=position), config(reduction=R.tolist()), NAMES)
    assert np.isnan(log.position_rad[9]).tolist() == [False, False, True]


def test_a_motor_angle_that_starts_again_after_a_turn_is_continued() -> None:
    whole = at_joints(motor_log(), config(reduction=R.tolist()), NAMES).position_rad
    wrapped = (motor_log().position_rad + np.pi) % (2 * np.pi) - np.pi
    log = at_joints(motor_log(position_rad=wrapped), config(reduction=R.tolist()), NAMES)
    np.testing.assert_allclose(np.diff(log.position_rad, axis=0), np.diff(whole, axis=0), atol=1e-9)


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ({"reduction": [50, -48]}, "3, in the order a, b, c"),
        ({"reduction": [[50, 0, 0], [0, -48, 0], [0, 32, 0]]}, "does not turn it"),
        ({"reduction": [[50, 0, 0], [0, 32, 32], [0, 32, 32]]}, "cannot be inverted"),
        ({"reduction": [[50, 0, 0], [0, 32], [0, 32, 32]]}, "not square"),
        ({"reduction": {"a": 50, "b": 1}}, "lacks joints"),
        ({"reduction": {"a": 50, "b": 1, "c": 1, "d": 1}}, "neither the log nor the robot has"),
        ({"joint_offset_rad": [0.1]}, "a table by joint name is safer"),
    ],
)
def test_what_does_not_fit_is_refused(keys: dict[str, Any], words: str) -> None:
    with pytest.raises(ConfigError, match=words):
        at_joints(motor_log(), config(**keys), NAMES)


def test_a_coupled_motor_whose_partner_is_not_in_the_log_is_refused() -> None:
    log = motor_log()
    part = JointLog(
        log.time_s, ("a", "c"), log.position_rad[:, [0, 2]], None, None, "Nm", None, log_source()
    )  # joint b is what motor c also turns
    with pytest.raises(ConfigError, match="couples joints that the log lacks"):
        at_joints(part, config(reduction=R.tolist(), joints=list(NAMES)), NAMES)


def test_coupled_efforts_of_an_unknown_unit_are_not_added() -> None:
    with pytest.raises(ConfigError, match="unknown unit"):
        at_joints(motor_log(effort_unit="raw"), config(reduction=R.tolist()), NAMES)
    alone = at_joints(motor_log(effort_unit="raw"), config(reduction=[50, -48, 32]), NAMES)
    assert alone.effort_unit == "raw"
