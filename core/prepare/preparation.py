"""From a log and its robot to what fitting and judging share: condition, model, check; and again with more known."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from collaudit.core.arm_states.arm_states import find_arm_states, without_states
from collaudit.core.arm_states.payload_step import payload_findings
from collaudit.core.arm_states.switched_effort import switched_efforts
from collaudit.core.config.schema import Config
from collaudit.core.data.joint_log import JointLog
from collaudit.core.data.uniform_series import UniformSeries
from collaudit.core.findings import Finding, in_joint_units
from collaudit.core.numeric.arrays import BoolArray, FloatArray
from collaudit.core.prepare.calibration import (
    Calibration,
    calibrated_robot,
    calibrated_series,
    spring_findings,
    weightless_findings,
)
from collaudit.core.prepare.channel_delay import Delay
from collaudit.core.prepare.commanded_force import CommandedTorque, contact_torque
from collaudit.core.prepare.conditioned_log import conditioned
from collaudit.core.prepare.effort_gain import EffortGain, described_gains, effort_gains, friction_signs
from collaudit.core.prepare.effort_kind import computed_findings, magnitude_findings, smooth_joints
from collaudit.core.prepare.gain_findings import (
    delay_finding,
    identified_scale_findings,
    late_signs,
    raw_effort_findings,
    scale_findings,
    sign_findings,
)
from collaudit.core.prepare.model_bandwidth import ModelBandwidth, bandwidth_findings, quiet_model, within_bandwidth
from collaudit.core.prepare.prepared import ConditionedLog, Prepared
from collaudit.core.robot.robot_model import RobotModel
from collaudit.core.torque_table.thinned_log import TorqueTable


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
    checks = _EffortChecks()
    if table is not None:
        table, signless = table.seen(series), magnitude_findings(series)
        if signless:
            checks = _EffortChecks(findings=signless)
        else:
            checks = _effort_checks(start, series, robot, contact, table, calibration, config)
        if not switched and not signless:
            findings += _payload_findings(start, series, robot, table, calibration, checks.gains)
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


@dataclass(frozen=True, slots=True)
class _EffortChecks:
    """What the effort says of itself against the model's torque; attributes as of :class:`Prepared`."""

    gains: tuple[EffortGain, ...] = ()
    delay: Delay | None = None
    upright: frozenset[str] = frozenset()
    findings: tuple[Finding, ...] = ()
    scale: tuple[Finding, ...] = ()


def _effort_checks(
    start: ConditionedLog,
    series: UniformSeries,
    robot: RobotModel,
    contact: FloatArray | None,
    table: TorqueTable,
    calibration: Calibration,
    config: Config,
) -> _EffortChecks:
    """Gains, signs, delay and scale of a log's effort.

    Args:
        start: the log before its model torque.
        series, robot: as calibrated.
        contact: (n, j) torque of the commanded tool force, or None.
        table: of the series, with its model torque.
        calibration: what is known of the arm.
        config: what is stated of the effort.
    """
    gains = tuple(g for g in effort_gains(table) if g.joint in start.judged)
    sensed = start.effort_kind.source == "joint"  # a sensor behind the gear sees no friction
    smooth = smooth_joints(series) if config.log.effort_kind == "auto" else ()
    friction = friction_signs(table) if smooth or not sensed else {}
    signs = {} if sensed else friction
    upright = frozenset(joint for joint, sign in signs.items() if sign.positive)
    gains = _gains_with_free_tool(gains, table, robot, upright, config)
    renamed, stated = config.log.joint_names, config.log.units.effort_sign
    signed = {name for key in stated for name in (key, renamed.get(key, key))}  # by the model's names and the log's
    findings = computed_findings(smooth, friction, start.judged)
    late = late_signs(series, robot, table, contact, gains)
    if late is not None:  # of a late effort no scale is known, and of signs that friction tells none that is inverted
        delay, undone = late
        stated_ms = config.log.effort_delay_ms if "effort_delay_ms" in config.log.given else None
        told = {joint: signs[joint] for joint in upright}
        findings += [delay_finding(delay, undone, stated_ms), *sign_findings(gains, start.judged, signed, told, undone)]
        return _EffortChecks(gains, delay, upright, tuple(findings))
    findings += sign_findings(gains, start.judged, signed, signs)
    described = gains
    if robot is not start.robot:  # against the arm as described, what was identified of it left open
        lacking = () if calibration.identified is None else calibration.identified.estimate
        model = table.model + (start.robot.inverse_dynamics(*table.motion) - robot.inverse_dynamics(*table.motion))
        described = described_gains(replace(table, model=model), start.robot, lacking, config.robot.tool.frame)
    loaded = partial(described_gains, table, robot, ("rotor", "tool"), config.robot.tool.frame)
    scale = scale_findings([g for g in described if g.joint in start.judged], series.effort_unit, loaded)
    return _EffortChecks(gains, None, upright, tuple(findings), tuple(scale))


def _payload_findings(
    start: ConditionedLog,
    series: UniformSeries,
    robot: RobotModel,
    table: TorqueTable,
    calibration: Calibration,
    gains: Sequence[EffortGain],
) -> tuple[Finding, ...]:
    """Weights that change, by the joints whose effort goes with the model's torque: beside others stands twice that.

    Inertials that were identified hold a part of such weights: where the effort is a torque without their calibration,
    the arm as described tells them.
    """
    if series.effort_unit != "Nm":
        return ()
    inverted = {gain.joint for gain in gains if gain.inverted}
    telling = [joint for joint in start.judged if joint not in inverted]
    if calibration.identified is not None and start.series.effort_unit == "Nm":
        model = table.model + (start.robot.inverse_dynamics(*table.motion) - robot.inverse_dynamics(*table.motion))
        logged = table.seen(without_states(start.series, series.not_driven))
        table, robot = replace(logged, model=model), start.robot
    return payload_findings(table, robot, telling)


def _gains_with_free_tool(
    gains: tuple[EffortGain, ...],
    table: TorqueTable,
    robot: RobotModel,
    upright: frozenset[str],
    config: Config,
) -> tuple[EffortGain, ...]:
    """The gains; with rotors and a tool left open those that are inverted although friction takes power.

    A tool that is not described can outweigh a wrist as it is, and turn the torque of gravity round.
    """
    doubted = {gain.joint for gain in gains if gain.inverted and gain.joint in upright}
    if not doubted:
        return gains
    described = {g.joint: g for g in described_gains(table, robot, ("rotor", "tool"), config.robot.tool.frame)}
    return tuple(
        described[g.joint] if g.joint in doubted else g for g in gains if g.joint not in doubted or g.joint in described
    )


def _rigid(start: ConditionedLog, series: UniformSeries, robot: RobotModel) -> FloatArray:
    """(n, j) rigid-body torque with that of the log's known load."""
    rigid_nm = robot.inverse_dynamics(*series.motion)
    return rigid_nm if start.load_nm is None else np.asfortranarray(rigid_nm + start.load_nm)
