"""The audit of a log's channels: their delays, the steps of the effort, and the wrist sensor."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from collaudit.core.conditioning.velocity_choice import SAMPLES
from collaudit.core.config.schema import Config
from collaudit.core.data.identification_result import Bounds, ChannelFacts
from collaudit.core.data.joint_log import MOVING_RAD_S, UniformSeries
from collaudit.core.findings import Finding
from collaudit.core.identification.force_sensor import audit_force_sensor, calibrate_sensor
from collaudit.core.numeric.arrays import FloatArray, IntArray, Span
from collaudit.core.numeric.parallel import by_name
from collaudit.core.numeric.stats import few_values
from collaudit.core.prepare.channel_delay import (
    Delay,
    Undetermined,
    all_known,
    best_shift,
    effort_shift,
    thinned,
)
from collaudit.core.prepare.prepared import Prepared
from collaudit.core.torque_table.block_sums import squares_left

#: An interval wider than this is no number to enter, s.
_UNSHARP_S = 0.03
#: So much of a log tells a delay as well as an hour does, s.
_ENOUGH_S = 240.0
#: Steps are coarse beyond this share of an effort's spread.
_COARSE = 0.5
#: Standard deviation of Gaussian noise over the median of |successive differences|: 1.4826 / sqrt(2).
_SD_PER_MEDIAN_DIFFERENCE = 1.05
#: An effort of more different values has no step.
_MOST_VALUES = 200
#: A delay, why there is none, or nothing to ask of.
_Found = Delay | Undetermined | None


def audit_channels(prepared: Prepared, config: Config) -> tuple[ChannelFacts, list[Finding]]:
    """Everything that can be said about the channels of one log."""
    effort, wrench = effort_delay(prepared), _wrench_delay(prepared, config)
    velocity = prepared.series.velocity_lag_s
    facts = ChannelFacts(
        effort_delay_ms=_ms(effort),
        effort_delay_ci95_ms=_bounds_ms(effort),
        velocity_delay_ms=None if velocity is None else 1e3 * velocity,
        wrench_delay_ms=_ms(wrench),
        wrench_delay_ci95_ms=_bounds_ms(wrench),
        sensor=calibrate_sensor(prepared, config),
    )
    findings = step_findings(prepared) + audit_delays(prepared, config, effort, wrench)
    return facts, findings + audit_force_sensor(prepared, config, facts.sensor)


def _ms(delay: _Found) -> float | None:
    return 1e3 * delay.seconds if isinstance(delay, Delay) else None


def _bounds_ms(delay: _Found) -> Bounds | None:
    return (1e3 * delay.ci95[0], 1e3 * delay.ci95[1]) if isinstance(delay, Delay) else None


def audit_delays(prepared: Prepared, config: Config, effort: _Found, wrench: _Found) -> list[Finding]:
    """Findings on channels whose offset is clearly not zero, with the line that would correct it.

    Args:
        prepared: the log.
        config: delays that are taken off already.
        effort, wrench: from :func:`effort_delay` and :func:`wrench_delay`.
    """
    findings = []
    for delay, code, channel, key, on in (
        (effort, "effort-delay", "effort", "effort_delay_ms", config.log.effort_delay_ms),
        (wrench, "log-wrench", "wrench", "wrench_delay_ms", config.log.wrench_delay_ms),
    ):
        if not isinstance(delay, Delay) or (channel == "effort" and prepared.sign_delay is not None):
            continue  # nothing is told, or preparation said it
        low, high = delay.ci95
        unsharp = high - low > _UNSHARP_S
        if not (low > prepared.series.period_s if unsharp else _is_significant(delay, prepared.series.period_s)):
            continue
        size, span = f"{1e3 * abs(delay.seconds):.1f} ms", f"95 %: {1e3 * low:.1f} to {1e3 * high:.1f} ms"
        side = "behind" if delay.seconds > 0 else "ahead of"
        mend = (
            ": too uncertain to be taken off, but late."
            if unsharp
            else f". To correct it: [log] {key} = {on + 1e3 * delay.seconds:.1f}."
        )
        lag = _velocity_words(prepared.series) if channel == "effort" else ""
        text = f"The {channel} is {size} {side} the motion ({span}){mend}{lag}"
        findings.append(Finding(code, "warning" if delay.seconds > 0 else "info", text))
    return findings


def late_effort_findings(prepared: Prepared, config: Config) -> list[Finding]:
    """What :func:`audit_delays` warns of a late effort, told from the first minutes of a log that alarms.

    A model in time leaves a residual wherever the torque of a late effort changes.
    """
    part = prepared.part(Span(0, round(_ENOUGH_S / prepared.series.period_s)))
    return [found for found in audit_delays(part, config, effort_delay(part), None) if found.severity == "warning"]


def _is_significant(delay: Delay, period_s: float) -> bool:
    """Whether an offset is shown: clearly not zero, and beyond what one sample's stamp leaves open."""
    low, high = delay.ci95
    return not low <= 0 <= high and abs(delay.seconds) >= period_s


