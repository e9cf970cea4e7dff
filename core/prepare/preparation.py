"""From a log and its robot to what fitting and judging share: condition, model, check; and again with more known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from collaudit.core.arm_states.arm_states import find_arm_states, without_states
from collaudit.core.arm_states.switched_effort import switched_efforts
from collaudit.core.conditioning.conditioning import condition
from collaudit.core.config.schema import Config
from collaudit.core.data.joint_log import JointLog, UniformSeries
from collaudit.core.errors import ConfigError, LogError, NotJudgedError
from collaudit.core.findings import Finding, in_joint_units
from collaudit.core.numeric.arrays import BoolArray, FloatArray, frozen
from collaudit.core.numeric.linear_algebra import memory_bytes
from collaudit.core.prepare.calibration import (
    Calibration,
    KnownLoad,
    calibrated_robot,
    calibrated_series,
    spring_findings,
    weightless_findings,
)
from collaudit.core.prepare.channel_delay import undelayed
from collaudit.core.prepare.commanded_force import CommandedTorque, contact_torque, tool_force
from collaudit.core.prepare.effort_checks import EffortChecks, effort_checks, payload_steps, raw_effort_findings
from collaudit.core.prepare.effort_gain import identified_scale_findings
from collaudit.core.prepare.effort_kind import effort_kind, magnitude_findings
from collaudit.core.prepare.model_bandwidth import ModelBandwidth, bandwidth_findings, quiet_model, within_bandwidth
from collaudit.core.prepare.mounting import mounting, mounting_findings
from collaudit.core.prepare.phases import configured, find_phases, label_phases, logged_phases, phase_findings
from collaudit.core.prepare.position_check import position_findings
from collaudit.core.prepare.prepared import ConditionedLog, Prepared, in_model_order
from collaudit.core.robot.pinocchio_model import PointMass
from collaudit.core.robot.robot_model import RobotModel
from collaudit.core.torque_table.log_samples import TorqueTable

#: So many tables of a log's size must fit in memory: an audit keeps twelve, and the columns that are worked on at the
#: same time take as much as six.
_AT_ONCE = 18


def prepare(
    log: JointLog,
    robot: RobotModel,
    config: Config,
    calibration: Calibration | None = None,
) -> Prepared:
    """Condition a log, compute its model torque and check its effort against it.

    Args:
        log: as recorded.
        robot: its model as described.
        config: everything else.
        calibration: what a friction file knows of the arm; None for nothing.

    Raises:
        NotJudgedError: the log has no stretch long enough.
        LogError: a configured joint is not in the log.
        ConfigError: a wrench lacks its frame, or the calibration is another arm's.
    """
    return modelled(conditioned(log, robot, config), config, calibration)


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
    findings += position_findings(series, robot, config.log.units)
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


def modelled(
    start: ConditionedLog, config: Config, calibration: Calibration | None = None, known: Prepared | None = None
) -> Prepared:
    """The second half of :func:`prepare`: model torque, commanded force and the effort's checks.

    Args:
        start: the log before its model torque.
        config: as of :func:`prepare`.
        calibration: what is known of the arm; None for nothing.
        known: the same log with another calibration: what that leaves as it was is taken from it.

    Raises:
        ConfigError: as :func:`prepare`.
    """
    calibration = calibration or Calibration()
    robot, about = calibrated_robot(start.robot, calibration, config, start.series.wrench is not None)
    series = calibrated_series(start.series, calibration)
    commanded, rigid, quiet = _torques(start, series, robot, calibration, config, known)
    findings = [*start.findings, *commanded.findings, *bandwidth_findings(quiet, series.bandwidth_hz)]
    contact = commanded.torque_nm
    table = None if start.table is None or rigid is None else start.table.seen(series, rigid, contact)
    switched = switched_efforts(series, table, start.judged)
    not_driven, about_states = find_arm_states(series, None if switched else rigid, config.detect.true_events)
    series = without_states(series, not_driven)
    findings += [*switched, *about_states, *raw_effort_findings(series)]
    scale = identified_scale_findings(calibration.identified, start.judged, start.series.effort_unit)
    scale += weightless_findings(start.robot, calibration.identified, start.judged)
    checks = EffortChecks()
    if table is not None:
        table, signless = table.seen(series), magnitude_findings(series)
        described = table
        if robot is not start.robot:
            more = start.robot.inverse_dynamics(*table.motion) - robot.inverse_dynamics(*table.motion)
            described = replace(table, model=table.model + more)
        if signless:
            checks = EffortChecks(findings=signless)
        else:
            checks = effort_checks(start, series, robot, contact, table, described, calibration, config)
        if not switched and not signless:
            findings += payload_steps(start, series, robot, table, described, calibration, checks.gains)
    scale += checks.scale
    findings += [*checks.findings, *scale, *about, *spring_findings(start.series, calibration.identified)]
    return Prepared(
        series,
        robot,
        rigid,
        commanded,
        start.judged,
        start.phases,
        checks.gains,
        checks.delay,
        in_joint_units(findings, robot.sliding),
        calibration,
        start,
        quiet,
        in_joint_units(scale, robot.sliding),
        upright=checks.upright,
    )


def _torques(
    start: ConditionedLog,
    series: UniformSeries,
    robot: RobotModel,
    calibration: Calibration,
    config: Config,
    known: Prepared | None,
) -> tuple[CommandedTorque, FloatArray | None, tuple[ModelBandwidth, ...]]:
    """Torque of the commanded tool force, rigid-body torque, and joints of which a part of that is noise, left out.

    Arguments as of :func:`modelled`, and series and robot as calibrated.
    """
    heard = known is not None and known.calibration.sensor == calibration.sensor
    if known is not None and heard and (known.rigid_nm is None or robot is known.robot):
        return known.commanded, known.rigid_nm, known.quiet
    commanded = known.commanded if known is not None and heard else None
    commanded = commanded or contact_torque(series, robot, start.phases, config, calibration.sensor)
    rigid = _rigid(start, series, robot) if robot.has_inertials else None
    if rigid is None or config.conditioning.bandwidth_hz is not None:
        return commanded, rigid, ()
    return commanded, *quiet_model(series, rigid, commanded.torque_nm)


def _rigid(start: ConditionedLog, series: UniformSeries, robot: RobotModel) -> FloatArray:
    """(n, j) rigid-body torque with that of the log's known load."""
    rigid_nm = robot.inverse_dynamics(*series.motion)
    return rigid_nm if start.load_nm is None else np.asfortranarray(rigid_nm + start.load_nm)


