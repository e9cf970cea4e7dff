"""Signals that stand still while the arm moves, a stuck effort or a frozen position: they are missing values."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from math import ceil, log

import numpy as np

from collaudit.core.data.joint_log import JointLog
from collaudit.core.data.uniform_series import MOVING_RAD_S
from collaudit.core.dataclass import dataclass
from collaudit.core.findings import Finding
from collaudit.core.numeric.arrays import BoolArray, FloatArray, frozen
from collaudit.core.numeric.blocks import exceeds
from collaudit.core.numeric.parallel import ordered_map
from collaudit.core.numeric.runs import run_bounds
from collaudit.core.numeric.stats import median_of, quantile_of
from collaudit.core.numeric.tables import copied

#: A value that repeats for less than this, or for fewer samples, is no stuck sensor.
_LEAST_S, _LEAST = 0.05, 8
#: This many times the usual run of repeats.
_TIMES = 5.0
#: Expected number of runs as long by chance, at the signal's own rate of repeats.
_CHANCE = 1e-6
#: A signal that repeats more often than this is too coarse, or too slow, to tell.
_MOST_REPEATS = 0.9
#: Speed is told over this time, s.
_SPEED_S = 0.05
#: No joint of an arm brakes harder, rad/s².
_BRAKE_RAD_S2 = 200.0
#: A signal of fewer different values than this is coarse.
_FEW_VALUES = 256
_LISTED = 20


@dataclass(frozen=True, slots=True, eq=False)
class _Held:
    """Stretches (start, stop) of rows in which one joint's signal repeats the row before the stretch."""

    joint: int
    spans: tuple[tuple[int, int], ...]


def without_stuck(recorded: JointLog) -> JointLog:
    """The log with stuck efforts and frozen positions as missing values, and a finding for each stretch.

    A drive that updates its effort more slowly than the log repeats it too: a stretch counts that is far longer than
    the signal's usual repeats, and that would not occur by chance.

    Args:
        recorded: (n, j) signals, stamps as recorded.
    """
    period = _period(recorded.time_s)
    if period is None:
        return recorded
    moving = _moving(recorded, period)
    if not moving.any():
        return recorded
    arm: BoolArray = np.asarray(moving.any(axis=1))
    bus = np.zeros(0, dtype=np.bool_) if recorded.effort is None else np.asarray(_all_repeat(recorded.effort) & arm)
    count = range(len(recorded.joint_names))

    alive = arm if recorded.effort is None else np.asarray((recorded.effort != 0.0).any(axis=1))  # else drives are off

    def effort_of(j: int) -> _Held:
        assert recorded.effort is not None
        return _Held(
            j,
            tuple(
                _stuck(
                    np.ascontiguousarray(recorded.effort[:, j]), np.asarray((moving[:, j] | bus) & alive), arm, period
                )
            ),
        )

    def position_of(j: int) -> _Held:
        return _Held(j, tuple(_frozen(recorded, j, period)))

    efforts = list(ordered_map(effort_of, count)) if recorded.effort is not None else []
    positions = list(ordered_map(position_of, count))
    effort, findings = recorded.effort, []
    if effort is not None and any(held.spans for held in efforts):
        effort = _blanked(effort, efforts)
        findings += _findings(recorded, efforts, "sensor-stuck", "effort")
    position = recorded.position_rad
    if any(held.spans for held in positions):
        position = _blanked(position, positions)
        findings += _findings(recorded, positions, "position-frozen", "position")
    if not findings:
        return recorded
    return replace(recorded, effort=effort, position_rad=position, findings=(*recorded.findings, *findings))


def _period(time_s: FloatArray) -> float | None:
    if time_s.size < 3 * _LEAST:
        return None
    steps = np.diff(time_s)
    period = median_of(steps[~np.isnan(steps)])
    return period if period > 0 else None


def _moving(recorded: JointLog, period: float) -> BoolArray:
    """(n, j) rows in which a joint moves, by its logged or by its differentiated speed."""
    half = max(1, ceil(_SPEED_S / period / 2))
    out = np.zeros(recorded.position_rad.shape, dtype=np.bool_, order="F")

    def fill_joint(j: int) -> None:
        q = recorded.position_rad[:, j]
        if q.size > 2 * half:
            way = q[2 * half :] - q[: -2 * half]
            out[half:-half, j] = np.abs(way, out=way) > MOVING_RAD_S * (2 * half * period)
        if recorded.velocity_rad_s is not None:
            out[:, j] |= exceeds(recorded.velocity_rad_s[:, j], MOVING_RAD_S)

    for _ in ordered_map(fill_joint, range(len(recorded.joint_names))):
        pass
    return out


def _all_repeat(effort: FloatArray) -> BoolArray:
    """(n,) rows whose efforts of all joints are those of the row before: a still joint may do so, all do not."""
    out = np.zeros(effort.shape[0], dtype=np.bool_)
    out[1:] = (effort[1:] == effort[:-1]).all(axis=1)
    return out


