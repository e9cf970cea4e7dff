"""Everything about one log that fitting and judging share: conditioned signals, model torque, checks."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from collaudit.core.conditioning.conditioning import condition
from collaudit.core.conditioning.stated_delays import undelayed
from collaudit.core.config.schema import Config
from collaudit.core.data.joint_log import JointLog
from collaudit.core.data.uniform_series import UniformSeries
from collaudit.core.errors import LogError
from collaudit.core.findings import Finding
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.prepare.commanded_force import contact_torque, model_torques, tool_force
from collaudit.core.prepare.effort_delay import effort_findings
from collaudit.core.prepare.effort_gain import EffortGain, effort_gains
from collaudit.core.prepare.phases import configured, find_phases, label_phases, logged_phases, phase_findings
from collaudit.core.prepare.position_check import position_findings
from collaudit.core.robot.robot_model import RobotModel


@dataclass(frozen=True, slots=True, eq=False)
class Prepared:
    """One log, ready to be fitted or judged.

    Attributes:
        series: all joints that the log and the model share, in model order.
        robot: the model.
        rigid_nm: (n, j) rigid-body torque, or None without inertials.
        contact_nm: (n, j) J^T F of the measured tool force, or None without a wrench.
        judged: names of the joints to judge.
        phases: (n,) phase labels (``core/prepare/phases.py``).
        gains: effort against model torque, by joint.
        findings: of the log, the model and the checks.
    """

    series: UniformSeries
    robot: RobotModel
    rigid_nm: FloatArray | None
    contact_nm: FloatArray | None
    judged: tuple[str, ...]
    phases: NDArray[np.int8]
    gains: tuple[EffortGain, ...]
    findings: tuple[Finding, ...]

    def columns(self) -> list[int]:
        """Columns of the judged joints."""
        return [self.series.column(joint) for joint in self.judged]


def prepare(log: JointLog, robot: RobotModel, config: Config) -> Prepared:
    """Condition a log, compute its model torque and check its effort against it.

    Raises:
        NotJudgedError: the log has no stretch long enough.
        LogError: a configured joint is not in the log. ConfigError: a wrench lacks its frame.
    """
    series = undelayed(condition(_in_model_order(log, robot), config.conditioning), config.log)
    judged = _judged(config, series.joint_names, log.source.name)
    findings = [*series.findings, *robot.findings]
    labels, more = _phases(series, robot, config)
    findings += more
    findings += position_findings(series.position_rad, series.joint_names, robot, config.log.units.position)
    findings += phase_findings(series.time_s, labels, config.phases, bool(series.phases))
    rigid = None
    gains: tuple[EffortGain, ...] = ()
    if robot.has_inertials:
        rigid, contact, more = model_torques(series, robot, labels, config)
    else:
        contact, more = contact_torque(series, robot, labels, config)
    findings += more
    if rigid is not None and series.effort is not None:
        gains = tuple(g for g in effort_gains(series, rigid, contact) if g.joint in judged)
        findings += effort_findings(series, robot, rigid, contact, gains, judged, config.log.effort_delay_ms)
    return Prepared(series, robot, rigid, contact, judged, labels, gains, tuple(findings))


def _phases(series: UniformSeries, robot: RobotModel, config: Config) -> tuple[NDArray[np.int8], list[Finding]]:
    """Phases as configured, else as the log states them, else found from the wrench when that is asked for."""
    labels = label_phases(series.time_s, config.phases)
    if configured(config.phases):
        return labels, []
    if series.phases:
        return logged_phases(series.time_s, series.phases, config.phases)
    if config.phases.find == "off":
        return labels, []
    force, _ = tool_force(series, robot, labels, config)
    if force is None:
        return labels, []
    return find_phases(np.linalg.norm(force[:, :3], axis=1), series.period_s, config.phases), []


def _in_model_order(log: JointLog, robot: RobotModel) -> JointLog:
    """The log with the model's joints only, in the model's order."""
    pick = [log.joint_names.index(name) for name in robot.joint_names]
    if pick == list(range(len(log.joint_names))):
        return log

    def take(array: FloatArray | None) -> FloatArray | None:
        return None if array is None else np.asfortranarray(array[:, pick])

    return replace(
        log,
        joint_names=robot.joint_names,
        position_rad=np.asfortranarray(log.position_rad[:, pick]),
        velocity_rad_s=take(log.velocity_rad_s),
        effort=take(log.effort),
        temperature_c=take(log.temperature_c),
    )


def _judged(config: Config, present: tuple[str, ...], name: str) -> tuple[str, ...]:
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


def judged_series(prepared: Prepared) -> UniformSeries:
    """The series with the judged joints only."""
    columns = prepared.columns()
    series = prepared.series
    if len(columns) == len(series.joint_names):
        return series

    def take(array: FloatArray) -> FloatArray:
        return np.asfortranarray(array[:, columns])

    return replace(
        series,
        joint_names=prepared.judged,
        position_rad=take(series.position_rad),
        velocity_rad_s=take(series.velocity_rad_s),
        acceleration_rad_s2=take(series.acceleration_rad_s2),
        effort=None if series.effort is None else take(series.effort),
        saturated=series.saturated[:, columns],
        raw_velocity_rad_s=None if series.raw_velocity_rad_s is None else take(series.raw_velocity_rad_s),
        temperature_c=None if series.temperature_c is None else take(series.temperature_c),
    )
