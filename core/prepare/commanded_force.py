"""The commanded tool force: from the wrist sensor to joint torques J(q)^T F (eq. 2), without blows that stand out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from collaudit.core.config.schema import Config, PhasesConfig
from collaudit.core.data.identification_result import SensorFacts
from collaudit.core.data.uniform_series import UniformSeries
from collaudit.core.errors import ConfigError
from collaudit.core.findings import Finding
from collaudit.core.numeric.arrays import BoolArray, FloatArray
from collaudit.core.numeric.runs import run_bounds, widened
from collaudit.core.numeric.stats import median_of, quantile_of
from collaudit.core.prepare.phases import PHASES, contact_mask
from collaudit.core.robot.robot_model import RobotModel

_BIAS_S = 1.0
_ORIGIN = (0.0, 0.0, 0.0)
#: Stated phases are no sharper than this: the force takes a moment to come and to go.
_RELEASE_S = 0.25
#: A force this many times the level that contact keeps below for 95 % of its time, and this much above it, stands out.
_TIMES, _ABOVE_N = 1.5, 5.0
_SHARE = 0.95
#: Shorter than this is an impact of the tool that no rule would see, s.
_LEAST_S = 0.01
#: Stretches closer than this are one, s.
_TOGETHER_S = 0.2
_LISTED = 20


@dataclass(frozen=True, slots=True)
class ExcessForce:
    """A stretch in which the tool's force exceeded what is taken as meant.

    Attributes:
        start_s, end_s: seconds from the log's first sample.
        peak_n: its largest force.
        limit_n: what was taken as commanded.
    """

    start_s: float
    end_s: float
    peak_n: float
    limit_n: float


@dataclass(frozen=True, slots=True, eq=False)
class CommandedTorque:
    """Joint torque of the force that the tool is commanded to exert.

    Attributes:
        torque_nm: (n, j) J^T F of the measured tool force, or None without a wrench.
        findings: how the sensor's offset was found, and what stood out of the force.
        excess: stretches in which the tool met more force than was taken as commanded.
    """

    torque_nm: FloatArray | None
    findings: tuple[Finding, ...]
    excess: tuple[ExcessForce, ...] = ()


def contact_torque(
    series: UniformSeries,
    robot: RobotModel,
    phases: NDArray[np.int8],
    config: Config,
    sensor: SensorFacts | None = None,
) -> CommandedTorque:
    """Joint torque of the force that the tool is commanded to exert, eq. (2).

    Where phases are known, a force outside contact is not commanded (eq. 1) and stays in the residual.

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
        motion = (series.position_rad, series.velocity_rad_s, series.acceleration_rad_s2)
        torque = robot.contact_torque(*motion, force, frame, carried)
    size = np.sqrt(np.einsum("ij,ij->i", force[:, :3], force[:, :3]))
    contact = contact_mask(phases)
    share, excess = commanded_share(series.time_s, size, contact, config.phases)
    torque *= share[:, None]
    findings += excess_findings(excess, config.phases)
    if np.any(phases != PHASES.index("free")):
        commanded = widened(contact, round(_RELEASE_S / series.period_s))  # with building it up and letting go
        torque[~commanded] = 0.0  # eq. (1): outside contact no force is commanded
    else:
        text = (
            "The log has a wrench but no phases: every force at the sensor is taken as intended, so a collision of "
            "the tool cannot be seen. State in [phases] when contact is intended."
        )
        findings.append(Finding("phases-unknown", "warning", text))
    return CommandedTorque(torque, tuple(findings), excess)


def _carried(robot: RobotModel, sensor: SensorFacts | None) -> tuple[str, float, FloatArray] | None:
    """Frame, mass and centre of the tool that the sensor carries; None when none is known."""
    if sensor is not None:
        return (sensor.frame, sensor.mass_kg, np.array(sensor.com_m or _ORIGIN)) if sensor.mass_kg > 0 else None
    return None if robot.tool is None else (robot.tool.frame, robot.tool.mass_kg, np.array(robot.tool.com_m))


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
        return None, _expected_a_wrench(config)
    frame = _frame(robot, config)
    sign = float(config.log.wrench_sign)
    if sensor is not None:
        own = robot.weight_in(series.position_rad, sensor.frame, sensor.mass_kg, np.array(sensor.com_m or _ORIGIN))
        text = (
            f"The wrist sensor's offset and its tool ({sensor.mass_kg:.3g} kg) are those that the friction file holds, "
            f"from {sensor.poses} poses at rest."
        )
        return sign * (series.wrench - np.array(sensor.offset)) + own, [Finding("log-wrench-bias", "info", text)]
    weight = robot.tool_wrench(series.position_rad, frame) if _weighed(config) else 0.0
    bias, findings = _bias(series, robot, frame, phases, config)
    return sign * (series.wrench - bias) + weight, findings


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


