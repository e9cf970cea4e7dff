"""By how much a channel is stamped late, with an interval that holds, or why nothing tells; a stated delay taken off.

A shift is told by how much more a channel is left unexplained at any other. That is tested over the whole reach, block
of time against block: a channel that carries nothing, or a motion that repeats itself, has other shifts that are as
good, and is not determined. The interval is that of a jackknife over the blocks (Efron, "The jackknife, the bootstrap
and other resampling plans", 1982), with Student's t for as many blocks as carry the knowledge.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import stdtrit as student_quantile

from collaudit.core.conditioning.velocity_choice import SAMPLES
from collaudit.core.config.schema import LogConfig
from collaudit.core.data.joint_log import MOVING_RAD_S, UniformSeries
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray, run_bounds
from collaudit.core.numeric.filters import differentiate, low_pass
from collaudit.core.numeric.parallel import ordered_map
from collaudit.core.numeric.stats import parabola_minimum
from collaudit.core.robot.robot_model import RobotModel
from collaudit.core.torque_table.block_sums import squares_left
from collaudit.core.torque_table.log_samples import sliding

_STEADY_S = 0.1
_MAX_ROWS = 12_000
_REACH_S = (-0.2, 0.7)
_COARSE_S = 0.01
_BLOCKS = 12
_LEAST_ROWS = 400
#: Standard errors by which a shift must be worse than the best to be out of the question.
_WORSE = 2.2
#: A range of shifts as good as the best that is longer than this tells nothing, s.
_WIDEST_S = 0.15
#: No interval is narrower than this on either side, in samples: stamps are not better.
_FINEST = 0.05
_LEAST_BLOCKS = 4.0
#: Share of Student's t by which a shift must be worse to be outside the interval; a half is exact where costs are
#: quadratic, but slow motion with noise that lasts makes them wavy (measured: 86 % instead of 95).
_OPEN = 0.65
#: Shifts at which the curve about its minimum is looked at, at least.
_POINTS = 24
#: Of some samples (their numbers): the sums of squares (s, k) at shifts (s,) in samples of the grid.
Costs = Callable[[IntArray], Callable[[IntArray], FloatArray]]


def effort_shift(
    series: UniformSeries, robot: RobotModel, joints: Sequence[str], contact: FloatArray | None
) -> Delay | Undetermined | None:
    """Delay of effort against the model torque of the motion; None without enough motion.

    At each shift effort is regressed on model torque, sgn(v), v and a constant; the joints' sums of squares, each
    in units of its smallest, are added. Velocity and acceleration are those of the positions: a logged velocity that
    the drive filters is itself late.

    Args:
        series: the log, with effort.
        robot: with inertials.
        joints: whose efforts count.
        contact: (n, j) torque of the commanded tool force, or None.
    """
    if series.effort is None or not joints:
        return None
    effort = series.effort
    loaded = [j for j in map(series.column, joints) if np.nanstd(effort[:, j]) > 0]
    if not loaded:
        return None
    v = position_velocity(series)
    acceleration = differentiate(v, series.segments, series.period_s)
    known = all_known([series.position_rad, v, acceleration, *([] if contact is None else [contact])])
    known &= ~series.edge
    margin = round(_STEADY_S / series.period_s)
    masks = ordered_map(
        lambda j: sliding(series.segments, series.position_rad[:, j], v[:, j], MOVING_RAD_S, margin), loaded
    )
    slides = dict(zip(loaded, masks, strict=True))
    recorded = all_known([effort], loaded)
    rows = thinned(np.flatnonzero(known & np.any([slides[j] for j in loaded], axis=0)), series, recorded)
    if rows.size == 0:
        return None
    rigid = robot.inverse_dynamics(*(np.ascontiguousarray(x[rows]) for x in (series.position_rad, v, acceleration)))
    if contact is not None:
        rigid = rigid + contact[rows]

    def costs(pick: IntArray) -> Callable[[IntArray], FloatArray]:
        parts = []
        for j in loaded:
            use = pick[slides[j][rows[pick]]]
            speed = v[rows[use], j]
            columns = np.column_stack([rigid[use, j], np.sign(speed), speed, np.ones(use.size)])
            parts.append((columns, rows[use], np.ascontiguousarray(effort[:, j])))
        return lambda shifts: np.column_stack([squares_left(x, y[at[:, None] + shifts]) for x, at, y in parts])

    return best_shift(rows.size, costs, series.period_s)


def position_velocity(series: UniformSeries) -> FloatArray:
    """(n, j) velocity from the positions alone, filtered as the logged one is; its slope is the acceleration."""
    raw = differentiate(series.position_rad, series.segments, series.period_s)
    return low_pass(raw, series.segments, series.period_s, series.bandwidth_hz)


def prompt_motion(series: UniformSeries) -> tuple[FloatArray, FloatArray]:
    """(n, j) velocity and acceleration: the logged ones, or those of the positions where the logged velocity lags.

    A velocity that is a few milliseconds late makes inertia look like friction, and drive gains wrong by per cents.
    """
    late = series.velocity_lag_s
    if late is None or late < SAMPLES * series.period_s:
        return series.velocity_rad_s, np.asarray(series.acceleration_rad_s2)
    v = position_velocity(series)
    return v, differentiate(v, series.segments, series.period_s)


def all_known(tables: Sequence[FloatArray], columns: Sequence[int] | None = None) -> BoolArray:
    """(n,) whether all values of a sample are finite: of all columns of the tables, or of some."""
    out = np.ones(tables[0].shape[0], dtype=np.bool_)
    for table in tables:
        for j in range(table.shape[1]) if columns is None else columns:
            out &= np.isfinite(table[:, j])
    return out


def thinned(rows: IntArray, series: UniformSeries, recorded: BoolArray) -> IntArray:
    """At most ``_MAX_ROWS`` of the rows, none without the channel, (n,) told, within reach of the shifts."""
    back, ahead = reach(series.period_s)
    holes = np.concatenate([[0], np.cumsum(~recorded)])
    rows = rows[(rows + back >= 0) & (rows + ahead < recorded.size)]
    rows = rows[holes[rows + ahead + 1] == holes[rows + back]]
    return np.asarray(rows[:: max(1, rows.size // _MAX_ROWS)], dtype=np.int64)


def undelayed(series: UniformSeries, config: LogConfig) -> UniformSeries:
    """The series with effort and wrench moved to the time of the motion they belong to.

    Values are interpolated between samples; within a delay of a gap nothing is known.

    Args:
        series: the log on its uniform time base.
        config: the delays, ms; positive when the channel is stamped late.
    """
    if series.effort is not None and config.effort_delay_ms:
        series = replace(series, effort=moved(series.effort, series, 1e-3 * config.effort_delay_ms))
    if series.wrench is not None and config.wrench_delay_ms:
        series = replace(series, wrench=moved(series.wrench, series, 1e-3 * config.wrench_delay_ms))
    return series


def moved(values: FloatArray, series: UniformSeries, delay_s: float) -> FloatArray:
    """(n, k) values at their times plus a delay, s; NaN within it of a gap."""
    out = np.full_like(values, np.nan)
    steps = delay_s / series.period_s
    for span in series.segments:
        part = values[span.slice]
        at = np.arange(len(span)) + steps
        low = np.floor(at).astype(np.int64)
        inside = (low >= 0) & (low + 1 < len(span))
        share = (at - low)[inside, None]
        moved = np.full_like(part, np.nan)
        moved[inside] = (1.0 - share) * part[low[inside]] + share * part[low[inside] + 1]
        out[span.slice] = moved
    return out


@dataclass(frozen=True, slots=True)
class Delay:
    """How much later than the motion a channel is, s, with the interval from blocks of time."""

    seconds: float
    ci95: tuple[float, float]


@dataclass(frozen=True, slots=True)
class Undetermined:
    """A delay that the log does not determine; why, in words."""

    why: str


def best_shift(count: int, costs: Costs, period_s: float) -> Delay | Undetermined | None:
    """The shift of the smallest cost, if the log's blocks agree that there is one.

    Args:
        count: number of samples, in order of time.
        costs: sums of squares to be made small.
        period_s: of the grid.

    Returns:
        The delay; why it is not determined; None with too few samples to ask.
    """
    if count < _LEAST_ROWS:
        return None
    back, ahead = reach(period_s)
    step = max(1, round(_COARSE_S / period_s))
    coarse = np.arange(back, ahead + 1, step)
    blocks = [costs(part) for part in np.array_split(np.arange(count), _BLOCKS)]
    table = np.array([cost(coarse) for cost in blocks])  # (blocks, shifts, targets)
    weight = np.maximum(table.sum(axis=0).min(axis=0), 1e-30)
    curve = (table / weight).sum(axis=2)
    near, alike = int(np.argmin(curve.sum(axis=0))), _alike(curve, _WORSE)
    starts, stops = run_bounds(alike)
    around = int(np.searchsorted(starts, near, side="right")) - 1
    first, last = int(starts[around]), int(stops[around]) - 1
    why = _ambiguity(curve, near, (first, last), alike, np.asarray(coarse * period_s, dtype=np.float64))
    if why:
        return Undetermined(why)
    # wide enough for what leaving out a block can do: a minimum at the window's end would pass for a certain one
    low, high = int(coarse[first]) - 2 * step - 2, int(coarse[last]) + 2 * step + 2
    shifts = np.arange(max(back, low), min(ahead, high) + 1, max(1, (high - low) // _POINTS))
    fine = np.array([(cost(shifts) / weight).sum(axis=1) for cost in blocks])
    return _jackknifed(fine, shifts, period_s)


def reach(period_s: float) -> tuple[int, int]:
    """First and last shift looked at, in samples."""
    back, ahead = (round(x / period_s) for x in _REACH_S)
    return min(back, -3), max(ahead, 3)


def _alike(curve: FloatArray, errors: float) -> BoolArray:
    """(shifts,) where the blocks' costs (blocks, shifts) are not so many standard errors above those of the best shift.

    Where costs are quadratic, an estimate off by k standard errors makes the true shift worse by k / 2 of its own.
    """
    worse = curve - curve[:, [int(np.argmin(curve.sum(axis=0)))]]
    error = np.std(worse, axis=0, ddof=1) / np.sqrt(curve.shape[0])
    return np.asarray(worse.mean(axis=0) <= errors * error)


def _ambiguity(curve: FloatArray, near: int, around: tuple[int, int], alike: BoolArray, shifts_s: FloatArray) -> str:
    """Why the best of the shifts is not the only one; empty where it is.

    Args:
        curve: (blocks, shifts) costs.
        near: number of the smallest; ``around`` first and last without a break that are as good.
        alike: (shifts,) which are as good.
        shifts_s: (shifts,) s.
    """
    first, last = around
    low_ms, high_ms = 1e3 * shifts_s[first], 1e3 * shifts_s[last]
    if near in (0, alike.size - 1):
        return f"no shift between {1e3 * shifts_s[0]:.0f} and {1e3 * shifts_s[-1]:.0f} ms is the best"
    if high_ms - low_ms > 1e3 * _WIDEST_S:
        return (
            f"shifts from {low_ms:.0f} to {high_ms:.0f} ms explain it equally well: it carries too little of the motion"
        )
    cost = np.where(alike, curve.sum(axis=0), np.inf)
    cost[first : last + 1] = np.inf
    if np.isfinite(cost).any():
        return (
            f"a shift of {1e3 * shifts_s[np.argmin(cost)]:.0f} ms explains it as well as one of "
            f"{1e3 * shifts_s[near]:.0f} ms: the motion repeats itself, or the channel carries too little of it"
        )
    return ""


def _jackknifed(fine: FloatArray, shifts: IntArray, period_s: float) -> Delay | Undetermined:
    """The minimum of the summed curves (blocks, shifts), and its interval from leaving out each block in turn."""
    total = fine.sum(axis=0)
    if np.argmin(total) in (0, shifts.size - 1):
        return Undetermined("no single shift is the best")
    best = _minimum(total, shifts)
    without = np.array([_minimum(total - part, shifts) for part in fine])
    k = int(np.clip(np.argmin(total), 1, shifts.size - 2))
    bend = np.maximum(fine[:, k - 1] - 2.0 * fine[:, k] + fine[:, k + 1], 0.0)
    share = bend / max(float(bend.sum()), 1e-300)
    carry = 1.0 / max(float(share @ share), 1e-12)
    if carry < _LEAST_BLOCKS:
        return Undetermined("one short stretch of the motion carries all that is known of it")
    count = fine.shape[0]
    error = float(np.sqrt((count - 1) / count * np.sum((without - best) ** 2)))
    half = max(float(student_quantile(carry - 1.0, 0.975)) * error, _FINEST) * period_s
    quantile = float(student_quantile(count - 1, 0.975))
    first, last = period_s * shifts[np.flatnonzero(_alike(fine, _OPEN * quantile))[[0, -1]]]
    return Delay(best * period_s, (min(best * period_s - half, float(first)), max(best * period_s + half, float(last))))


def _minimum(curve: FloatArray, shifts: IntArray) -> float:
    """Where a curve is smallest, by a parabola through the three lowest values, in samples."""
    k = int(np.clip(np.argmin(curve), 1, shifts.size - 2))
    move = float(parabola_minimum(*curve[k - 1 : k + 2]))
    return float(shifts[k]) + float(np.clip(move, -1.0, 1.0)) * float(shifts[1] - shifts[0])