def _stuck(x: FloatArray, judged: BoolArray, moving: BoolArray, period: float) -> list[tuple[int, int]]:
    """Rows of ``x`` that repeat the value before them for too long.

    Args:
        x: (n,) effort of one joint.
        judged: (n,) rows in which repeats count.
        moving: (n,) rows in which the arm moves: what is usual is told there.
        period: s.
    """
    same = np.zeros(x.size, dtype=np.bool_)
    np.equal(x[1:], x[:-1], out=same[1:])
    starts, stops = run_bounds(same)
    least = max(_LEAST, ceil(_LEAST_S / period))
    if not (stops - starts >= least).any():
        return []
    counted = np.concatenate(([0], np.cumsum(same & judged)))
    length = counted[stops] - counted[starts]
    if not (length >= least).any():
        return []
    bound = max(float(least), _bound(x, same & moving, int(np.count_nonzero(moving & ~same)), least))
    extremes = (np.nanmin(x), np.nanmax(x))  # a drive at its limit is another finding
    long = length >= bound
    return [
        (int(a), int(b)) for a, b in zip(starts[long], stops[long], strict=True) if x[a] == 0.0 or x[a] not in extremes
    ]


def _bound(x: FloatArray, same: BoolArray, steps: int, least: int) -> float:
    """Repeats in a row that are neither usual for this signal nor chance; infinite where that cannot be told."""
    starts, stops = run_bounds(same)
    length = stops - starts
    hold = np.concatenate((length, np.zeros(max(steps - length.size, 0))))  # most values of most drives: no repeat
    usual = length[length < max(_TIMES * (1.0 + float(np.median(hold))), least)]
    share = (float(usual.sum()) + 1.0) / (float(usual.sum()) + steps + 2.0)
    if share > _MOST_REPEATS:
        return float("inf")
    bound = max(log(steps / _CHANCE + 1.0) / -log(share), _TIMES * float(usual.max(initial=0)))
    if length.size > 2 and _coarse(x):  # repeats are not drawn by chance: they come with every slow change of load
        bound = max(bound, _TIMES * float(np.partition(length, -3)[-3]))
    return bound


def _coarse(x: FloatArray) -> bool:
    """Whether a signal mostly changes by the one or two steps that it is written in."""
    if np.unique(x).size < _FEW_VALUES:
        return True
    change = np.abs(np.diff(x))
    change = change[np.isfinite(change) & (change > 0)]
    if change.size < 2:
        return True
    return median_of(change) < 2.5 * quantile_of(change, 0.01)


def _frozen(recorded: JointLog, j: int, period: float) -> list[tuple[int, int]]:
    """Rows in which a joint's position repeats although it moves: by its velocity, or by the jump that ends it."""
    q = np.ascontiguousarray(recorded.position_rad[:, j])
    same = np.zeros(q.size, dtype=np.bool_)
    np.equal(q[1:], q[:-1], out=same[1:])
    least = max(_LEAST, ceil(_LEAST_S / period))
    starts, stops = run_bounds(same)
    long = stops - starts >= least
    if not long.any():
        return []
    velocity = None if recorded.velocity_rad_s is None else recorded.velocity_rad_s[:, j]
    found = []
    for a, b in zip(starts[long].tolist(), stops[long].tolist(), strict=True):
        if velocity is not None and np.isfinite(velocity[a:b]).any():
            inside = np.nan_to_num(velocity[a:b])
            if abs(float(np.sum(inside))) * period > MOVING_RAD_S * (b - a) * period and _jumps(q, a, b, period):
                found.append((a, b))
        elif _jumps(q, a, b, period):
            found.append((a, b))
    return found


def _jumps(q: FloatArray, a: int, b: int, period: float) -> bool:
    """Whether the joint came in at speed, and its position catches up at once after the stretch, or it never ends.

    A logged velocity that lags behind, and a joint that stops at once, do not look like this.
    """
    before = float(np.nanmedian(np.diff(q[max(a - 6, 0) : a]))) / period if a >= 3 else 0.0
    if b >= q.size:
        return abs(before) / period > _BRAKE_RAD_S2 and abs(before) > MOVING_RAD_S
    leap = float(q[b] - q[b - 1])
    after = float(np.nanmedian(np.abs(np.diff(q[b : b + 6])))) if b + 2 < q.size else 0.0
    fair = max(after, abs(before) * period)
    return abs(leap) > 5.0 * fair and abs(leap) > MOVING_RAD_S * (b - a) * period


def _blanked(values: FloatArray, held: Iterable[_Held]) -> FloatArray:
    out = copied(values)
    for one in held:
        for start, stop in one.spans:
            out[start:stop, one.joint] = np.nan
    return frozen(out)


def _findings(recorded: JointLog, held: Iterable[_Held], code: str, what: str) -> list[Finding]:
    out = []
    for one in held:
        joint = recorded.joint_names[one.joint]
        for a, b in one.spans[:_LISTED]:
            first, last = float(recorded.time_s[a - 1]), float(recorded.time_s[b - 1])
            text = (
                f"The {what} of joint '{joint}' is the same value {b - a + 1} times from {first:.4g} to {last:.4g} s "
                "while the arm moves: it counts as missing, and nothing that needs it is judged there."
            )
            out.append(Finding(code, "warning", text, joint=joint, start_s=first, end_s=last))
    return out
