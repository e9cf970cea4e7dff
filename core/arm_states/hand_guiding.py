"""An arm that a person guides while its drives only hold its weight, told from the signals.

A drive that moves an arm supplies what friction and inertia take: s = f(v) + tau_rigid - g(q). When the arm is guided
by hand (freedrive, zero gravity), a person supplies it, and the effort is gravity's torque alone. So of the drive's
effort beside gravity, y = effort - g(q), the *share* <s, y> / <s, s> is 1 where the drive moves the joint and near 0
where a hand does; what is left of y against s must be small too. A contact on a driven arm adds its own torque to s: it
makes y larger, or smaller on the joints that it loads and for as long as it lasts. Therefore at least two joints, and
every joint that tells anything, must show it for a second. Where the drives act within such a stretch (y as large as s,
a push against a drive), the stretch is interrupted. What is left of it must last half a second: a single spike of s,
as a jump of the clock makes, outweighs all else in the windows around it. An effort that is what the drive supplies,
only late (a slow low-pass), is no sign of a hand.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import ceil

import numpy as np
import scipy

from collaudit.core.data.uniform_series import MOVING_RAD_S, UniformSeries
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray, Span
from collaudit.core.numeric.runs import marked, run_bounds
from collaudit.core.numeric.stats import quantile_of

#: Blocks, s; window that must show it, blocks; samples looked at in a second.
_BLOCK_S, _WINDOW, _RATE_HZ = 0.1, 10, 50.0
#: A joint moves in a window when it moves for this share of it; it tells when s is this many times its noise.
_MOVES, _TELLS = 0.3, 3.0
#: Share of s that the drive supplies at most, and RMS of y against that of s; above the last a block is driven.
_SHARE, _REST, _DRIVEN = 0.4, 0.5, 0.6
#: Joints that must show it, at least.
_LEAST_JOINTS = 2
#: Quantile of the blocks' residual that is taken for its noise: most of a log may be guided.
_QUIET = 0.2
#: Longest pause within one stretch, and shortest stretch, s.
_PAUSE_S, _LEAST_S = 3.0, 0.5

#: Time constants of a late drive that are tried, s; how long before the stretch its low-pass starts, in time constants.
_LAGS_S, _BEFORE = (0.1, 0.15, 0.25, 0.4, 0.6, 0.8, 1.0, 1.25, 1.6, 2.0, 2.5), 5.0
#: Share of the effort beside gravity, as its power, that a late drive leaves at most. Simulated, it leaves up to 0.3,
#: and an arm in a hand ten times the whole and more.
_LEFT = 0.5

Gravity = Callable[[FloatArray], FloatArray]
Friction = Callable[[FloatArray], FloatArray]


@dataclass(frozen=True, slots=True)
class HandGuiding:
    """One stretch in which the arm was guided.

    Attributes:
        span: samples.
        joints: columns that tell it.
        share: of friction and inertia that the drives supplied on these joints.
        work_j: work of these joints' external torque on the arm, J.
    """

    span: Span
    joints: tuple[int, ...]
    share: float
    work_j: float


@dataclass(frozen=True, slots=True, eq=False)
class _Blocks:
    """Sums over blocks of a tenth of a second, (b, j): counts, moving samples, s², s·y, y², power, W."""

    count: FloatArray
    moving: FloatArray
    ss: FloatArray
    sy: FloatArray
    yy: FloatArray
    power_w: FloatArray

    def windows(self) -> _Blocks:
        """The same over each window of ten blocks, (b - 9, j)."""
        return _Blocks(*(_windowed(getattr(self, name)) for name in self.__slots__))


def hand_guiding(
    series: UniformSeries,
    drive_nm: FloatArray,
    rigid_nm: FloatArray,
    gravity: Gravity,
    friction: Mapping[int, Friction],
) -> list[HandGuiding]:
    """Stretches in which the arm was guided by hand.

    Args:
        series: all joints of the log.
        drive_nm: (n, j) effort less the commanded tool force's torque; NaN where unknown.
        rigid_nm: (n, j) rigid-body torque.
        gravity: (k, j) gravity torque at (k, j) positions.
        friction: sliding friction at (k,) speeds, by column; joints without it tell nothing.
    """
    columns = sorted(friction)
    if len(columns) < _LEAST_JOINTS or series.period_s > _BLOCK_S:  # more blocks than samples
        return []
    rows, block = _rows(series)
    if rows.size == 0:
        return []
    speed, drive, rigid = (x[rows][:, columns] for x in (series.velocity_rad_s, drive_nm, rigid_nm))
    own = np.stack([friction[j](np.ascontiguousarray(v)) for j, v in zip(columns, speed.T, strict=True)], axis=1)
    rest = drive - rigid - own
    usual = _noise(rest, speed, block)
    near = np.flatnonzero(_suspicious(rest, speed, block, usual))
    if near.size == 0:
        return []
    weight = gravity(series.position_rad[rows[near]])[:, columns]
    signals = speed[near], own[near] + rigid[near] - weight, rest[near]
    by_joint = [_sums(block[near], _count(block), *of_joint) for of_joint in zip(*(x.T for x in signals), strict=True)]
    sums = _Blocks(*(np.stack(parts, axis=1) for parts in zip(*by_joint, strict=True)))
    mask, telling = _guided(sums, usual)
    least = round(_LEAST_S / _BLOCK_S)
    found = [
        HandGuiding(_span(series, a, b), *_evidence(sums, telling, columns, a, b))
        for a, b in zip(*run_bounds(mask), strict=True)
        if b - a >= least
    ]
    return [
        one for one in found if not _follows_late(series, one.span, one.joints, drive_nm, rigid_nm, gravity, friction)
    ]


def _rows(series: UniformSeries) -> tuple[IntArray, IntArray]:
    """Recorded samples at about fifty a second, and the block of each on the grid, where gaps are short."""
    every = max(1, int(1.0 / (_RATE_HZ * series.period_s)))
    rows = np.concatenate([np.arange(s.start, s.stop, every) for s in series.segments] or [np.zeros(0, dtype=np.int64)])
    return rows.astype(np.int64), (rows * series.period_s / _BLOCK_S + 1e-6).astype(np.int64)


def _suspicious(rest: FloatArray, speed: FloatArray, block: IntArray, usual: FloatArray) -> BoolArray:
    """(k,) samples worth a closer look: about them work comes from outside, on two joints, beyond the usual."""
    known = np.isfinite(rest)
    blocks = _count(block)
    work = _total(block, blocks, np.where(known, -rest * speed, 0.0))
    size = _total(block, blocks, np.where(known, rest * rest, 0.0))
    count = _total(block, blocks, known)
    wide = [_windowed(x) for x in (work, size, count)]
    with np.errstate(invalid="ignore", divide="ignore"):
        beyond = (wide[0] > 0.0) & (wide[1] > np.square(usual) * wide[2])
    some = np.count_nonzero(beyond, axis=1) >= _LEAST_JOINTS
    return _covered(some, work.shape[0])[block]


def _noise(rest: FloatArray, speed: FloatArray, block: IntArray) -> FloatArray:
    """(j,) residual of each joint in its quieter motion, N·m; 0 without any."""
    use = np.isfinite(rest) & (np.abs(speed) >= MOVING_RAD_S)
    blocks = _count(block)
    count = _total(block, blocks, use)
    size = _total(block, blocks, np.where(use, rest * rest, 0.0))
    out = np.zeros(rest.shape[1])
    for j in range(rest.shape[1]):
        some = count[:, j] > 0
        if some.any():
            out[j] = float(np.sqrt(quantile_of(size[some, j] / count[some, j], _QUIET)))
    return out


def _sums(block: IntArray, blocks: int, speed: FloatArray, expected: FloatArray, rest: FloatArray) -> list[FloatArray]:
    """Of one joint's samples (k,): each of :class:`_Blocks`, (b,)."""
    drive = rest + expected
    use = np.isfinite(expected) & np.isfinite(drive)
    moving = use & (np.abs(speed) >= MOVING_RAD_S)
    s, y = (np.where(moving, x, 0.0) for x in (expected, drive))
    parts = (use, moving, s * s, s * y, y * y, np.where(moving, -rest * speed, 0.0))
    return [np.asarray(np.bincount(block, part, blocks), dtype=np.float64) for part in parts]


