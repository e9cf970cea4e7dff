"""Time offsets between channels: the shift at which effort follows the motion best, and the wrench the tool's pose."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from collaudit.core.config.schema import Config
from collaudit.core.findings import Finding
from collaudit.core.prepare import Prepared
from collaudit.core.runs import run_bounds
from collaudit.core.series import BoolArray, FloatArray, IntArray

_REACH_S = 0.1
_BLOCKS = 10
_UNSHARP_S = 0.03
_MAX_ROWS = 12_000
_MOVING = 0.02


@dataclass(frozen=True, slots=True)
class Delay:
    """How much later than the motion a channel is, s, with the interval from blocks of time."""

    seconds: float
    ci95: tuple[float, float]


def audit_delays(prepared: Prepared, config: Config) -> list[Finding]:
    """Findings on channels whose offset is clearly not zero, with the line that would correct it."""
    findings = []
    for delay, code, channel, key, on in (
        (effort_delay(prepared), "effort-delay", "effort", "effort_delay_ms", config.log.effort_delay_ms),
        (wrench_delay(prepared, config), "wrench-delay", "wrench", "wrench_delay_ms", config.log.wrench_delay_ms),
    ):
        if delay is None:
            continue
        low, high = delay.ci95
        size, span = f"{1e3 * abs(delay.seconds):.1f} ms", f"95 %: {1e3 * low:.1f} to {1e3 * high:.1f} ms"
        side = "behind" if delay.seconds > 0 else "ahead of"
        text = f"The {channel} is {size} {side} the motion ({span})"
        mend = f"To correct it: [log] {key} = {on + 1e3 * delay.seconds:.1f}."
        if high - low > _UNSHARP_S:
            findings.append(Finding(code, "info", f"{text}: too vague to tell an offset."))
        elif low <= 0 <= high or abs(delay.seconds) < 0.5 * prepared.series.period_s:
            findings.append(Finding(code, "info", f"{text}: no offset is shown."))
        elif delay.seconds < 0:
            why = "A velocity that the drive filters lags and looks like this"
            findings.append(Finding(code, "info", f"{text}. {why}. {mend}"))
        else:
            findings.append(Finding(code, "warning", f"{text}. {mend}"))
    return findings


def effort_delay(prepared: Prepared) -> Delay | None:
    """Delay of effort against the model torque of the motion; None without a model or enough motion.

    At each shift effort is regressed on model torque, sgn(v), v and a constant; the joints' sums of squares, each
    in units of its smallest, are added.
    """
    series = prepared.series
    if prepared.rigid_nm is None or series.effort is None:
        return None
    loaded = [series.column(g.joint) for g in prepared.gains if g.known]
    if not loaded:
        return None
    rigid, effort, v = prepared.rigid_nm, series.effort, series.velocity_rad_s
    known = np.isfinite(rigid).all(axis=1) & ~series.edge
    steady = {j: _steady(v[:, j], round(_REACH_S / series.period_s)) for j in loaded}
    known &= np.any([steady[j] for j in loaded], axis=0)

    def cost(every: IntArray, shift: int) -> FloatArray:
        out = []
        for j in loaded:
            rows = every[steady[j][every]]
            columns = np.column_stack([rigid[rows, j], np.sign(v[rows, j]), v[rows, j], np.ones(rows.size)])
            out.append(_left(columns, effort[rows + shift, j : j + 1]))
        return np.array(out)

    return _search(np.asarray(np.flatnonzero(known), dtype=np.int64), cost, series.period_s, effort[:, loaded])


def _steady(v: FloatArray, margin: int) -> BoolArray:
    """Samples around which a joint moves one way for ``margin`` samples: friction there is that of sliding."""
    out = np.zeros(v.size, dtype=bool)
    for mask in (v > _MOVING, v < -_MOVING):
        for start, stop in zip(*run_bounds(mask), strict=True):
            out[start + margin : max(start + margin, stop - margin)] = True
    return out


def wrench_delay(prepared: Prepared, config: Config) -> Delay | None:
    """Delay of the wrench's force against the turning of the sensor under gravity; None where it does not turn."""
    series, frame = prepared.series, config.log.wrench_frame
    if series.wrench is None or frame is None or prepared.robot.bodies is None:
        return None
    gravity = prepared.robot.gravity_in(series.position_rad, frame)
    force = series.wrench[:, :3]
    known = np.isfinite(gravity).all(axis=1) & np.isfinite(force).all(axis=1) & ~series.edge
    known &= np.isfinite(series.acceleration_rad_s2).all(axis=1)
    if not known.any() or float(np.std(gravity[known], axis=0).max()) < 1.0:
        return None
    moving = known & (np.abs(series.velocity_rad_s) > _MOVING).any(axis=1)

    def cost(rows: IntArray, shift: int) -> FloatArray:
        # the tool's inertia force is, pose by pose, linear in joint accelerations and squared speeds
        motion = (series.acceleration_rad_s2[rows], series.velocity_rad_s[rows] ** 2)
        columns = np.column_stack([gravity[rows], np.ones(rows.size), *motion])
        return np.array([_left(columns, force[rows + shift, k : k + 1]) for k in range(3)])

    return _search(np.asarray(np.flatnonzero(moving), dtype=np.int64), cost, series.period_s, force)


