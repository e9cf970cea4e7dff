"""Which joints of a log are modelled, and which of these are judged."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from collaudit.core.config.schema import Config
from collaudit.core.data.joint_log import JointLog
from collaudit.core.data.uniform_series import UniformSeries
from collaudit.core.errors import LogError
from collaudit.core.robot.robot_model import RobotModel

#: Of a log or a series: what has a column for each joint.
_BY_JOINT = (
    "position_rad", "velocity_rad_s", "acceleration_rad_s2", "effort", "saturated", "raw_velocity_rad_s",
    "temperature_c", "joint_torque_nm",
)  # fmt: skip


def in_model_order(log: JointLog, robot: RobotModel) -> JointLog:
    """The log with the model's joints only, in the model's order."""
    pick = [log.joint_names.index(name) for name in robot.joint_names]
    if pick == list(range(len(log.joint_names))):
        return log

    return replace(log, joint_names=robot.joint_names, **_picked(log, pick))


def judged_joints(config: Config, present: tuple[str, ...], name: str) -> tuple[str, ...]:
    """The joints to judge, of those present in the log of this name.

    Raises:
        LogError: one that the configuration names is not there.
    """
    wanted = config.robot.joints
    if wanted is None:
        return present
    missing = [joint for joint in wanted if joint not in present]
    if missing:
        raise LogError(
            "joints to judge are missing from the log",
            where=f"{name}, [robot] joints",
            found="nothing of " + ", ".join(missing),
            expected=", ".join(wanted),
            hint="map other names by [log] joint_names, or leave these joints out of [robot] joints",
        )
    return tuple(joint for joint in present if joint in wanted)


def of_joints(series: UniformSeries, joints: tuple[str, ...]) -> UniformSeries:
    """The series with these of its joints only."""
    if len(joints) == len(series.joint_names):
        return series
    return replace(series, joint_names=joints, **_picked(series, [series.column(joint) for joint in joints]))


def _picked(signals: JointLog | UniformSeries, columns: Sequence[int]) -> dict[str, Any]:
    """Those of the signals that have a column for each joint, with some of the columns."""
    tables = ((name, getattr(signals, name, None)) for name in _BY_JOINT)
    return {name: np.asfortranarray(values[:, columns]) for name, values in tables if values is not None}
