"""The commanded tool force: from the wrist sensor to joint torques J(q)^T F (eq. 2)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from collaudit.core.config.schema import Config
from collaudit.core.data.identification_result import SensorFacts
from collaudit.core.data.joint_log import UniformSeries
from collaudit.core.errors import ConfigError
from collaudit.core.findings import Finding
from collaudit.core.numeric.arrays import BoolArray, FloatArray, widened
from collaudit.core.prepare.phases import (
    PHASES,
    ExcessForce,
    commanded_share,
    contact_mask,
    excess_findings,
    found_by_force,
    found_finding,
)
from collaudit.core.robot.pinocchio_model import PointMass
from collaudit.core.robot.robot_model import RobotModel

_BIAS_S = 1.0
#: Poses that tell what hangs on a sensor; the mean square of gravity's change over them, (m/s²)², that is enough.
_POSES, _TURNED = 5_000, 1.0
#: Share of the squares that a weight explains, its mass, kg, and its lever, m, which are worth saying.
_OF_WEIGHT, _LEAST_KG, _ARM_M = 0.5, 0.1, 0.1
#: Stated phases are no sharper than this: the force takes a moment to come and to go.
_RELEASE_S = 0.25


@dataclass(frozen=True, slots=True, eq=False)
class CommandedTorque:
    """Joint torque of the force that the tool is commanded to exert.

    Attributes:
        torque_nm: (n, j) J^T F of the measured tool force, or None without a wrench.
        findings: how the sensor's offset was found, and what stood out of the force.
        excess: stretches in which the tool met more force than was taken as commanded.
        unstated_n: (n,) force that was taken as commanded though nothing states when or how much of it is; None where
            phases or a limit tell.
    """

    torque_nm: FloatArray | None
    findings: tuple[Finding, ...]
    excess: tuple[ExcessForce, ...] = ()
    unstated_n: FloatArray | None = None


def contact_torque(
    series: UniformSeries,
    robot: RobotModel,
    phases: NDArray[np.int8],
    config: Config,
    sensor: SensorFacts | None = None,
) -> CommandedTorque:
    """Joint torque of the force that the tool is commanded to exert, eq. (2).

    Where phases are known or looked for, a force outside contact is not commanded (eq. 1) and stays in the residual.

    Raises:
        ConfigError: there is a wrench and no ``wrench_frame``, or the model has no such frame.
    """
    force, findings = tool_force(series, robot, phases, config, sensor)
    if force is None:
        return CommandedTorque(None, tuple(findings))
    frame, carried = _frame(robot, config), _carried(robot, sensor)
    if carried is None or not robot.has_inertials:
        torque = robot.wrench_torque(series.position_rad, force, frame)
    else:
        torque = robot.contact_torque(*series.motion, force, frame, carried)
    size = np.sqrt(np.einsum("ij,ij->i", force[:, :3], force[:, :3]))
    contact = contact_mask(phases)
    found = found_by_force(config.phases, bool(series.phases))
    share, excess = commanded_share(series.time_s, size, contact, config.phases, found)
    torque *= share[:, None]
    findings += excess_findings(excess, config.phases)
    if found and contact.any():
        findings.append(found_finding(series.time_s, size, contact, config.phases))
    if found or series.phases or np.any(phases != PHASES.index("free")):
        commanded = widened(contact, round(_RELEASE_S / series.period_s))  # with building it up and letting go
        torque[~commanded] = 0.0  # eq. (1): outside contact no force is commanded
        return CommandedTorque(torque, tuple(findings), excess)
    size = np.nan_to_num(size)
    top = int(np.argmax(size))
    text = (
        "The log has a wrench but no phases: every force at the sensor is taken as intended "
        f"(largest {size[top]:.3g} N at {series.time_s[top]:.4g} s), so a collision of the tool cannot be seen. State "
        "in [phases] when contact is intended."
    )
    findings.append(Finding("phases-unknown", "warning", text))
    return CommandedTorque(torque, tuple(findings), excess, size if config.phases.force_limit_n is None else None)


def _carried(robot: RobotModel, sensor: SensorFacts | None) -> PointMass | None:
    """The tool that the sensor carries; None when none is known."""
    if sensor is None:
        return robot.tool
    return _sensed(sensor) if sensor.mass_kg > 0 else None


def _sensed(sensor: SensorFacts) -> PointMass:
    return PointMass(sensor.frame, sensor.mass_kg, sensor.com_m or (0.0, 0.0, 0.0))


def tool_force(
    series: UniformSeries,
    robot: RobotModel,
    phases: NDArray[np.int8],
    config: Config,
    sensor: SensorFacts | None = None,
) -> tuple[FloatArray | None, list[Finding]]:
    """The force and torque that the robot exerts, in the sensor's frame.

    The sensor reads ``sign · (F - W) + bias`` with F what the robot exerts, W the
    tool's weight on the sensor and sign = ``wrench_sign``; so ``F = sign · (reading - bias) + W``. Bias and weight are
    those of ``sensor`` where it is given.

    Returns:
        (n, 6) N and N·m, or None without a wrench; and findings on how its offset was found.

    Raises:
        ConfigError: there is a wrench and no ``wrench_frame``, or the model has no such frame.
    """
    if series.wrench is None:
        asked = config.phases.contact and config.log.wrench is None and config.log.csv.wrench is None
        text = "A contact phase is configured but no wrench: the intended tool force stays in the residual."
        return None, [Finding("log-wrench", "warning", text)] if asked else []
    frame = _frame(robot, config)
    sign = float(config.log.wrench_sign)
    if sensor is not None:
        own = robot.weight_in(series.position_rad, _sensed(sensor))
        text = (
            f"The wrist sensor's offset and its tool ({sensor.mass_kg:.3g} kg) are those that the friction file holds, "
            f"from {sensor.poses} poses at rest."
        )
        return sign * (series.wrench - np.array(sensor.offset)) + own, [Finding("log-wrench", "info", text)]
    weight = robot.tool_wrench(series.position_rad, frame) if _weighed(config) else 0.0
    bias, findings = _bias(series, robot, frame, phases, config)
    force = sign * (series.wrench - bias) + weight
    return force, findings + _still_weighed(force, robot, series.position_rad, frame)


def _still_weighed(force: FloatArray, robot: RobotModel, position: FloatArray, frame: str) -> list[Finding]:
    """A finding where what is left of the sensor, (n, 6) N and N·m, turns with gravity as a weight's pull does."""
    rows = np.flatnonzero(np.isfinite(force).all(axis=1) & np.isfinite(position).all(axis=1))
    rows = rows[:: max(1, rows.size // _POSES)]
    if rows.size < 2:
        return []
    left, pull = (x - x.mean(axis=0) for x in (force[rows], robot.gravity_in(position[rows], frame)))
    if float(np.mean(pull**2)) < _TURNED:
        return []
    mass_kg = -float(np.sum(pull * left[:, :3]) / np.sum(pull**2))  # what hangs on it is not exerted
    all_ways = pull @ np.linalg.lstsq(pull, left, rcond=None)[0]
    turned = np.linalg.svd(pull, compute_uv=False)[1] ** 2 >= _TURNED * rows.size  # about two axes
    if abs(mass_kg) >= _LEAST_KG and _of_weight(mass_kg * pull, left[:, :3]):
        names = "[log] wrench_sign, wrench_frame or [robot.tool] is wrong"
        why = "[robot.tool] states less than hangs on it" if mass_kg > 0 else names
        what = f"force at the sensor follows gravity like a mass of {mass_kg:.2g} kg"
    elif turned and _like_kg(all_ways[:, :3], pull) >= _LEAST_KG and _of_weight(all_ways[:, :3], left[:, :3]):
        why = "[log] wrench_frame is wrong, or the sensor is turned in its mount"
        what = "force at the sensor follows gravity as the tool's weight does in other axes than those of its frame"
    elif turned and _like_kg(all_ways[:, 3:], pull) >= _LEAST_KG * _ARM_M and _of_weight(all_ways[:, 3:], left[:, 3:]):
        why = "the place of [log] wrench_frame, or the centre of mass in [robot.tool], is wrong"
        what = "torque at the sensor follows gravity as that of a weight does"
    else:
        return []
    text = (
        f"The {what}, and counts as intended: {why}. "
        'State what hangs there, or take it from a fit by [log] wrench_bias = "calibrated".'
    )
    return [Finding("log-wrench", "warning", text)]


def _of_weight(part: FloatArray, whole: FloatArray) -> bool:
    """Whether the part is most of the whole."""
    return float(np.sum(part**2)) >= _OF_WEIGHT * max(float(np.sum(whole**2)), 1e-12)


def _like_kg(part: FloatArray, pull: FloatArray) -> float:
    """What pulls as much, kg; of torques, kg·m."""
    return float(np.sqrt(np.sum(part**2) / np.sum(pull**2)))


def _weighed(config: Config) -> bool:
    """Whether the weight of the tool is known, and taken out of what the sensor reads."""
    return config.robot.tool.mass_kg not in (0.0, "estimate")


def _frame(robot: RobotModel, config: Config) -> str:
    frame = config.log.wrench_frame
    if frame is None:
        raise ConfigError(
            "the log has a wrench, but its frame is not configured",
            where="[log] wrench_frame",
            expected="a frame of the model, such as " + ", ".join(robot.frame_names[-3:]),
        )
    return frame


def _bias(
    series: UniformSeries, robot: RobotModel, frame: str, phases: NDArray[np.int8], config: Config
) -> tuple[FloatArray, list[Finding]]:
    """Zero offset of the sensor, (6,): configured, or the median before contact."""
    assert series.wrench is not None
    if not isinstance(config.log.wrench_bias, str):
        return np.asarray(config.log.wrench_bias, dtype=np.float64), []
    free, where = _free_samples(series, phases)
    readings = series.wrench[free]
    if _weighed(config):
        readings = readings + float(config.log.wrench_sign) * robot.tool_wrench(series.position_rad[free], frame)
    readings = readings[np.isfinite(readings).all(axis=1)]
    if readings.shape[0] < 10:
        text = f"The zero offset of the wrench sensor could not be taken from {where}; it was taken as zero."
        return np.zeros(6), [Finding("log-wrench", "warning", text)]
    bias, scatter = np.median(readings, axis=0), np.std(readings, axis=0)
    shown = ", ".join(f"{b:.3g}" for b in bias)
    text = (
        f"Zero offset of the wrench sensor taken from {where}: [{shown}] (N, N·m), scatter up to "
        f"{scatter[:3].max():.2g} N and {scatter[3:].max():.2g} N·m. It is wrong if the tool touched something then."
    )
    return bias, [Finding("log-wrench", "info" if "approach" in where else "warning", text)]


def _free_samples(series: UniformSeries, phases: NDArray[np.int8]) -> tuple[BoolArray, str]:
    """Samples believed to be without contact, and how they were chosen."""
    approach = phases == PHASES.index("approach")
    if np.count_nonzero(approach) >= 10:
        return np.asarray(approach), "the approach phase"
    start = series.time_s - series.time_s[0] < _BIAS_S
    return np.asarray(start), f"the first {_BIAS_S:g} s of the log, no approach phase being configured"
