"""Friction points from arbitrary motion: what the model leaves, in bins of speed and direction; when they are used."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from collaudit.core.data.friction_result import FrictionPoint
from collaudit.core.data.uniform_series import MOVING_RAD_S, UniformSeries
from collaudit.core.friction.friction_model import FrictionModel
from collaudit.core.numeric.arrays import FloatArray, IntArray
from collaudit.core.numeric.filters import differentiate, low_pass
from collaudit.core.numeric.stats import quantile_of
from collaudit.core.prepare.effort.channel_shift import steady
from collaudit.core.prepare.prepared import Prepared

_BINS = 14
_MIN_STRETCHES = 4
_SETTLED_S = 0.1
_STRETCH_S = 1.0
#: Speeds closer than this ratio are one speed.
_DISTINCT = 1.1
#: As many distinct speeds show how friction goes with speed; with fewer, any other source that has more is better.
_ENOUGH = 5
#: Pairs of directions are free of the model's errors: they are kept over any motion at this much less of the time.
_GAIN, _GAIN_OVER_PAIRS = 0.1, 0.3
#: Between speeds further apart than this ratio friction is not known: its fall from breakaway lies within one.
_GAP = 3.0
_MARGIN = 1.05  # friction is used a little beyond the speeds it was measured at


def motion_points(prepared: Prepared, joint: str) -> tuple[FrictionPoint, ...]:
    """Points (speed, friction) of one joint from all its settled motion, each direction by itself.

    Friction is the effort less the torque that reaches the link. The standard error is from the scatter between
    stretches of one second, since neighbouring samples err alike.

    Args:
        prepared: a log with effort in torque units, and a model torque or a joint torque sensor; none give no points.
        joint: its name.
    """
    series = prepared.series
    known = prepared.gear_torque(joint)
    if known is None or series.effort is None:
        return ()
    j = series.column(joint)
    if prepared.sensed(joint):  # as noisy as the effort
        known = low_pass(known[:, None], series.segments, series.period_s, series.bandwidth_hz)[:, 0]
    effort = low_pass(series.effort[:, j : j + 1], series.segments, series.period_s, series.bandwidth_hz)[:, 0]
    unexplained = np.subtract(effort, known, out=effort)
    rows = _settled_rows(series, j, unexplained)
    if rows.size == 0:
        return ()
    velocity = series.velocity_rad_s[:, j][rows]
    _, second = np.unique(np.floor(series.time_s[rows] / _STRETCH_S), return_inverse=True)
    return _points(velocity, np.sign(velocity) * unexplained[rows], second)


def _points(velocity: FloatArray, friction: FloatArray, second: IntArray) -> tuple[FrictionPoint, ...]:
    """Points of (m,) samples, forward ones first: one a bin of speeds that enough seconds have."""
    speed = np.abs(velocity)
    edges = np.geomspace(max(MOVING_RAD_S, quantile_of(speed, 0.02)), float(speed.max()) * 1.0001, _BINS + 1)
    bins = np.searchsorted(edges, speed, side="right")
    points = []
    for direction in (1, -1):
        way = np.sign(velocity) == direction
        for number in range(1, _BINS + 1):
            inside = np.flatnonzero(way & (bins == number))
            count = np.bincount(second[inside])
            total = np.asarray(np.bincount(second[inside], friction[inside]), dtype=np.float64)
            if np.count_nonzero(count) >= _MIN_STRETCHES:
                points.append(_point(speed[inside], friction[inside], count[count > 0], total[count > 0], direction))
    return tuple(points)


@dataclass(frozen=True, slots=True, eq=False)
class Settled:
    """Settled samples of one joint, each (n,).

    Attributes:
        time_s, position: when and where.
        residual: torque that model and friction leave, not filtered: ripple passes at the speed of the motion.
        friction: as fitted, signed.
        speed: of the joint.
        torque_rate: N·m/s, of the model's torque and the tool's: what an effort stamped late is off by, a second.
        load: size of the model's torque and the tool's: what the gear carries.
        temperature: of the joint, °C; None without such a channel.
        torque: the model's and the tool's, with its sign.
    """

    time_s: FloatArray
    position: FloatArray
    residual: FloatArray
    friction: FloatArray
    speed: FloatArray
    torque_rate: FloatArray
    load: FloatArray
    temperature: FloatArray | None
    torque: FloatArray


def settled_residual(prepared: Prepared, joint: str, law: FrictionModel) -> Settled | None:
    """Settled samples of one joint against its friction law; None without a model torque or motion."""
    series, known = prepared.series, prepared.explained_nm(joint)
    if known is None or series.effort is None:
        return None
    j = series.column(joint)
    v = series.velocity_rad_s[:, j]
    heat = None if series.temperature_c is None else series.temperature_c[:, j]
    if heat is not None and not np.isfinite(heat).any():
        heat = None
    rows = _settled_rows(series, j, series.effort[:, j], known, *([] if heat is None else [heat]))
    velocity, torque = v[rows], known[rows]
    friction = law.torque(velocity)
    left = series.effort[:, j][rows] - torque - friction
    if rows.size == 0 or not np.isfinite(left.sum()):
        return None
    return Settled(
        time_s=series.time_s[rows],
        position=series.position_rad[:, j][rows],
        residual=left,
        friction=friction,
        speed=np.abs(velocity),
        torque_rate=np.nan_to_num(differentiate(known, series.segments, series.period_s)[rows]),
        load=np.abs(torque),
        temperature=None if heat is None else heat[rows],
        torque=torque,
    )


def _settled_rows(series: UniformSeries, j: int, *needed: FloatArray) -> IntArray:
    """Samples at which a joint has moved one way for a while, and will, and all that is needed is known.

    Args:
        series: the log.
        j: the joint's column.
        needed: (n,) each.
    """
    rows = steady(series.velocity_rad_s[:, j], MOVING_RAD_S, round(_SETTLED_S / series.period_s))
    rows &= ~(series.edge | series.saturated[:, j])
    for column in needed:
        rows &= np.isfinite(column)
    return np.flatnonzero(rows)


def clustered_error(mean: float, count: IntArray, total: FloatArray) -> float:
    """Standard error of a mean whose errors within a cluster are alike (cluster-robust, G/(G - 1) clusters).

    Args:
        mean: of all values.
        count, total: (g,) number and sum of the values of each cluster; two clusters at least.
    """
    score = total - mean * count  # ratio estimator of a mean over clusters of unequal size
    return float(np.sqrt(count.size / (count.size - 1) * np.sum(score**2))) / int(count.sum())


def _point(speed: FloatArray, friction: FloatArray, count: IntArray, total: FloatArray, sign: int) -> FrictionPoint:
    mean = float(friction.mean())
    return FrictionPoint(
        speed_rad_s=float(speed.mean()),
        friction_nm=mean,
        sd_nm=float(np.std(friction, ddof=1)),
        se_nm=clustered_error(mean, count, total),
        source="model",
        direction=sign,
        others_moving=True,
    )


def distinct_speeds(points: Sequence[FrictionPoint]) -> int:
    """Number of speeds that differ by more than a tenth."""
    count, start = 0, 0.0
    for speed in sorted(p.speed_rad_s for p in points):
        if speed > _DISTINCT * start:
            count, start = count + 1, speed
    return count


def moving_speeds(prepared: Sequence[Prepared], joint: str) -> FloatArray:
    """(n,) speeds of a joint while it moves, over all logs."""
    parts = []
    for log in prepared:
        if joint in log.judged:
            speed = np.abs(log.series.velocity_rad_s[:, log.series.column(joint)])
            parts.append(speed[speed > MOVING_RAD_S])
    return np.concatenate(parts) if parts else np.empty(0)


def covered(points: Sequence[FrictionPoint], speeds: FloatArray) -> float:
    """Share of the moving time whose speed lies within the range of the points, and in no gap of it."""
    if not points or speeds.size == 0:
        return 0.0
    measured = np.unique([p.speed_rad_s for p in points])
    known = (speeds >= measured[0] / _MARGIN) & (speeds <= measured[-1] * _MARGIN)
    for below, above in pairwise(measured):
        if above > _GAP * below:
            known &= (speeds <= below * _MARGIN) | (speeds >= above / _MARGIN)
    return float(np.mean(known))


def any_motion_tells_more(
    sections: Sequence[FrictionPoint], motion: Sequence[FrictionPoint], speeds: FloatArray
) -> bool:
    """Whether arbitrary motion shows friction at more speeds, or over more of the speeds used, than sections do.

    Args:
        sections: points of constant speed.
        motion: points of arbitrary motion; they rely on the robot model.
        speeds: (n,) speeds that the joint moves at.
    """
    here, there = distinct_speeds(sections), distinct_speeds(motion)
    if there < 3:
        return False
    if here < _ENOUGH:
        return there > here
    paired = sum(p.source == "pair" for p in sections) >= _ENOUGH
    return covered(motion, speeds) - covered(sections, speeds) > (_GAIN_OVER_PAIRS if paired else _GAIN)


def beyond(motion: Sequence[FrictionPoint], sections: Sequence[FrictionPoint]) -> list[FrictionPoint]:
    """Sections slower or faster than what arbitrary motion shows: rare speeds that no bin of it holds."""
    if not motion:
        return []
    speeds = [p.speed_rad_s for p in motion]
    low, high = min(speeds) / _DISTINCT, max(speeds) * _DISTINCT
    return [p for p in sections if not low <= p.speed_rad_s <= high]
