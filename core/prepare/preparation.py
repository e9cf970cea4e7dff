"""From a log and its robot to what fitting and judging share: condition, model, check; and again with more known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from collaudit.core.arm_states.arm_states import find_arm_states, without_states
from collaudit.core.arm_states.switched_effort import switched_efforts
from collaudit.core.config.schema import Config
from collaudit.core.data.joint_log import JointLog
from collaudit.core.data.uniform_series import UniformSeries
from collaudit.core.findings import in_joint_units
from collaudit.core.numeric.arrays import BoolArray, FloatArray
from collaudit.core.prepare.calibration import (
    Calibration,
    calibrated_robot,
    calibrated_series,
    spring_findings,
    weightless_findings,
)
from collaudit.core.prepare.commanded_force import CommandedTorque, contact_torque
from collaudit.core.prepare.conditioned_log import conditioned
from collaudit.core.prepare.effort_checks import EffortChecks, effort_checks, payload_steps, raw_effort_findings
from collaudit.core.prepare.effort_gain import identified_scale_findings
from collaudit.core.prepare.effort_kind import magnitude_findings
from collaudit.core.prepare.model_bandwidth import ModelBandwidth, bandwidth_findings, quiet_model, within_bandwidth
from collaudit.core.prepare.prepared import ConditionedLog, Prepared
from collaudit.core.robot.robot_model import RobotModel


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
        if signless:
            checks = EffortChecks(findings=signless)
        else:
            checks = effort_checks(start, series, robot, contact, table, calibration, config)
        if not switched and not signless:
            findings += payload_steps(start, series, robot, table, calibration, checks.gains)
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
