"""The audit of a log's channels: what the effort is, its steps, delays, the wrist sensor."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence

import numpy as np

from collaudit.core.conditioning.velocity_choice import SAMPLES
from collaudit.core.config.schema import Config
from collaudit.core.data.identification_result import Bounds, ChannelFacts
from collaudit.core.data.uniform_series import MOVING_RAD_S, UniformSeries
from collaudit.core.findings import Finding
from collaudit.core.identification.force_sensor import audit_force_sensor, calibrate_sensor
from collaudit.core.numeric.arrays import FloatArray, IntArray, Span
from collaudit.core.numeric.parallel import by_name
from collaudit.core.numeric.stats import few_values, weighted_median
from collaudit.core.prepare.effort.channel_shift import (
    all_known,
    basis_of,
    effort_shift,
    left_over,
    thinned,
)
from collaudit.core.prepare.effort.delay_estimate import Delay, Undetermined, best_shift
from collaudit.core.prepare.effort.effort_gain import EffortGain
from collaudit.core.prepare.effort.gain_findings import MOUNTING_FIRST, gains_at
from collaudit.core.prepare.prepared import Prepared

#: A shorter delay spoils neither gains nor residual; an interval wider than the other is no number to enter.
_MATTERS_S, _UNSHARP_S = 0.02, 0.03
#: So much of a log tells a delay as well as an hour does, s.
_ENOUGH_S = 240.0
#: A delay, why there is none, or nothing to ask of.
_Found = Delay | Undetermined | None


def audit_channels(prepared: Prepared, config: Config) -> tuple[ChannelFacts, list[Finding]]:
    """Everything that can be said about the channels of one log."""
    effort, wrench = effort_delay(prepared), _wrench_delay(prepared, config)
    late = effort if isinstance(effort, Delay) and _is_significant(effort, prepared.series.period_s) else None
    velocity = prepared.series.velocity_lag_s
    facts = ChannelFacts(
        effort_delay_ms=_ms(effort),
        effort_delay_ci95_ms=_bounds_ms(effort),
        velocity_delay_ms=None if velocity is None else 1e3 * velocity,
        wrench_delay_ms=_ms(wrench),
        wrench_delay_ci95_ms=_bounds_ms(wrench),
        sensor=calibrate_sensor(prepared, config),
    )
    findings = audit_effort(prepared, late if late is not None and abs(late.seconds) > _MATTERS_S else None)
    findings += audit_delays(prepared, config, effort, wrench)
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
        (wrench, "wrench-delay", "wrench", "wrench_delay_ms", config.log.wrench_delay_ms),
    ):
        if delay is None or (channel == "effort" and prepared.sign_delay is not None):  # preparation said it
            continue
        if isinstance(delay, Undetermined):
            findings.append(Finding(code, "info", f"The delay of the {channel} is not determinable: {delay.why}."))
            continue
        low, high = delay.ci95
        size, span = f"{1e3 * abs(delay.seconds):.1f} ms", f"95 %: {1e3 * low:.1f} to {1e3 * high:.1f} ms"
        side = "behind" if delay.seconds > 0 else "ahead of"
        text = f"The {channel} is {size} {side} the motion ({span})"
        lag = _velocity_words(prepared.series) if channel == "effort" else ""
        if high - low > _UNSHARP_S and low > prepared.series.period_s:
            findings.append(Finding(code, "warning", f"{text}: too uncertain to be taken off, but late.{lag}"))
        elif high - low > _UNSHARP_S:
            findings.append(Finding(code, "info", f"{text}: too uncertain to show an offset.{lag}"))
        elif not _is_significant(delay, prepared.series.period_s):
            findings.append(Finding(code, "info", f"{text}: no offset beyond one sample is shown.{lag}"))
        else:
            mend = f"To correct it: [log] {key} = {on + 1e3 * delay.seconds:.1f}."
            findings.append(Finding(code, "warning" if delay.seconds > 0 else "info", f"{text}. {mend}{lag}"))
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
    return high - low <= _UNSHARP_S and not low <= 0 <= high and abs(delay.seconds) >= period_s


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
        at, basis = rows[pick], basis_of(motion[pick])
        return lambda shifts: np.column_stack([left_over(basis, axis, at, shifts) for axis in force.T])

    return best_shift(rows.size, costs, series.period_s)


_AS_TORQUE = (0.6, 1.67)
_DOUBLED = (1.75, 2.3)
_ALIKE = 1.6
_MOST = 0.6  # of the load, borne by joints with like gains
_COARSE = 0.5
#: Standard deviation of Gaussian noise over the median of |successive differences|: 1.4826 / sqrt(2).
_SD_PER_MEDIAN_DIFFERENCE = 1.05
#: An effort of more different values has no step.
_MOST_VALUES = 200
_HEARD = 1e-3  # a joint with less of the load than this does not speak of signs


def audit_effort(prepared: Prepared, delay: Delay | None = None) -> list[Finding]:
    """What all joints' efforts together look like, and efforts in coarse steps. Nothing is changed by it.

    Args:
        prepared: the log.
        delay: a delay of the effort that would spoil its gains, to be taken off before they are read.
    """
    return [*_kind(prepared, delay), *_steps(prepared)]


def _kind(prepared: Prepared, delay: Delay | None) -> list[Finding]:
    """One verdict for the log: a single joint's gain may be off because its model is, all together are not."""
    if prepared.rigid_nm is None:
        return []
    gains = prepared.gains
    if delay is not None:
        gains = gains_at(prepared.series, prepared.rigid_nm, delay, prepared.contact_nm)
    known = [g for g in gains if g.known and g.joint in prepared.judged]
    if not known:
        return []
    weight = np.array([_load(prepared, g) for g in known])
    gain = np.array([g.gain for g in known])
    size = weighted_median(np.log(np.abs(gain)), weight)
    typical = float(np.exp(size))
    heavy = np.abs(np.log(np.abs(gain)) - size) < np.log(_ALIKE)
    alike = float(weight[heavy].sum() / weight.sum())
    heard = weight > _HEARD * weight.sum()
    negative = float(np.mean(gain[heard] < 0))
    numbers = "; ".join(f"{g.joint} {g.gain:.3g} [{g.ci95[0]:.3g}, {g.ci95[1]:.3g}]" for g in known)
    text = _words(known, typical, alike, negative, prepared.series.effort_unit, prepared.upright)
    if delay is not None:
        text = f"After correction of its delay of {1e3 * delay.seconds:.0f} ms: {text[0].lower()}{text[1:]}"
    doubt = prepared.series.effort_unit == "Nm" and not (alike >= _MOST and _AS_TORQUE[0] <= typical < _DOUBLED[0])
    text = f"{text} Effort per N·m of model torque [95 %]: {numbers}."
    return [Finding("effort-kind", "warning" if doubt else "info", text)]