def calibrated(prepared: Prepared, calibration: Calibration, config: Config) -> Prepared:
    """The same log with what another calibration knows; unchanged when that is what it was prepared with.

    Fitting needs this, for it prepares its logs before it knows what is to be found in them.

    Raises:
        ConfigError: the calibration is another arm's.
    """
    if calibration == prepared.calibration:
        return prepared
    return modelled(prepared.start, config, calibration, prepared)


def recalibrated(prepared: Prepared, calibration: Calibration, config: Config) -> Prepared:
    """The same log with other values of what it was calibrated with: effort and model torque, without their checks.

    States, findings, gains and the bandwidth stay those of ``prepared``: a held-out fit needs its torques only.

    Args:
        prepared: the log, calibrated with the same sensor.
        calibration: the other values.
        config: as it was prepared with.
    """
    start = prepared.start
    robot, _ = calibrated_robot(start.robot, calibration, config, start.series.wrench is not None)
    series = without_states(calibrated_series(start.series, calibration), prepared.series.not_driven)
    rigid = prepared.rigid_nm
    if rigid is not None and robot is not prepared.robot:
        rigid = within_bandwidth(series, _rigid(start, series, robot), prepared.quiet)
    return replace(prepared, series=series, robot=robot, rigid_nm=rigid, calibration=calibration)


def without_effort(prepared: Prepared, left_out: BoolArray, config: Config) -> Prepared:
    """The same log with the effort unknown where it is to be left out: no stage uses it there.

    Args:
        prepared: the log.
        left_out: (n,) samples.
        config: as it was prepared with.
    """
    effort = prepared.start.series.effort
    if effort is None or not left_out.any():
        return prepared
    known = effort.copy(order="F")
    known[left_out] = np.nan
    start = replace(prepared.start, series=replace(prepared.start.series, effort=known))
    return modelled(start, config, prepared.calibration, prepared)


def loaded(prepared: Prepared, load: KnownLoad, config: Config) -> Prepared:
    """The log with its load in the model's torque.

    Raises:
        NotJudgedError: the robot has no inertials. ConfigError: a detector that has no place for the load.
    """
    robot = prepared.robot
    if not robot.has_inertials:
        raise NotJudgedError("a known load needs a robot with inertials", hint="give a URDF with <inertial> elements")
    if config.detect.detector != "direct":
        raise ConfigError(
            "known loads go with the direct detector only: the others have the torque of one arm",
            where="[detect] detector",
            found=config.detect.detector,
            expected="direct",
        )
    load_nm = robot.load_torque(*prepared.series.motion, PointMass(robot.tool_frame, load.mass_kg, load.com_m))
    return modelled(replace(prepared.start, load_nm=frozen(load_nm)), config, prepared.calibration)


def carrying(prepared: Prepared, load: KnownLoad, finding: Finding, config: Config) -> Prepared:
    """The log of an arm that carries the load, whatever the detector; the finding says so."""
    start = prepared.start
    start = replace(start, robot=load.carried_by(start.robot), findings=(*start.findings, finding))
    return modelled(start, config, prepared.calibration)


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