def _guided(sums: _Blocks, noise: FloatArray) -> tuple[BoolArray, BoolArray]:
    """(b,) blocks of guided stretches, and (b, j) joints that tell it in the window around."""
    wide = sums.windows()
    with np.errstate(invalid="ignore", divide="ignore"):
        moves = wide.moving > _MOVES * np.maximum(wide.count, 1.0)
        tells = moves & (wide.ss > np.square(_TELLS * noise) * wide.moving) & (wide.ss > 0.0)
        passive = (wide.sy < _SHARE * wide.ss) & (wide.yy < _REST**2 * wide.ss) & (wide.power_w > 0.0)
    enough = np.maximum(_LEAST_JOINTS, np.ceil(0.5 * np.count_nonzero(moves, axis=1)))
    shown = (np.count_nonzero(tells, axis=1) >= enough) & (passive | ~tells).all(axis=1)
    telling = np.stack([_covered(shown & tells[:, j], sums.count.shape[0]) for j in range(tells.shape[1])], axis=1)
    mask = _joined(_covered(shown, sums.count.shape[0]), sums, noise)
    return mask, telling


def _joined(mask: BoolArray, sums: _Blocks, noise: FloatArray) -> BoolArray:
    """Without blocks in which a drive acts, with those next to it in which none does, and with short pauses."""
    floor = np.square(_TELLS * noise) * sums.moving
    size = np.maximum(sums.ss, floor)
    share = np.sum(np.where(size > 0, sums.sy, 0.0), axis=1)
    whole = np.sum(sums.ss, axis=1)
    with np.errstate(invalid="ignore"):
        acts = (share > _DRIVEN * whole) & (whole > np.sum(floor, axis=1))
        acts |= ((sums.yy > np.maximum(sums.ss, 4.0 * floor)) & (sums.moving > 0)).any(axis=1)
    quiet = ~acts & (np.sum(sums.moving, axis=1) > 0)
    out: BoolArray = mask & quiet
    for _ in range(2 * _WINDOW):  # neighbours that move without their drives belong to it
        grown = out.copy()
        grown[1:] |= out[:-1] & quiet[1:]
        grown[:-1] |= out[1:] & quiet[:-1]
        if (grown == out).all():
            break
        out = grown
    for a, b in zip(*run_bounds(~out), strict=True):
        inner = a > 0 and b < out.size
        if inner and b - a <= _PAUSE_S / _BLOCK_S and not acts[a:b].any() and (sums.count[a:b].sum(axis=1) > 0).all():
            out[a:b] = True
    return out


