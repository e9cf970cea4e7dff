"""Angles that start again after a turn are continued; positions that jump otherwise are told from them."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass

import numpy as np

from collaudit.core.conditioning.stamp_order import usable_order
from collaudit.core.data.joint_log import JointLog
from collaudit.core.findings import Finding, fact
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray
from collaudit.core.numeric.parallel import ordered_map
from collaudit.core.numeric.tables import copied

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
            out = copied(position) if out is position else out
            turned = np.zeros(log.time_s.size)
            turned[wraps] = turns[turns != 0]
            out[order, j] -= _TURN_RAD * np.cumsum(turned[order])
            findings.append(_wrapped(joint, log.time_s[wraps]))
        if cuts.size > max(3.0, _MOST * order.size):
            findings.append(_restless(joint, cuts.size, order.size))
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


def _wrapped(joint: str, times: FloatArray) -> Finding:
    text = (
        f"The position of joint '{joint}' starts again after a turn of 360 degrees, {times.size} times, first at "
        f"{times[0]:.4g} s; it was continued."
    )
    return fact(text, joint=joint, start_s=float(times[0]))


def _restless(joint: str, jumps: int, steps: int) -> Finding:
    text = (
        f"The position of joint '{joint}' jumps in {jumps} of {steps} steps as no joint moves: values that are held or "
        "disturbed. Too many to be cut out: the joint is not judged, and the model's torque of joints before it "
        "is computed from them."
    )
    return Finding("log-position-break", "error", text, joint=joint)
