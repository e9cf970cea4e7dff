"""Friction points from constant-velocity sections: pairs of directions first (eq. 15), the model's torque second."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np

from collaudit.core.data.friction_result import FrictionPoint
from collaudit.core.data.joint_log import UniformSeries
from collaudit.core.friction.gear_ripple import GearRipple, section_ripple, without_ripple
from collaudit.core.friction.sections import Section
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray

#: Both directions of a pair have speeds that differ by at most this share, as much as one section's own may.
_SPEED_TOLERANCE = 0.05
#: Other joints within this are in the same pose (rad; m if prismatic): gravity's torque then differs by 5 % at most.
_POSE_TOLERANCE_RAD = 0.05
_MIN_OVERLAP = 0.5  # share of the shorter section's stroke that both directions must cover
_MIN_BLOCKS = 3
#: Effort and position may be up to half a sample apart in time: a drive that holds its torque until the next sample is
#: half of one early in all that it logs, one that averages or waits as much late. Standard deviation in samples, early,
#: on time and late being equally likely. What gravity changes in that time has the sign of the motion, as friction has.
SIMULTANEOUS = 6.0**-0.5
#: Fewer pairs do not show a law; one or two among points of the model's would count as precise ones among rough.
_ENOUGH = 5
_PLACES = 400  # at which the mean of ripple over a stroke is taken
_BLOCKS = 12  # blocks of positions (pairs) or time (model) for the standard error


@dataclass(frozen=True, slots=True)
class _Pair:
    plus: Section
    minus: Section
    low_rad: float
    high_rad: float


@dataclass(frozen=True, slots=True)
class _Ways:
    """Sections of one joint in one direction: (m,) speed, range of positions, first sample, whether others move.

    ``least`` and ``most`` (m, j) are the ranges of all joints' positions.
    """

    speed: FloatArray
    low: FloatArray
    high: FloatArray
    start: IntArray
    others_moving: BoolArray
    least: FloatArray
    most: FloatArray

    @classmethod
    def of(cls, series: UniformSeries, sections: Sequence[Section]) -> _Ways:
        low, high = np.array([s.position_rad for s in sections]).T
        poses = [series.position_rad[s.span.slice] for s in sections]
        return cls(
            np.array([abs(s.velocity_rad_s) for s in sections]),
            low,
            high,
            np.array([s.span.start for s in sections]),
            np.array([bool(s.others_moving) for s in sections]),
            np.array([pose.min(axis=0) for pose in poses]),
            np.array([pose.max(axis=0) for pose in poses]),
        )

    def some(self, rows: IntArray) -> _Ways:
        """Some of them, by number."""
        return _Ways(*(getattr(self, field.name)[rows] for field in fields(self)))


def friction_points(
    series: UniformSeries, sections: Sequence[Section], model_torque: FloatArray | None
) -> tuple[FrictionPoint, ...]:
    """Friction against speed for one joint.

    Sections of equal speed, opposite direction, the same positions and the same pose of the other joints
    give ``(tau+ - tau-)/2`` (eq. 15): gravity cancels and no model is needed. So do a move of several joints and the
    way back along it: what is even in the speeds, as the torques of Coriolis are, cancels too. What stays without a
    partner gives ``sgn(v)·(tau - tau_model)`` where a model torque is at hand, marked ``model``. Ripple of the gear
    that the sections show together is taken off first, and its error goes into each point's.

    Args:
        series: the log on its uniform time base.
        sections: of one joint.
        model_torque: (n,) torque that the model explains along the log, in the unit of the effort, or None.

    Returns:
        Points sorted by speed.
    """
    if not sections or series.effort is None:
        return ()
    j = series.column(sections[0].joint)
    points: list[FrictionPoint] = []
    used: set[int] = set()
    ripple = section_ripple(series, sections, j)
    effort = without_ripple(series, series.effort[:, j], sections, j, ripple)
    for pair in _pairs(series, sections, j):
        point = _pair_point(series, effort, model_torque, pair, j, ripple)
        if point is not None:
            points.append(point)
            used |= {id(pair.plus), id(pair.minus)}
    if model_torque is not None:
        loose = [_model_point(series, effort, s, model_torque, j, ripple) for s in sections if id(s) not in used]
        points += [point for point in loose if point is not None]
    return tuple(sorted(points, key=lambda p: p.speed_rad_s))


def _pairs(series: UniformSeries, sections: Sequence[Section], j: int) -> list[_Pair]:
    """Sections with one the other way through the same poses, each at most once: those that agree best first.

    Both have one speed, share positions, and the other joints rest, or move, in both.
    """
    forward, backward = ([s for s in sections if s.velocity_rad_s * way > 0] for way in (1, -1))
    if not forward or not backward:
        return []
    up, down = (_Ways.of(series, its) for its in (forward, backward))
    apart = np.abs(up.speed[:, None] - down.speed) / (0.5 * (up.speed[:, None] + down.speed))
    plus, minus = np.nonzero(apart <= _SPEED_TOLERANCE)
    up, down = up.some(plus), down.some(minus)
    low, high = np.maximum(up.low, down.low), np.minimum(up.high, down.high)
    stroke = np.minimum(up.high - up.low, down.high - down.low)
    fits = (stroke > 0) & (high - low >= _MIN_OVERLAP * stroke) & (up.others_moving == down.others_moving)
    fits &= (np.maximum(up.least, down.least) - np.minimum(up.most, down.most) <= _POSE_TOLERANCE_RAD).all(axis=1)
    cost = apart[plus, minus] / _SPEED_TOLERANCE + 1e-3 * series.period_s * np.abs(up.start - down.start)
    cost -= (high - low) / np.where(fits, stroke, 1.0)
    chosen, free = list[_Pair](), (np.ones(len(forward), np.bool_), np.ones(len(backward), np.bool_))
    order = np.lexsort((down.start, up.start, cost))
    for k in order[fits[order]].tolist():
        ends = plus[k], minus[k]
        if not (free[0][ends[0]] and free[1][ends[1]]):
            continue
        pair = _Pair(forward[ends[0]], backward[ends[1]], float(low[k]), float(high[k]))
        if _same_poses(series, pair, j):
            free[0][ends[0]] = free[1][ends[1]] = False
            chosen.append(pair)
    return chosen if len(chosen) >= _ENOUGH else [pair for pair in chosen if not pair.plus.others_moving]


def _same_poses(series: UniformSeries, pair: _Pair, j: int) -> bool:
    """Whether all joints pass the same positions both ways, at all positions of joint j that both ways share."""
    middles = 0.5 * (_edges(pair)[1:] + _edges(pair)[:-1])
    ways = []
    for section in (pair.plus, pair.minus):
        rows = series.position_rad[section.span.slice]
        rows = rows[np.argsort(rows[:, j], kind="stable")]
        ways.append(np.array([np.interp(middles, rows[:, j], rows[:, k]) for k in range(rows.shape[1])]))
    return bool(np.max(np.abs(ways[0] - ways[1])) <= _POSE_TOLERANCE_RAD)


def _pair_point(
    series: UniformSeries,
    effort: FloatArray,
    model_torque: FloatArray | None,
    pair: _Pair,
    j: int,
    ripple: GearRipple | None,
) -> FrictionPoint | None:
    """Half the difference of both directions, block by block of position; None where too few blocks are common.

    Speed is not quite constant: it settles after a ramp, alike in both
    directions, which half the difference takes for friction and no scatter shows. Where the model is known, what it
    needs for that is taken off.
    """
    edges = _edges(pair)
    (plus, fast), (minus, slow) = (_by_position(series, effort, s, j, edges) for s in (pair.plus, pair.minus))
    friction, gravity, speed = 0.5 * (plus - minus), 0.5 * (plus + minus), 0.5 * (fast + slow)
    if model_torque is not None:
        ahead, back = (_by_position(series, model_torque, s, j, edges)[0] for s in (pair.plus, pair.minus))
        friction = friction - np.nan_to_num(0.5 * (ahead - back))
    known = np.isfinite(friction)
    friction = friction[known]
    if friction.size < _MIN_BLOCKS:
        return None
    middles = 0.5 * (edges[1:] + edges[:-1])
    slope = _slope(middles[known], gravity[known])
    waves = 0.0
    if ripple is not None:
        places = np.linspace(pair.low_rad, pair.high_rad, _PLACES)
        waves = ripple.sd(0.5 * (ripple.gradient(places, 1.0) - ripple.gradient(places, -1.0)))
    return FrictionPoint(
        speed_rad_s=speed,
        friction_nm=float(np.mean(friction)),
        sd_nm=_sd(friction),
        se_nm=float(np.hypot(_sd(friction) / np.sqrt(friction.size), waves)),
        source="pair",
        direction=0,
        others_moving=bool(pair.plus.others_moving or pair.minus.others_moving),
        timing_nm=slope * speed * SIMULTANEOUS * series.period_s,
        seconds=min(len(pair.plus.span), len(pair.minus.span)) * series.period_s,
    )


def _edges(pair: _Pair) -> FloatArray:
    """Of blocks of position; fewer where slow sampling leaves few samples a section, so that each has some of both."""
    shorter = min(len(pair.plus.span), len(pair.minus.span))
    return np.linspace(pair.low_rad, pair.high_rad, min(_BLOCKS, max(_MIN_BLOCKS, shorter // 3)) + 1)


def _slope(x: FloatArray, y: FloatArray) -> float:
    """Slope of a straight line; 0 where there is nothing to draw it through."""
    x = x - x.mean()
    power = float(x @ x)
    return float(x @ y) / power if power > 0 else 0.0


def _by_position(
    series: UniformSeries, torque: FloatArray, section: Section, j: int, edges: FloatArray
) -> tuple[FloatArray, float]:
    """Mean torque in each block of positions (NaN where a block is empty), and the mean speed inside."""
    s = section.span.slice
    position = series.position_rad[s, j]
    inside = (position >= edges[0]) & (position <= edges[-1])
    block = np.clip(np.searchsorted(edges, position[inside], side="right") - 1, 0, edges.size - 2)
    count = np.bincount(block, minlength=edges.size - 1)
    total = np.bincount(block, weights=torque[s][inside], minlength=edges.size - 1)
    with np.errstate(invalid="ignore"):
        means = np.where(count > 0, total / count, np.nan)
    return means, float(np.mean(np.abs(series.velocity_rad_s[s, j][inside]))) if inside.any() else 0.0


def _model_point(
    series: UniformSeries,
    effort: FloatArray,
    section: Section,
    model_torque: FloatArray,
    j: int,
    ripple: GearRipple | None,
) -> FrictionPoint | None:
    s = section.span.slice
    sign = 1 if section.velocity_rad_s > 0 else -1
    friction = sign * (effort[s] - model_torque[s])
    if not np.isfinite(friction).all():
        return None
    speed = abs(section.velocity_rad_s)
    slope = _slope(series.position_rad[s, j], model_torque[s])
    waves = 0.0
    if ripple is not None:
        waves = ripple.sd(ripple.gradient(np.linspace(*section.position_rad, _PLACES), section.velocity_rad_s))
    edges = np.linspace(0, friction.size, min(_BLOCKS, friction.size) + 1).astype(np.int64)
    blocks = np.add.reduceat(friction, edges[:-1]) / np.diff(edges)
    return FrictionPoint(
        speed_rad_s=speed,
        friction_nm=float(np.mean(friction)),
        sd_nm=_sd(blocks),
        se_nm=float(np.hypot(_sd(blocks) / np.sqrt(blocks.size), waves)),
        source="model",
        direction=sign,
        others_moving=bool(section.others_moving),
        timing_nm=slope * speed * SIMULTANEOUS * series.period_s,
        seconds=friction.size * series.period_s,
    )


def _sd(x: FloatArray) -> float:
    return float(np.std(x, ddof=1)) if x.size > 1 else 0.0
