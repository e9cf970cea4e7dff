"""Positions that jump: angles that begin again after a turn are continued; other jumps and missing rows are told.

A joint whose position stands still in motion, and then catches up at once, is told too.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from math import ceil

import numpy as np

from collaudit.core.conditioning.calm_stretches import shortest_stretch
from collaudit.core.conditioning.stamp_order import usable_order
from collaudit.core.config.schema_judging import DetectConfig
from collaudit.core.data.joint_log import MOVING_RAD_S, JointLog
from collaudit.core.findings import Finding, fact
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray, run_bounds
from collaudit.core.numeric.parallel import ordered_map
from collaudit.core.numeric.stats import median_of, quantile_of

_TURN_RAD = 2.0 * np.pi
#: A smaller step is no jump, rad (m of a prismatic joint).
_LEAST_STEP = 0.1
#: No joint of an arm is that much faster than its neighbouring samples say, rad/s.
_BEYOND_ANY_RAD_S = 25.0
#: Across a longer step, in sample periods, there is a gap already.
_GAP_PERIODS = 3.0
#: More jumps than this share of all steps are no breaks but how the signal is: held values, or noise.
_MOST = 0.02
#: Acceleration and noise that a turn is told beside: fixed, by the motion expected, by the time without samples.
_TOLERANCE_RAD, _TOLERANCE_SHARE, _TOLERANCE_RAD_S = 0.1, 0.5, 2.0
_MOST_TOLERANCE_RAD = 1.0


@dataclass(frozen=True, slots=True, eq=False)
class Continued:
    """Positions without wraps.

    Attributes:
        position_rad: (n, j) in the order of the log; the log's own array where nothing was changed.
        breaks: by column, rows of the log that are the first after a jump which is no wrap.
        findings: one for each joint with wraps, or with jumps all the time.
    """

    position_rad: FloatArray
    breaks: Mapping[int, IntArray]
    findings: tuple[Finding, ...]


def continued_angles(log: JointLog, prismatic: Collection[str] = ()) -> Continued:
    """Continue angles over their wraps by whole turns, and find jumps that are none.

    A step is a jump where it is far from what the samples around it, and the logged velocity where there is one,
    say of the motion. Fast motion is therefore no jump: its neighbours are fast too.

    Args:
        log: as recorded.
        prismatic: joints that never turn.
    """
    position = log.position_rad
    columns = np.flatnonzero(list(ordered_map(_steps_far, position.T))).tolist()
    if not columns:
        return Continued(position, {}, ())
    order = usable_order(log.time_s)
    findings: list[Finding] = []
    breaks: dict[int, IntArray] = {}
    out = position
    for j in columns:
        joint = log.joint_names[j]
        rows, turns = _jumps(log, j, order, joint not in prismatic)
        wraps, cuts = rows[turns != 0], rows[turns == 0]
        if wraps.size:
            out = position.copy(order="F") if out is position else out
            turned = np.zeros(log.time_s.size)
            turned[wraps] = turns[turns != 0]
            out[order, j] -= _TURN_RAD * np.cumsum(turned[order])
            first = float(log.time_s[wraps[0]])
            text = (
                f"The position of joint '{joint}' starts again after a turn of 360 degrees, {wraps.size} times, first "
                f"at {first:.4g} s; it was continued."
            )
            findings.append(fact(text, joint=joint, start_s=first))
        if cuts.size > max(3.0, _MOST * order.size):
            text = (
                f"The position of joint '{joint}' jumps in {cuts.size} of {order.size} steps as no joint moves: values "
                "that are held or disturbed. Too many to be cut out: the joint is not judged, and the model's torque "
                "of joints before it is computed from them."
            )
            findings.append(Finding("not-measured", "error", text, joint=joint))
        elif cuts.size:
            breaks[j] = cuts
    return Continued(out, breaks, tuple(findings))


def _steps_far(x: FloatArray) -> bool:
    """Whether a closer look is needed: a large step, or values that are missing beside one."""
    known = x if np.isfinite(x.sum()) else x[np.isfinite(x)]
    step = np.diff(known)
    return bool(step.size) and max(float(step.max()), -float(step.min())) > _LEAST_STEP


def _jumps(log: JointLog, j: int, order: IntArray, turning: bool) -> tuple[IntArray, FloatArray]:
    """Steps of one joint that are too large: rows after them (k,), in time order, and whole turns, 0 for a break."""
    rows = order[np.isfinite(log.position_rad[order, j])]
    if rows.size < 4:
        return rows[:0], np.zeros(0)
    step, dt = np.diff(log.position_rad[rows, j]), np.diff(log.time_s[rows])
    period = float(np.median(dt))
    around = _expected(step, dt, turning)
    velocity = None if log.velocity_rad_s is None else log.velocity_rad_s[rows, j]
    stated = around if velocity is None else 0.5 * (velocity[1:] + velocity[:-1]) * dt
    stated = np.where(np.isfinite(stated), stated, around)
    limit = np.maximum(_LEAST_STEP, _BEYOND_ANY_RAD_S * dt)
    far: BoolArray = (np.abs(step - around) > limit) & (np.abs(step - stated) > limit)
    at = np.flatnonzero(far)
    turns = np.zeros(at.size)
    if turning:
        for guess in (around[at], stated[at]):
            whole = np.round((step[at] - guess) / _TURN_RAD)
            tolerance = _TOLERANCE_RAD + _TOLERANCE_SHARE * np.abs(guess) + _TOLERANCE_RAD_S * (dt[at] - period)
            near = np.abs(step[at] - guess - whole * _TURN_RAD) <= np.clip(tolerance, 0.0, _MOST_TOLERANCE_RAD)
            turns = np.where((turns == 0) & near, whole, turns)
    cut = (turns != 0) | (dt[at] <= _GAP_PERIODS * period)
    return rows[at[cut] + 1], turns[cut]


def _expected(step: FloatArray, dt: FloatArray, turning: bool) -> FloatArray:
    """(k,) steps by the median rate of the two before and the two after, whole turns aside."""
    folded = step - _TURN_RAD * np.round(step / _TURN_RAD) if turning else step
    rate = np.pad(folded / dt, 2, mode="edge")
    count = step.size
    neighbours = np.stack([rate[k : k + count] for k in (0, 1, 3, 4)])
    return np.asarray(np.median(neighbours, axis=0) * dt)


#: A position goes too far where it bends on both sides of a step by so many times what it does in 99 of 100 steps.
_BEYOND, _USUAL = 10.0, 0.99
#: An encoder that stands between two counts shows one and the other: no step over more counts.
_COUNTS = 1.5
#: Rounding of positions, rad.
_ROUNDING = 1e-9
#: The speed of a joint that stands on both sides of a step is not known; it was at most the one of its fast motion.
_FAST = 0.95
#: Of the shortest loss that counts: its length is known about as well.
_ABOUT = 0.75
_LISTED = 3


def missing_rows(
    log: JointLog, position: FloatArray, jumps: Mapping[int, IntArray], detect: DetectConfig
) -> tuple[IntArray, list[Finding]]:
    """Find steps of the positions for which the joints need as long at their speed as a contact lasts at least.

    A contact does not look like this: it stops a joint and does not carry it on.

    Args:
        log: as recorded.
        position: (n, j) its positions, with angles continued.
        jumps: by column, rows that follow a jump in any case.
        detect: a loss shorter than its persistence hides no contact.

    Returns:
        (k,) rows of the log, the first after each place; and what is said of them.
    """
    order = usable_order(log.time_s)
    period = median_of(np.diff(log.time_s[order])) if order.size > 1 else 0.0
    joints = range(len(log.joint_names))
    leaps = list(ordered_map(lambda j: _leaps(log, position[:, j], j, order, period), joints)) if period > 0.0 else []
    least_s = _ABOUT * shortest_stretch(detect, period) * period if period > 0.0 else 0.0
    found = {row for one in leaps for row, (_, lost_s) in one.items() if lost_s >= least_s}
    found = set() if len(found) > max(3.0, _MOST * order.size) else found
    rows = sorted(found.union(*(known.tolist() for known in jumps.values())))
    return np.array(rows, dtype=np.int64), [_finding(log, rows, leaps, jumps)] if rows else []


def _leaps(log: JointLog, q: FloatArray, j: int, order: IntArray, period: float) -> dict[int, tuple[float, float]]:
    """Of one joint, by row after a leap: its speed, rad/s, and how long it takes at that to go so far, s."""
    rows = order[np.isfinite(q[order])]
    step, dt = np.diff(q[rows]), np.diff(log.time_s[rows])
    bend = np.diff(step)
    if bend.size < 4:
        return {}
    limit = _BEYOND * quantile_of(np.abs(bend), _USUAL) + _ROUNDING
    far = np.abs(bend) > limit
    at = 1 + np.flatnonzero(far[:-1] & far[1:] & (bend[:-1] * bend[1:] < 0.0))  # steps unlike both their neighbours
    at = at[(at >= 2) & (at < step.size - 2) & (dt[np.minimum(at, dt.size - 1)] < 2.0 * period)]
    if not at.size:
        return {}
    neighbours = np.stack([step[at + k] / dt[at + k] for k in (-2, -1, 1, 2)])
    excess = np.abs(step[at] - np.median(neighbours, axis=0) * dt[at])
    speed, moved = np.abs(neighbours).max(axis=0), np.abs(step)
    speed = np.where(speed > MOVING_RAD_S, speed, max(quantile_of(moved, _FAST) / period, MOVING_RAD_S))
    count = float(np.min(moved, where=moved > _ROUNDING, initial=np.inf))
    keep = (excess > limit) & (moved[at] > _COUNTS * count)
    if log.velocity_rad_s is not None:
        stated = 0.5 * (log.velocity_rad_s[rows[at], j] + log.velocity_rad_s[rows[at + 1], j]) * dt[at]
        keep &= ~(np.abs(step[at] - stated) <= limit)
    told = zip(speed[keep].tolist(), (excess / speed)[keep].tolist(), strict=True)
    return dict(zip(rows[at + 1][keep].tolist(), told, strict=True))


def _finding(
    log: JointLog, rows: list[int], leaps: list[dict[int, tuple[float, float]]], jumps: Mapping[int, IntArray]
) -> Finding:
    said = []
    for row in rows[:_LISTED]:
        told = [one[row] for one in leaps if row in one]  # the joint that is fastest tells best how long it took
        said.append(f"at {log.time_s[row]:.4g} s" + (f", as in {max(told)[1]:.2g} s of the motion" if told else ""))
    more = f" and {len(rows) - _LISTED} more times" if len(rows) > _LISTED else ""
    text = (
        f"Positions go on by more than the joints move in one step ({'; '.join(said)}{more}): rows are missing there "
        "though the stamps go on, or an encoder was set anew. A contact then would not be seen. Nothing is judged or "
        "filtered across it."
    )
    who = {j for j, one in enumerate(leaps) if not one.keys().isdisjoint(rows)} | set(jumps)
    joint = log.joint_names[who.pop()] if len(who) == 1 else None
    return Finding("not-measured", "warning", text, joint=joint, start_s=float(log.time_s[rows[0]]))


#: A position that repeats for less than this, or for fewer samples, is not frozen.
_FROZEN_S, _FROZEN = 0.05, 8
#: No joint of an arm brakes harder, rad/s².
_BRAKE_RAD_S2 = 200.0
#: A frozen position catches up by more than so many times its usual step, and than so many steps of its encoder.
_CATCHES_UP, _STEPS = 5.0, 2.5


def frozen_spans(recorded: JointLog, j: int, period: float) -> list[tuple[int, int]]:
    """Rows (start, stop) in which a joint's position repeats the row before although the joint moves.

    Args:
        recorded: the log.
        j: column.
        period: s.
    """
    q = np.ascontiguousarray(recorded.position_rad[:, j])
    same = np.zeros(q.size, dtype=np.bool_)
    np.equal(q[1:], q[:-1], out=same[1:])
    least = max(_FROZEN, ceil(_FROZEN_S / period))
    starts, stops = run_bounds(same)
    long = stops - starts >= least
    if not long.any():
        return []
    steps = np.abs(np.diff(q))
    steps = steps[np.isfinite(steps) & (steps > 0.0)]
    step = quantile_of(steps, 0.05) if steps.size else 0.0  # of a slow joint, which makes its encoder's one at a time
    velocity = None if recorded.velocity_rad_s is None else recorded.velocity_rad_s[:, j]
    found = []
    for a, b in zip(starts[long].tolist(), stops[long].tolist(), strict=True):
        if velocity is not None and np.isfinite(velocity[a:b]).any():
            inside = np.nan_to_num(velocity[a:b])
            if abs(float(np.sum(inside))) * period <= MOVING_RAD_S * (b - a) * period:
                continue
        if _catches_up(q, a, b, period, step):
            found.append((a, b))
    return found


def _catches_up(q: FloatArray, a: int, b: int, period: float, step: float) -> bool:
    """Whether the joint came in at speed, and its position catches up at once after the stretch, or it never ends.

    A logged velocity that lags behind, a joint that stops at once, and the steps of an encoder do not look like this.
    """
    before = float(np.nanmedian(np.diff(q[max(a - 6, 0) : a]))) / period if a >= 3 else 0.0
    if b >= q.size:
        return abs(before) / period > _BRAKE_RAD_S2 and abs(before) > MOVING_RAD_S
    leap = float(q[b] - q[b - 1])
    after = float(np.nanmedian(np.abs(np.diff(q[b : b + 6])))) if b + 2 < q.size else 0.0
    fair = max(after, abs(before) * period)
    return abs(leap) > max(_CATCHES_UP * fair, _STEPS * step) and abs(leap) > MOVING_RAD_S * (b - a) * period