def _left(columns: FloatArray, target: FloatArray) -> float:
    if target.shape[0] <= columns.shape[1]:
        return 0.0
    found = np.linalg.lstsq(columns, target, rcond=None)[0]
    return float(np.sum((target - columns @ found) ** 2))


def _search(
    rows: IntArray, cost: Callable[[IntArray, int], FloatArray], period_s: float, channel: FloatArray
) -> Delay | None:
    """Best shift by a parabola through the smallest cost, in each block of time; mean and t interval over blocks."""
    reach = max(3, round(_REACH_S / period_s))
    finite = np.isfinite(channel).all(axis=1)
    ahead = np.concatenate([[0], np.cumsum(~finite)])
    rows = rows[(rows >= reach) & (rows < channel.shape[0] - reach)]
    rows = rows[ahead[rows + reach + 1] == ahead[rows - reach]]
    rows = rows[:: max(1, rows.size // _MAX_ROWS)]
    if rows.size < 40 * _BLOCKS:
        return None
    step = max(1, reach // 25)
    coarse = np.arange(-reach, reach + 1, step)
    total = np.array([cost(rows, int(k)) for k in coarse])
    scaled = (total / np.maximum(total.min(axis=0), 1e-30)).sum(axis=1)
    near = int(coarse[int(np.argmin(scaled))])
    shifts = np.arange(max(-reach, near - 2 * step - 2), min(reach, near + 2 * step + 2) + 1)
    weights = np.maximum(total.min(axis=0), 1e-30)
    best = []
    for part in np.array_split(rows, _BLOCKS):
        sums = np.array([(cost(part, int(k)) / weights).sum() for k in shifts])
        k = int(np.clip(np.argmin(sums), 1, shifts.size - 2))
        bend = sums[k - 1] - 2 * sums[k] + sums[k + 1]
        move = 0.5 * (sums[k - 1] - sums[k + 1]) / bend if bend > 0 else 0.0
        best.append((shifts[k] + float(np.clip(move, -1, 1))) * period_s)
    from scipy.stats import t

    values = np.array(best)
    middle = float(np.median(values))
    spread = 1.4826 * float(np.median(np.abs(values - middle)))
    # a block without acceleration says nothing of time: medians, and the efficiency of a median
    half = float(t.ppf(0.975, _BLOCKS - 1)) * 1.2533 * max(spread, 0.02 * period_s) / np.sqrt(_BLOCKS)
    return Delay(middle, (middle - half, middle + half))
