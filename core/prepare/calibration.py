"""What is known of the arm besides friction, by an earlier fit or as a load; the log's effort and model with it.

A friction file may hold drive gains, offsets and inertials (``identified``), and a calibration of the wrist sensor with
the tool it carries. :class:`Calibration` is what of it applies to one log; ``prepare`` takes it, so that model torque,
gains and findings are computed once, as the log is judged.

The friction of a motor that turns with several joints is a function of its own speed s, not of theirs. It is taken off
the effort, so that what remains is a joint's own, whatever detector or fit follows.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from collaudit.core.config.schema import Config
from collaudit.core.data.audit_result import FrictionFile
from collaudit.core.data.identification_result import ChannelFacts, CoupledFriction, Identified, SensorFacts
from collaudit.core.data.joint_log import UniformSeries
from collaudit.core.errors import ConfigError
from collaudit.core.findings import Finding, fact
from collaudit.core.findings.finding_kinds import Severity
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.robot.pinocchio_model import point_mass_parameters
from collaudit.core.robot.robot_model import RobotModel
from collaudit.core.torque_table.log_samples import settled

#: Below this speed of the axis, rad/s, its direction is not told.
STILL_RAD_S = 0.02


@dataclass(frozen=True, slots=True)
class Calibration:
    """What is known of the arm from an earlier fit; the default knows nothing.

    Attributes:
        identified: drive gains, offsets, inertials, tool; None for the arm as described and an effort as logged.
        sensor: zero offset and tool of the wrist sensor; None to estimate the offset from the log.
        tool: the tool that the model carries in place of the described one, None for the described one; identified
            bodies hold the tool in use at the fit, others follow the description of now.
        sensor_missing: a calibrated sensor was asked for and none is known.
        coupled: friction of axes that turn with several joints, by the motor's own joint.
    """

    identified: Identified | None = None
    sensor: SensorFacts | None = None
    tool: SensorFacts | None = None
    sensor_missing: bool = False
    coupled: Mapping[str, CoupledFriction] = field(default_factory=dict)

    @classmethod
    def of(cls, friction: FrictionFile | None, config: Config) -> Calibration:
        """What a friction file knows, of what the configuration asks for."""
        identified, channels = (None, {}) if friction is None else (friction.identified, friction.channels)
        coupled = {} if friction is None else friction.coupled
        return replace(cls.of_sensor(channels, config), identified=identified, coupled=coupled)

    @classmethod
    def of_sensor(cls, channels: Mapping[str, ChannelFacts], config: Config) -> Calibration:
        """The calibration of most poses in the sensor's frame, where ``wrench_bias = "calibrated"`` asks for one.

        Args:
            channels: facts about the channels of each log that was fitted.
            config: says the frame of the sensor.
        """
        if config.log.wrench_bias != "calibrated":
            return cls()
        found = [c.sensor for c in channels.values() if c.sensor is not None]
        sensor = max((s for s in found if s.frame == config.log.wrench_frame), key=lambda s: s.poses, default=None)
        return cls(sensor=sensor, tool=sensor, sensor_missing=sensor is None)


@dataclass(frozen=True, slots=True)
class KnownLoad:
    """A point mass that a log's arm carries beyond the configured tool.

    Attributes:
        mass_kg: 0 for none; below 0 the arm carries less than it was identified with.
        com_m: (3,) where, in the tool's frame.
    """

    mass_kg: float
    com_m: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def carried_by(self, robot: RobotModel) -> RobotModel:
        """The arm with the load at its tool."""
        turn, place, body = robot.in_joint(None)
        parameters, size = robot.inertial_parameters, abs(self.mass_kg)
        added = point_mass_parameters(size, size * (turn @ np.array(self.com_m) + place))
        parameters[10 * body : 10 * body + 10] += np.copysign(1.0, self.mass_kg) * added
        return robot.with_inertials(parameters, robot.armature)


def calibrated_series(series: UniformSeries, calibration: Calibration) -> UniformSeries:
    """The series with its effort as joint torque: effort / gain - offset, less springs and friction of coupled axes.

    Raises:
        ConfigError: they were identified on another arm.
    """
    series = _with_identified_drives(series, calibration.identified)
    known = {c.joint for c in series.couplings}
    coupled = {joint: axis for joint, axis in calibration.coupled.items() if joint in known}
    if not coupled or series.effort is None or series.effort_unit != "Nm":
        return series
    return replace(series, effort=series.effort - _coupled_torque(series, coupled))


def _with_identified_drives(series: UniformSeries, identified: Identified | None) -> UniformSeries:
    if identified is None:
        return series
    names = series.joint_names
    if any(name not in identified.joints for name in names):
        raise ConfigError(
            "the friction file identifies other joints than this log has",
            found=", ".join(identified.joints),
            expected=", ".join(names),
            hint="fit again on a log of this arm",
        )
    if series.effort is None:
        return series
    gains = [identified.joints[name].gain for name in names]
    gain = np.array([np.nan if value is None else value for value in gains])
    offset = np.array([identified.joints[name].offset_nm for name in names])
    effort = series.effort / gain - offset
    for j, name in enumerate(names):
        if (spring := identified.joints[name].angle_torque) is not None:
            effort[:, j] -= spring.at(series.position_rad[:, j])
    return replace(series, effort=effort, effort_unit="Nm")


def spring_findings(series: UniformSeries, identified: Identified | None) -> list[Finding]:
    """Time at angles at which nothing is known of a joint's spring, and so nothing of its torque."""
    joints = {} if identified is None else identified.joints
    found = []
    for name, joint in joints.items():
        if joint.angle_torque is None or name not in series.joint_names:
            continue
        low, high = joint.angle_torque.angle_rad[0], joint.angle_torque.angle_rad[-1]
        angle = series.position_rad[:, series.column(name)]
        unknown = np.isnan(joint.angle_torque.at(angle)) & np.isfinite(angle)
        seconds = float(np.count_nonzero(unknown)) * series.period_s
        if seconds:
            text = (
                f"Joint '{name}' is not judged for {seconds:.3g} s, beyond {low:.3g} to {high:.3g} rad: the fit"
                " does not know its spring, counterbalance or cable there."
            )
            found.append(Finding("evidence-range", "warning", text, joint=name))
    return found