def _expected_a_wrench(config: Config) -> list[Finding]:
    if config.phases.contact and config.log.wrench is None and config.log.csv.wrench is None:
        return [
            Finding(
                "log-wrench-missing",
                "warning",
                "A contact phase is configured but no wrench: the intended tool force stays in the residual.",
            )
        ]
    return []


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
        return np.zeros(6), [
            Finding(
                "log-wrench-bias",
                "warning",
                f"The zero offset of the wrench sensor could not be taken from {where}; it was taken as zero.",
            )
        ]
    bias = np.array([median_of(column) for column in readings.T])
    scatter = np.std(readings, axis=0)
    text = ", ".join(f"{b:.3g}" for b in bias)
    return bias, [
        Finding(
            "log-wrench-bias",
            "info" if "approach" in where else "warning",
            f"Zero offset of the wrench sensor taken from {where}: [{text}] (N, N·m), scatter up to "
            f"{scatter[:3].max():.2g} N and {scatter[3:].max():.2g} N·m. It is wrong if the tool touched "
            "something in that time.",
        )
    ]


def _free_samples(series: UniformSeries, phases: NDArray[np.int8]) -> tuple[BoolArray, str]:
    """Samples believed to be without contact, and how they were chosen."""
    approach = phases == PHASES.index("approach")
    if np.count_nonzero(approach) >= 10:
        return np.asarray(approach), "the approach phase"
    start = series.time_s - series.time_s[0] < _BIAS_S
    return np.asarray(start), f"the first {_BIAS_S:g} s of the log, no approach phase being configured"


def commanded_share(
    time_s: FloatArray, force_n: FloatArray, contact: BoolArray, config: PhasesConfig
) -> tuple[FloatArray, tuple[ExcessForce, ...]]:
    """The share of the measured force that is taken as commanded.

    A force above the limit counts as commanded up to it; what exceeds it stays in the residual, where it can alarm.

    Args:
        time_s: (n,) s.
        force_n: (n,) size of the tool's force.
        contact: (n,) samples in which force is commanded; none where phases are not known.
        config: ``force_limit_n``; when absent, 1.5 times the level kept for 95 % of the contact, and 5 N more.

    Returns:
        (n,) factor of at most 1, and the stretches in which it was less.
    """
    share = np.ones(force_n.size)
    known = contact & np.isfinite(force_n)
    limit = config.force_limit_n
    if limit is None:
        if not known.any():
            return share, ()
        limit = _TIMES * quantile_of(force_n[known], _SHARE) + _ABOVE_N
    where = known if contact.any() else np.isfinite(force_n)
    above = where & (np.nan_to_num(force_n) > limit)
    share[above] = limit / force_n[above]
    return share, tuple(_stretches(time_s, np.where(above, force_n, 0.0), limit))


def _stretches(time_s: FloatArray, excess_n: FloatArray, limit: float) -> list[ExcessForce]:
    starts, stops = run_bounds(excess_n > 0.0)
    if starts.size == 0:
        return []
    fresh = np.flatnonzero(np.concatenate(([True], time_s[starts[1:]] - time_s[stops[:-1] - 1] > _TOGETHER_S)))
    out = []
    for group in np.split(np.arange(starts.size), fresh[1:]):
        a, b = int(starts[group[0]]), int(stops[group[-1]])
        first, last = float(time_s[a]), float(time_s[b - 1])
        if last - first >= _LEAST_S:
            out.append(ExcessForce(first, last, float(excess_n[a:b].max()), limit))
    return out


def excess_findings(excess: Sequence[ExcessForce], config: PhasesConfig) -> list[Finding]:
    """A finding for each of the first stretches."""
    usual = config.force_limit_n is None
    what = "the limit of what is usual in its contact" if usual else "[phases] force_limit_n"
    out = []
    for one in excess[:_LISTED]:
        text = (
            f"The tool's force rose to {one.peak_n:.3g} N between {one.start_s:.4g} and {one.end_s:.4g} s, above "
            f"{one.limit_n:.3g} N, {what}. Force up to this limit was taken as intended; the rest was judged."
        )
        out.append(Finding("tool-force-unusual", "warning", text, start_s=one.start_s, end_s=one.end_s))
    return out
