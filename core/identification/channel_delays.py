"""Time offsets: effort against the motion, wrench against the tool's pose, velocity against position."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from collaudit.core.conditioning.velocity_choice import SAMPLES
from collaudit.core.config.schema import Config
from collaudit.core.data.uniform_series import MOVING_RAD_S, UniformSeries
from collaudit.core.findings import Finding
from collaudit.core.numeric.arrays import FloatArray, IntArray
from collaudit.core.prepare.effort.channel_shift import (
    all_known,
    basis_of,
    effort_shift,
    left_over,
    thinned,
)
from collaudit.core.prepare.effort.delay_estimate import Delay, Undetermined, best_shift
from collaudit.core.prepare.prepared import Prepared

_UNSHARP_S = 0.03
#: A delay, why there is none, or nothing to ask of.
Found = Delay | Undetermined | None


def audit_delays(prepared: Prepared, config: Config, effort: Found, wrench: Found) -> list[Finding]:
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
        if high - low > _UNSHARP_S:
            findings.append(Finding(code, "info", f"{text}: too uncertain to show an offset.{lag}"))
        elif not is_significant(delay, prepared.series.period_s):
            findings.append(Finding(code, "info", f"{text}: no offset beyond one sample is shown.{lag}"))
        else:
            mend = f"To correct it: [log] {key} = {on + 1e3 * delay.seconds:.1f}."
            findings.append(Finding(code, "warning" if delay.seconds > 0 else "info", f"{text}. {mend}{lag}"))
    return findings


def is_significant(delay: Delay, period_s: float) -> bool:
    """Whether an offset is shown: clearly not zero, and beyond what one sample's stamp leaves open."""
    low, high = delay.ci95
    return high - low <= _UNSHARP_S and not low <= 0 <= high and abs(delay.seconds) >= period_s


def effort_delay(prepared: Prepared) -> Found:
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


def wrench_delay(prepared: Prepared, config: Config) -> Found:
    """Delay of the wrench's force against the turning of the sensor under gravity; None where it does not turn."""
    series, frame = prepared.series, config.log.wrench_frame
    if series.wrench is None or frame is None or prepared.robot.bodies is None:
        return None
    force = series.wrench[:, :3]
    told = all_known([force])
    known = all_known([series.position_rad, series.acceleration_rad_s2]) & told & ~series.edge
    moving = np.zeros(known.size, dtype=np.bool_)
    for j in range(len(series.joint_names)):
        moving |= np.abs(series.velocity_rad_s[:, j]) > MOVING_RAD_S
    rows = thinned(np.flatnonzero(known & moving), series, told)
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