def weightless_findings(robot: RobotModel, identified: Identified | None, judged: Collection[str]) -> list[Finding]:
    """Joints that carry a link whose mass the description does not state; warnings where a fit has found the masses."""
    severity: Severity = "warning" if identified is not None and identified.masses else "error"
    lacking: dict[str, list[str]] = {}
    for moved_by, carried_by in robot.weightless.items():
        for joint in carried_by:
            lacking.setdefault(joint, []).append(f"'{moved_by}'")
    known = "; a fit has found it." if severity == "warning" else ", so its model torque is not known."
    return [
        Finding(
            "model-approximate",
            severity,
            f"Joint '{joint}' carries a link without mass in the description (moved by {', '.join(links)}){known}",
            where="robot",
            joint=joint,
        )
        for joint, links in lacking.items()
        if joint in judged
    ]


def calibrated_robot(
    robot: RobotModel, calibration: Calibration, config: Config, with_wrench: bool
) -> tuple[RobotModel, list[Finding]]:
    """The arm with its identified inertials, or with the tool that its wrist sensor was calibrated with.

    Args:
        robot: as described.
        calibration: what is known of it.
        config: says the described tool.
        with_wrench: whether the log has a wrist sensor: without one its tool is not known to be mounted.

    Raises:
        ConfigError: the inertials were identified on another arm. NotJudgedError: the robot has no inertials.
    """
    findings: list[Finding] = []
    identified = calibration.identified
    if calibration.sensor_missing and with_wrench:
        text = (
            f"The friction file holds no calibration of a sensor in frame '{config.log.wrench_frame}': its offset was "
            "estimated from this log instead."
        )
        findings.append(Finding("log-wrench", "warning", text))
    # a fit that chose what to identify, or found masses, did so without that tool in its model
    fitted_without = identified is not None and (identified.masses or config.fit.estimate == "auto")
    if calibration.tool is not None and with_wrench and robot.has_inertials and not fitted_without:
        robot, mass, before = with_tool(robot, calibration.tool, config)
        text = (
            f"The model carries the tool that the wrist sensor was calibrated with, {mass:.3g} kg, in place of "
            f"{before:.3g} kg on file."
        )
        findings.append(fact(text, where="friction file"))
    if identified is not None:
        what = ", ".join(item for item in identified.estimate if item != "friction")
        text = (
            f"Effort and model torque are taken with what the friction file identified: {what}, and a constant offset "
            "of torque for each joint."
        )
        robot = _with_identified(robot, identified)
        findings.append(fact(text, where="friction file"))
    return robot, findings