def _evidence(
    sums: _Blocks, telling: BoolArray, columns: list[int], start: int, stop: int
) -> tuple[tuple[int, ...], float, float]:
    """Columns that tell a stretch of blocks, the share of the drives, and the work from outside, J."""
    shown = np.flatnonzero(telling[start:stop].any(axis=0))
    part = slice(start, stop)
    whole = float(sums.ss[part][:, shown].sum())
    share = float(sums.sy[part][:, shown].sum()) / whole if whole > 0 else 0.0
    count = np.maximum(sums.count[part][:, shown], 1.0)
    work = float(np.sum(sums.power_w[part][:, shown] / count)) * _BLOCK_S
    return tuple(columns[k] for k in shown), share, work


def _span(series: UniformSeries, start: int, stop: int) -> Span:
    """Samples of the blocks."""
    first, last = (ceil(block * _BLOCK_S / series.period_s - 1e-6) for block in (start, stop))
    return Span(first, min(last, series.time_s.size))


def _count(block: IntArray) -> int:
    """Number of blocks, of the block (k,) of each sample in order."""
    return int(block[-1]) + 1


def _total(block: IntArray, blocks: int, values: FloatArray | BoolArray) -> FloatArray:
    """(b, j) sums of (k, j) values over blocks."""
    return np.stack([np.bincount(block, column, blocks) for column in values.T], axis=1)


def _windowed(sums: FloatArray) -> FloatArray:
    """(b - 9, j) sums over ten blocks in a row; (0, j) of fewer."""
    if sums.shape[0] < _WINDOW:
        return np.zeros((0, sums.shape[1]))
    run = np.concatenate([np.zeros((1, sums.shape[1])), np.cumsum(sums, axis=0)])
    return np.asarray(run[_WINDOW:] - run[:-_WINDOW])


def _covered(windows: BoolArray, size: int) -> BoolArray:
    """(size,) blocks that lie in one of the marked windows."""
    at = np.flatnonzero(windows)
    return marked(at, np.minimum(at + _WINDOW, size), size)


def _follows_late(
    series: UniformSeries,
    span: Span,
    joints: tuple[int, ...],
    drive_nm: FloatArray,
    rigid_nm: FloatArray,
    gravity: Gravity,
    friction: Mapping[int, Friction],
) -> bool:
    """Whether in a stretch the efforts of all these joints are what their drives supply, behind one low-pass.

    Args:
        series: all joints of the log.
        span: the stretch.
        joints: columns that seem not to be driven.
        drive_nm: (n, j) effort less the commanded tool force's torque; NaN where unknown.
        rigid_nm: (n, j) rigid-body torque.
        gravity: (k, j) gravity torque at (k, j) positions.
        friction: sliding friction at (k,) speeds, by column.
    """
    every = max(1, int(1.0 / (_RATE_HZ * series.period_s)))
    floor = max((segment.start for segment in series.segments if segment.start <= span.start), default=0)
    start = max(floor, span.start - round(_BEFORE * _LAGS_S[-1] / series.period_s))
    rows = np.arange(start, span.stop, every)
    inside = rows >= span.start
    pick = np.array(joints, dtype=np.int64)
    weight = gravity(series.position_rad[rows[inside]])[:, pick]
    drive = drive_nm[np.ix_(rows[inside], pick)]
    own = np.stack([friction[j](series.velocity_rad_s[rows, j]) for j in joints], axis=1)
    supplied = np.nan_to_num(rigid_nm[np.ix_(rows, pick)] + own)
    logged = drive_nm[rows[0], pick]  # what comes out of the low-pass there; friction at rest has no sign to start from
    before = np.where(np.isfinite(logged), logged, supplied[0])
    unfiltered = np.nansum(np.square(drive - weight), axis=0)
    for lag_s in _LAGS_S:
        late = _low_passed(supplied, every * series.period_s / lag_s, before)[inside]
        if (np.nansum(np.square(drive - late), axis=0) < _LEFT * unfiltered).all():
            return True
    return False


def _low_passed(values: FloatArray, step: float, start: FloatArray) -> FloatArray:
    """(k, j) behind a low-pass of first order.

    Args:
        values: (k, j) before it.
        step: the period by its time constant.
        start: (j,) what it gave before the first sample.
    """
    share = step / (1.0 + step)
    b, a = np.array([share]), np.array([1.0, share - 1.0])
    return np.asarray(scipy.signal.lfilter(b, a, values, axis=0, zi=(1.0 - share) * start[None])[0])
