"""Friction points from arbitrary motion: what the model leaves, in bins of speed and direction; when they are used."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from collaudit.core.data.friction_result import FrictionPoint
from collaudit.core.data.joint_log import MOVING_RAD_S, UniformSeries
from collaudit.core.friction.friction_model import FrictionModel
from collaudit.core.friction.friction_points import SIMULTANEOUS
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray
from collaudit.core.numeric.filters import differentiate, low_pass
from collaudit.core.numeric.stats import quantile_of
from collaudit.core.prepare.prepared import Prepared
from collaudit.core.torque_table.block_sums import estimate
from collaudit.core.torque_table.log_samples import one_way, settled

#: Bins of speeds of either direction, each with so many pieces of strokes at least; a piece is no longer than this, s.
_BINS, _LEAST_PIECES, _PIECE_S = 14, 3, 1.0
_SETTLED_S = 0.1
#: The variance of a bin that has few pieces is drawn towards that of the others, which counts as so many pieces.
_PRIOR_PIECES = 8
#: Share by which an offset of a log is held at 0: it decides what a single direction of motion leaves open.
_OFFSET_HELD = 1e-6
#: Speeds closer than this ratio are one speed.
_DISTINCT = 1.1
#: As many distinct speeds show how friction goes with speed; with fewer, any other source that has more is better.
_ENOUGH = 5
#: Pairs of directions are free of the model's errors: they are kept over any motion at this much less of the time.
_GAIN, _GAIN_OVER_PAIRS = 0.1, 0.3
#: Between speeds further apart than this ratio friction is not known: its fall from breakaway lies within one.
_GAP = 3.0
_MARGIN = 1.05  # friction is used a little beyond the speeds it was measured at


@dataclass(frozen=True, slots=True, eq=False)
class _Motion:
    """Settled motion of a joint in one log, (m,) each.

    Attributes:
        velocity: of the joint.
        torque: effort less the torque that reaches the link.
        late: what the torque gains if effort is stamped one standard deviation late.
        piece: number of the piece of a stroke that a sample is of.
    """

    velocity: FloatArray
    torque: FloatArray
    late: FloatArray
    piece: IntArray


def motion_points(logs: Sequence[Prepared], joint: str) -> tuple[FrictionPoint, ...]:
    """Points (speed, friction) of one joint from all settled motion of some logs: one regression over all of it.

    Friction is the effort less the torque that reaches the link. It is regressed on bins of speed, each direction by
    itself, beside an offset of each log. Errors are those of pieces of strokes, since neighbouring samples err alike.

    Args:
        logs: with effort in torque units, and a model torque or a joint torque sensor; others give nothing.
        joint: its name.
    """
    parts = [part for log in logs if (part := _motion(log, joint)) is not None]
    if not parts:
        return ()
    first = np.cumsum([0, *(1 + int(part.piece[-1]) for part in parts)])
    piece = np.concatenate([part.piece + start for part, start in zip(parts, first, strict=False)])
    velocity = np.concatenate([part.velocity for part in parts])
    speed, sign = np.abs(velocity), np.sign(velocity)
    slowest, fastest = max(MOVING_RAD_S, quantile_of(speed, 0.02)), 1.0001 * float(speed.max())
    number = np.searchsorted(np.geomspace(slowest, fastest, _BINS + 1), speed, side="right") - 1
    used = number >= 0
    cell = (piece * 2 * _BINS + number + _BINS * (velocity < 0))[used]

    def cells(values: FloatArray) -> FloatArray:
        """(g, 2 bins) sums over the samples that each piece has in each bin, forward ones first."""
        sums = np.bincount(cell, values[used], int(first[-1]) * 2 * _BINS)
        return np.asarray(sums.reshape(-1, 2 * _BINS), dtype=np.float64)

    fine = cells(np.ones(speed.size))
    wide = _wide_enough(fine > 0)
    if wide.shape[1] == 0:
        return ()
    samples = fine @ wide
    way = np.sign(cells(sign).sum(axis=1))
    offsets = np.repeat(np.eye(len(parts)), np.diff(first), axis=0) * (way * samples.any(axis=1))[:, None]
    torque, late = (np.concatenate([getattr(part, name) for part in parts]) for name in ("torque", "late"))
    friction, error = _regressed(cells(sign * torque) @ wide, cells(torque**2).sum(axis=1), samples, offsets)
    mean_speed, timing = ((cells(x) @ wide).sum(axis=0) / samples.sum(axis=0) for x in (speed, sign * late))
    direction = np.sign(way @ samples)
    pieces = np.count_nonzero(samples, axis=0)
    return tuple(
        FrictionPoint(
            speed_rad_s=float(mean_speed[k]),
            friction_nm=float(friction[k]),
            sd_nm=float(error[k] * np.sqrt(pieces[k])),
            se_nm=float(error[k]),
            source="model",
            direction=int(direction[k]),
            others_moving=True,
            timing_nm=float(timing[k]),
        )
        for k in range(wide.shape[1])
    )


def _motion(log: Prepared, joint: str) -> _Motion | None:
    """The settled motion of a joint; None without any."""
    series, known = log.series, log.gear_torque(joint)
    if known is None or series.effort is None:
        return None
    j = series.column(joint)
    if log.sensed(joint):  # as noisy as the effort
        known = low_pass(known[:, None], series.segments, series.period_s, series.bandwidth_hz)[:, 0]
    effort = low_pass(series.effort[:, j : j + 1], series.segments, series.period_s, series.bandwidth_hz)[:, 0]
    rows = _settled_rows(series, j, effort, known)
    if rows.size == 0:
        return None
    rate = np.nan_to_num(differentiate(known, series.segments, series.period_s)[rows])
    new = (np.diff(rows) > 1) | (np.diff(np.floor(series.time_s[rows] / _PIECE_S)) > 0)
    return _Motion(
        velocity=series.velocity_rad_s[:, j][rows],
        torque=(effort - known)[rows],
        late=SIMULTANEOUS * series.period_s * rate,
        piece=np.concatenate([[0], np.cumsum(new)]),
    )


def _wide_enough(present: BoolArray) -> FloatArray:
    """(2 bins, b) which bins are taken together, from slow to fast, so that each has enough pieces.

    Args:
        present: (g, 2 bins) which piece has samples in which bin.
    """
    wide: list[FloatArray] = []
    for way in (range(_BINS), range(_BINS, 2 * _BINS)):
        own, waiting = list[FloatArray](), np.zeros(2 * _BINS)
        for k in way:
            waiting[k] = 1.0
            if np.count_nonzero(present[:, waiting > 0].any(axis=1)) >= _LEAST_PIECES:
                own, waiting = [*own, waiting], np.zeros(2 * _BINS)
        if own:
            own[-1] += waiting
        wide += own
    return np.reshape(wide, (len(wide), 2 * _BINS)).T


def _regressed(
    sums: FloatArray, squares: FloatArray, samples: FloatArray, offsets: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """(b,) means of the bins beside an offset of each log, and their standard errors.

    Errors are those of the pieces' scores, of rare bins moderated (Smyth, Stat. Appl. Genet. Mol. Biol. 3, 2004). Bins
    that a piece passes one after the other err alike: all errors are as much larger as that of their mean is (design
    effect: Kish, Survey Sampling, 1965).

    Args:
        sums, samples: (g, b) of each piece in each bin.
        squares: (g,) sum of squares of each piece.
        offsets: (g, l) column of each log's offset.
    """
    bins, count = sums.shape[1], samples.sum(axis=1)
    shared = samples[:, :, None] * offsets[:, None, :]
    zeros, along = count[:, None, None] * offsets[:, :, None] * offsets[:, None, :], sums.sum(axis=1)[:, None] * offsets
    target = np.concatenate([sums, along], axis=1)[:, :, None]
    products = np.block(
        [
            [np.concatenate([samples[:, :, None] * np.eye(bins), shared], axis=2), target[:, :bins]],
            [np.concatenate([shared.transpose(0, 2, 1), zeros], axis=2), target[:, bins:]],
            [target.transpose(0, 2, 1), squares[:, None, None]],
        ]
    )
    prior = np.concatenate([np.zeros(bins), _OFFSET_HELD * (np.abs(offsets).T @ count + 1.0)])
    found = estimate(products[:, None], count[:, None], np.arange(prior.size)[None], prior)
    moved, told = found.influence[:, :bins], int(np.count_nonzero(count))
    covariance, pieces = moved.T @ moved * (told / max(told - prior.size, 1)), np.count_nonzero(samples, axis=0)
    own = pieces * np.diag(covariance)
    moderated = ((_PRIOR_PIECES * np.median(own) + (pieces - 1) * own) / (_PRIOR_PIECES + pieces - 1)) / pieces
    weight = 1.0 / moderated
    together = (weight @ covariance @ weight) / (weight**2 @ np.diag(covariance))
    return found.value[:bins], np.sqrt(moderated * max(1.0, float(together)))


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
    velocity = series.velocity_rad_s[:, j]
    rows = one_way(velocity, MOVING_RAD_S, round(_SETTLED_S / series.period_s))
    rows &= settled(series.segments, series.position_rad[:, j], velocity, MOVING_RAD_S)[0]
    rows &= ~(series.edge | series.saturated[:, j])
    for column in needed:
        rows &= np.isfinite(column)
    return np.flatnonzero(rows)


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
