"""By how much a channel is stamped late: what it is compared with, shift by shift; a stated delay taken off."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from collaudit.core.conditioning.velocity_choice import SAMPLES
from collaudit.core.config.schema import LogConfig
from collaudit.core.data.joint_log import MOVING_RAD_S, UniformSeries
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray
from collaudit.core.numeric.filters import differentiate, low_pass
from collaudit.core.numeric.parallel import ordered_map
from collaudit.core.prepare.channel_delay import Delay, Undetermined, best_shift, reach
from collaudit.core.robot.robot_model import RobotModel
from collaudit.core.torque_table.block_sums import squares_left
from collaudit.core.torque_table.log_samples import sliding

_STEADY_S = 0.1
_MAX_ROWS = 12_000


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