def _words(
    known: Sequence[EffortGain], typical: float, alike: float, negative: float, unit: str, upright: Collection[str]
) -> str:
    signs = "its sign is inverted" if negative == 1.0 else "its signs are mixed" if negative > 0.0 else ""
    flip = ", ".join(f'"{g.joint}" = -1' for g in known if g.gain < 0)
    mend = f" To correct it: [log.units] effort_sign = {{ {flip} }}." if flip else ""
    turned = ", ".join(g.joint for g in known if g.gain < 0 and g.joint in upright)
    mend = f" {turned}: {MOUNTING_FIRST}.{mend.replace('it:', 'a sign that is inverted:')}" if turned else mend
    if alike < _MOST or not _AS_TORQUE[0] <= typical <= _DOUBLED[1]:
        constants = ", ".join(f'"{g.joint}" = {1 / abs(g.gain):.3g}' for g in known)
        also = f", and {signs}" if signs else ""
        return (
            f"The effort looks like a motor current or another unit, not like N·m{also}{_or_masses(typical, alike)}. "
            "To correct it: [log.units] "
            f'effort = "A", torque_constant_nm_per_a = {{ {constants} }} (by the model; the manufacturer knows '
            "the exact values), "
            f'or [fit] estimate = ["friction", "gain"].{mend}'
        )
    if _DOUBLED[0] <= typical <= _DOUBLED[1]:
        also = f" and {signs}" if signs else ""
        return (
            f"The effort looks like about twice the torque{also}, as when it is counted twice; or the model lacks half "
            f"of what moves.{mend}"
        )
    if signs:
        return f"The effort looks like a torque in N·m, but {signs}.{mend}"
    return "The effort looks like a torque in N·m." if unit == "Nm" else "The effort has the size of a torque in N·m."


def _or_masses(typical: float, alike: float) -> str:
    """All joints by one factor that masses on file can be off by."""
    if alike < _MOST or not 0.3 < typical < 3.0:
        return ""
    return f"; or all masses on file are too {'large' if typical < 1 else 'small'} by the same factor"


def _load(prepared: Prepared, gain: EffortGain) -> float:
    """Variance of the model torque of a joint: how much a joint has to say."""
    assert prepared.rigid_nm is not None
    column: FloatArray = prepared.rigid_nm[:, prepared.series.column(gain.joint)]
    return float(np.nanvar(column)) * gain.explained + 1e-12


def _steps(prepared: Prepared) -> list[Finding]:
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
    return Finding("effort-quantised", "warning", text, joint=joint)


def _step(effort: FloatArray) -> float | None:
    """The step of an effort that takes few different values, else None."""
    values = few_values(effort, min(_MOST_VALUES, effort.size // 5))
    if values is None or values.size < 3:
        return None
    gaps = np.diff(values)
    step = float(np.median(gaps))
    ratio = gaps / step
    return step if np.mean(np.abs(ratio - np.round(ratio)) < 0.02) > 0.95 else None
