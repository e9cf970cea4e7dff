"""Which joints of a log are modelled, and which of these are judged."""

from __future__ import annotations

from dataclasses import replace

from collaudit.core.config.schema import Config
from collaudit.core.data.joint_log import JointLog
from collaudit.core.data.uniform_series import UniformSeries
from collaudit.core.errors import LogError
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.numeric.tables import picked
from collaudit.core.robot.robot_model import RobotModel


def in_model_order(log: JointLog, robot: RobotModel) -> JointLog:
    """The log with the model's joints only, in the model's order."""
    pick = [log.joint_names.index(name) for name in robot.joint_names]
    if pick == list(range(len(log.joint_names))):
        return log

    def take(array: FloatArray | None) -> FloatArray | None:
        return None if array is None else picked(array, pick)

    return replace(
        log,
        joint_names=robot.joint_names,
        position_rad=picked(log.position_rad, pick),
        velocity_rad_s=take(log.velocity_rad_s),
        effort=take(log.effort),
        temperature_c=take(log.temperature_c),
        joint_torque_nm=take(log.joint_torque_nm),
    )


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
    columns = [series.column(joint) for joint in joints]

    def take(array: FloatArray) -> FloatArray:
        return picked(array, columns)

    return replace(
        series,
        joint_names=joints,
        position_rad=take(series.position_rad),
        velocity_rad_s=take(series.velocity_rad_s),
        acceleration_rad_s2=take(series.acceleration_rad_s2),
        effort=None if series.effort is None else take(series.effort),
        saturated=series.saturated[:, columns],
        raw_velocity_rad_s=None if series.raw_velocity_rad_s is None else take(series.raw_velocity_rad_s),
        temperature_c=None if series.temperature_c is None else take(series.temperature_c),
        joint_torque_nm=None if series.joint_torque_nm is None else take(series.joint_torque_nm),
    )
