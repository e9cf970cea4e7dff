"""Friction points from constant-velocity sections: pairs of directions first (eq. 15), the model's torque second."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from collaudit.core.data.friction_result import FrictionPoint
from collaudit.core.data.uniform_series import UniformSeries
from collaudit.core.friction.gear_ripple import GearRipple, section_ripple, without_ripple
from collaudit.core.friction.sections import Section
from collaudit.core.numeric.arrays import FloatArray

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
    cost: float


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
        model_torque: (n, j) rigid-body torque along the log in the unit of the effort, or None.

    Returns:
        Points sorted by speed.
    """
    if not sections or series.effort is None:
        return ()
    j = series.column(sections[0].joint)
    points: list[FrictionPoint] = []
    used: set[int] = set()
    ripple = section_ripple(series, sections, j)
    effort = without_ripple(series, series.effort, sections, j, ripple)
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
    """Sections with one the other way through the same poses, each at most once: those that agree best first."""
    forward, backward = ([s for s in sections if s.velocity_rad_s * way > 0] for way in (1, -1))
    up, down = np.array([s.velocity_rad_s for s in forward])[:, None], np.array([-s.velocity_rad_s for s in backward])
    alike = np.argwhere(np.abs(up - down) <= _SPEED_TOLERANCE * 0.5 * (up + down))
    found = [_overlapping(series, forward[a], backward[b]) for a, b in alike.tolist()]
    candidates = [pair for pair in found if pair is not None]
    taken: set[int] = set()
    chosen = []
    for pair in sorted(candidates, key=lambda p: (p.cost, p.plus.span.start, p.minus.span.start)):
        own = {id(pair.plus), id(pair.minus)}
        if not taken & own and _same_poses(series, pair, j):
            taken |= own
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


def _overlapping(series: UniformSeries, plus: Section, minus: Section) -> _Pair | None:
    """Both ways of one speed as a pair where they share positions, and the other joints rest or move in both."""
    up, down = plus.velocity_rad_s, -minus.velocity_rad_s
    difference = abs(up - down) / (0.5 * (up + down))
    low = max(plus.position_rad[0], minus.position_rad[0])
    high = min(plus.position_rad[1], minus.position_rad[1])
    stroke = min(np.ptp(plus.position_rad), np.ptp(minus.position_rad))
    if stroke <= 0 or high - low < _MIN_OVERLAP * stroke or bool(plus.others_moving) != bool(minus.others_moving):
        return None
    distance_s = abs(plus.span.start - minus.span.start) * series.period_s
    cost = difference / _SPEED_TOLERANCE + (1.0 - (high - low) / stroke) + 1e-3 * distance_s
    return _Pair(plus, minus, low, high, cost)


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
    total = np.bincount(block, weights=torque[s, j][inside], minlength=edges.size - 1)
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
    friction = sign * (effort[s, j] - model_torque[s, j])
    if not np.isfinite(friction).all():
        return None
    speed = abs(section.velocity_rad_s)
    slope = _slope(series.position_rad[s, j], model_torque[s, j])
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