def effort_delay(prepared: Prepared) -> _Found:
    """Delay of effort against the model torque of the motion; None without a model or enough motion."""
    if prepared.rigid_nm is None:
        return None
    joints = [g.joint for g in prepared.gains]
    return effort_shift(prepared.series, prepared.robot, joints, prepared.contact_nm)


def _velocity_words(series: UniformSeries) -> str:
    lag = series.velocity_lag_s
    if lag is None or lag < SAMPLES * series.period_s:
        return ""
    return f" The logged velocity is {1e3 * lag:.1f} ms behind the positions, as a velocity filtered by the drive is."


def _wrench_delay(prepared: Prepared, config: Config) -> _Found:
    """Delay of the wrench's force against the turning of the sensor under gravity; None where it does not turn."""
    series, frame = prepared.series, config.log.wrench_frame
    if series.wrench is None or frame is None or prepared.robot.bodies is None:
        return None
    force = series.wrench[:, :3]
    estimate = all_known([force])
    known = all_known([series.position_rad, series.acceleration_rad_s2]) & estimate & ~series.edge
    moving = (np.abs(series.velocity_rad_s) > MOVING_RAD_S).any(axis=1)
    rows = thinned(np.flatnonzero(known & moving), series, estimate)
    gravity = prepared.robot.gravity_in(series.position_rad[rows], frame)
    if rows.size == 0 or float(np.std(gravity, axis=0).max()) < 1.0:
        return None
    # the tool's inertia force is, pose by pose, linear in joint accelerations and squared speeds
    motion = np.column_stack(
        [gravity, np.ones(rows.size), series.acceleration_rad_s2[rows], series.velocity_rad_s[rows] ** 2]
    )

    def costs(pick: IntArray) -> Callable[[IntArray], FloatArray]:
        at = rows[pick, None]
        return lambda shifts: np.column_stack([squares_left(motion[pick], axis[at + shifts]) for axis in force.T])

    return best_shift(rows.size, costs, series.period_s)


def step_findings(prepared: Prepared) -> list[Finding]:
    """Joints whose effort comes in coarse steps."""
    series = prepared.series
    if series.effort is None:
        return []
    found = by_name(lambda joint: _coarse(series, joint), prepared.judged)
    return [finding for finding in found.values() if finding is not None]


def _coarse(series: UniformSeries, joint: str) -> Finding | None:
    """What is to say of a joint whose effort comes in steps."""
    assert series.effort is not None
    j = series.column(joint)
    moving = np.abs(series.velocity_rad_s[:, j]) > MOVING_RAD_S
    effort = series.effort[:, j][moving & np.isfinite(series.effort[:, j])]
    step = _step(effort)
    if step is None:
        return None
    noise = float(np.median(np.abs(np.diff(effort)))) * _SD_PER_MEDIAN_DIFFERENCE
    if not (step > _COARSE * float(np.std(effort)) or (step > 2.0 * noise and np.ptp(effort) < 60 * step)):
        return None
    text = (
        f"The effort of joint '{joint}' comes in steps of {step:.3g}, {np.ptp(effort) / step:.0f} steps from its "
        "smallest to its largest: thresholds of less than a few steps are not reliable."
    )
    return Finding("effort-filtered", "warning", text, joint=joint)


def _step(effort: FloatArray) -> float | None:
    """The step of an effort that takes few different values, else None."""
    values = few_values(effort, min(_MOST_VALUES, effort.size // 5))
    if values is None or values.size < 3:
        return None
    gaps = np.diff(values)
    step = float(np.median(gaps))
    ratio = gaps / step
    return step if np.mean(np.abs(ratio - np.round(ratio)) < 0.02) > 0.95 else None
