"""A log before its model torque: on one clock, joints and phases chosen, what its effort is, how it is mounted."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from collaudit.core.conditioning.conditioning import condition
from collaudit.core.config.schema import Config
from collaudit.core.data.joint_log import JointLog, UniformSeries
from collaudit.core.errors import LogError, NotJudgedError
from collaudit.core.findings import Finding
from collaudit.core.numeric.linear_algebra import memory_bytes
from collaudit.core.prepare.commanded_force import tool_force
from collaudit.core.prepare.effort.channel_shift import undelayed
from collaudit.core.prepare.effort_kind import effort_kind
from collaudit.core.prepare.mounting import mounting, mounting_findings
from collaudit.core.prepare.phases import configured, find_phases, label_phases, logged_phases, phase_findings
from collaudit.core.prepare.position_check import position_findings
from collaudit.core.prepare.prepared import ConditionedLog, in_model_order
from collaudit.core.robot.robot_model import RobotModel
from collaudit.core.torque_table.thinned_log import TorqueTable


def conditioned(log: JointLog, robot: RobotModel, config: Config) -> ConditionedLog:
    """The first half of preparing a log: nothing after it reads the log as recorded.

    Raises:
        NotJudgedError: the log has no stretch long enough. LogError: a configured joint is not in the log.
    """
    refuse_larger_than_memory(log.time_s.size, len(log.joint_names), log.source.name)
    log_of_arm = in_model_order(log, robot)
    series = undelayed(condition(log_of_arm, config.conditioning, robot.sliding, config.detect), config.log)
    judged = judged_joints(config, series.joint_names, log.source.name)
    labels, more = _phases(series, robot, config)
    findings = [*series.findings, *robot.findings, *more]
    units = config.log.units
    findings += position_findings(series, robot, units)
    findings += phase_findings(series.time_s, labels, config.phases, bool(series.phases))
    table = None if series.effort is None else TorqueTable.of(series)
    torques = table if series.effort_unit == "Nm" else None
    turned = mounting(torques, robot) if config.log.effort_kind not in ("external", "gravity-compensated") else None
    findings += mounting_findings(turned, config.robot.base_rpy_deg[2])
    if turned is not None and turned.far:
        robot = robot.under_gravity(turned.gravity_m_s2)
    kind, about_effort = effort_kind(config.log, torques, robot)
    if kind.compensated == "stated":
        robot = robot.without_gravity()
    return ConditionedLog(series, robot, judged, labels, (*findings, *about_effort), kind, table=table)


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
    return find_phases(np.linalg.norm(force[:, :3], axis=1), series.period_s), []


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


#: So many tables of a log's size must fit in memory: an audit keeps twelve, and the columns that are worked on at the
#: same time take as much as six.
_AT_ONCE = 18


def refuse_larger_than_memory(rows: int, columns: int, name: str) -> None:
    """Refuse a log whose tables do not fit.

    Args:
        rows, columns: samples and joints.
        name: of the log.

    Raises:
        NotJudgedError: they do not.
    """
    needed, there = 8.0 * rows * columns * _AT_ONCE, memory_bytes()
    if needed > there:
        raise NotJudgedError(
            "the log is larger than memory allows to judge at once",
            where=name,
            found=f"{rows} samples of {columns} joints: {needed / 1e9:.3g} GB of tables",
            expected=f"at most {there / 1e9:.3g} GB",
            hint="judge it in parts: --set log.to_s=3600, then --set log.from_s=3600 --set log.to_s=7200",
        )