def with_tool(robot: RobotModel, sensor: SensorFacts, config: Config) -> tuple[RobotModel, float, float]:
    """The arm with the calibrated tool; its mass and the mass on file beyond the sensor, kg.

    Both are moved as point masses at their centres: a body of the right mass on file keeps its inertia.
    """
    turn, place, body = robot.in_joint(sensor.frame)
    centre = np.zeros(3) if sensor.com_m is None else np.array(sensor.com_m)
    mass, first = robot.inertial_bodies().beyond(sensor.frame)
    tool = config.robot.tool
    if not isinstance(tool.mass_kg, str) and tool.mass_kg > 0:
        own_turn, own_place, _ = robot.in_joint(tool.frame)
        mass += tool.mass_kg
        first = first + tool.mass_kg * (own_turn @ np.array(tool.com_m) + own_place)
    parameters = robot.inertial_parameters
    ten = parameters[10 * body : 10 * body + 10]
    ten += point_mass_parameters(sensor.mass_kg, sensor.mass_kg * (turn @ centre + place)) - point_mass_parameters(
        mass, first
    )
    return robot.with_inertials(parameters, robot.armature), sensor.mass_kg, mass


def _with_identified(robot: RobotModel, identified: Identified) -> RobotModel:
    """The arm as it is described now, with what the fit found beyond the description that it had.

    So a tool that is stated for this log has its effect, whatever tool was stated for the fitted ones.
    """
    names = robot.inertial_bodies().joint_names
    if set(names) != set(identified.bodies):
        raise ConfigError(
            "the friction file identifies another arm's inertials",
            found=", ".join(identified.bodies),
            expected=", ".join(names),
        )
    parameters = robot.inertial_parameters.reshape(len(names), -1)
    for row, name in enumerate(names):
        body = identified.bodies[name]
        parameters[row] += np.subtract(body.parameters, body.parameters_file)
    armature = robot.armature
    for name, joint in identified.joints.items():  # a rotor is the drive's own: no log carries another
        if name in names and joint.armature_kg_m2 != joint.armature_file_kg_m2:
            armature[names.index(name)] = joint.armature_kg_m2
    return robot.with_inertials(parameters.ravel(), armature)


def _axis_speed(series: UniformSeries, weights: Mapping[str, float], of: FloatArray) -> FloatArray:
    """(n,) weighted sum of the joints' columns.

    Args:
        series: says the columns.
        weights: by joint.
        of: (n, j) velocity, acceleration or position.
    """
    total = np.zeros(of.shape[0])
    for joint, weight in weights.items():
        total += weight * of[:, series.column(joint)]
    return total


def _coupled_torque(series: UniformSeries, coupled: Mapping[str, CoupledFriction]) -> FloatArray:
    """(n, j) torque of all coupled axes at the joints, N·m.

    Args:
        series: the motion; velocity and acceleration as conditioned.
        coupled: by the motor's own joint.
    """
    out = np.zeros(series.velocity_rad_s.shape, order="F")
    for axis in coupled.values():
        s = _axis_speed(series, axis.weights, series.velocity_rad_s)
        torque = axis.coulomb_nm * np.tanh(s / STILL_RAD_S) + axis.viscous_nm_s_per_rad * s
        if axis.inertia_kg_m2 is not None:
            torque += axis.inertia_kg_m2 * _axis_speed(series, axis.weights, series.acceleration_rad_s2)
        for joint, weight in axis.weights.items():
            out[:, series.column(joint)] += weight * torque
    return out


def coupled_doubt(series: UniformSeries, coupled: Mapping[str, CoupledFriction]) -> FloatArray:
    """(n, j) by how much the coupled torque may be off (95 %), N·m.

    After a reversal of the axis its friction is anywhere between both directions' until it has travelled.

    Args:
        series: the motion.
        coupled: by the motor's own joint.
    """
    out = np.zeros(series.velocity_rad_s.shape, order="F")
    for axis in coupled.values():
        s = _axis_speed(series, axis.weights, series.velocity_rad_s)
        angle = _axis_speed(series, axis.weights, series.position_rad)
        loose = ~settled(series.segments, angle, s, STILL_RAD_S)[0]
        half = {name: 0.5 * ((high or 0.0) - (low or 0.0)) for name, (low, high) in axis.ci95.items()}
        doubt = np.hypot(half.get("coulomb_nm", 0.0), half.get("viscous_nm_s_per_rad", 0.0) * s)
        doubt[loose] += axis.coulomb_nm * (1.0 + np.abs(np.tanh(s[loose] / STILL_RAD_S)))
        for joint, weight in axis.weights.items():
            out[:, series.column(joint)] += abs(weight) * np.nan_to_num(doubt)
    return out
