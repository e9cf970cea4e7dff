"""A log before its model torque: on one clock, joints and phases chosen, what its effort is, how it is mounted."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from collaudit.core.conditioning.conditioning import condition
from collaudit.core.config.schema import Config
from collaudit.core.data.joint_log import JointLog
from collaudit.core.data.uniform_series import UniformSeries
from collaudit.core.findings import Finding
from collaudit.core.prepare.commanded_force import tool_force
from collaudit.core.prepare.effort.channel_shift import undelayed
from collaudit.core.prepare.effort.effort_kind import effort_kind
from collaudit.core.prepare.effort.mounting import mounting, mounting_findings
from collaudit.core.prepare.joint_selection import in_model_order, judged_joints
from collaudit.core.prepare.log_size import refuse_larger_than_memory
from collaudit.core.prepare.phases import configured, find_phases, label_phases, logged_phases, phase_findings
from collaudit.core.prepare.position_check import position_findings
from collaudit.core.prepare.prepared import ConditionedLog
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
