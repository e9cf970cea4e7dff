"""Rounds of sweeps: every joint strokes at a speed of its own, all along one line and back, since that takes no longer.

Half the difference of both ways is each joint's friction: gravity, Coriolis torques and the accelerations of the ramps
are even in the speeds and cancel (``friction/friction_points.py``).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.plan.checks import MoveCheck
from collaudit.core.plan.sweeps import PAUSE_S, WANDER, JointSweeps, level_s, ramps_s, useful_s
from collaudit.core.plan.timing import Motion, move


def sweep_moves(
    check: MoveCheck, sweeps: Sequence[JointSweeps], seconds: float
) -> tuple[list[Motion], list[JointSweeps]]:
    """Moves of all sweeps from the start and back to it, the slow speeds first.

    Rounds go to one side and to the other in turn: a drift of the effort's zero raises the friction of one pair and
    lowers that of the next. A round that would break a limit is done joint by joint.

    Args:
        check: limits of the arm.
        sweeps: of each joint.
        seconds: of all moves at most, pauses included.

    Returns:
        The moves, and the sweeps without those that would break a limit or for which there is no time.
    """
    windows = {one.joint: one.window for one in sweeps}
    left = {one.joint: sorted(one.speeds) for one in sweeps}
    done = {one.joint: replace(one, speeds=(), added=np.zeros_like(one.added)) for one in sweeps}
    moves: list[Motion] = []
    at, side = check.limits.start, 1.0
    while any(left.values()):
        together = _round(check, windows, left)
        for joint in together:
            del left[joint][0]
        part = _strokes(check, windows, together, at, side, seconds - time_s(moves))
        for group in [together] if part else [{joint: speed} for joint, speed in together.items()]:
            part = part or _strokes(check, windows, group, at, side, seconds - time_s(moves))
            if part:
                moves, at = [*moves, *part], part[-1].q[-1]
                seconds_each = useful_s(max(map(level_s, group.values())))
                done |= {joint: done[joint].with_pair(speed, seconds_each) for joint, speed in group.items()}
            part = []
        side = -side
    if np.any(np.abs(at - check.limits.start) > 1e-9):
        moves.append(move(check.limits, at, check.limits.start))
    return moves, [one for one in done.values() if one.speeds]


def time_s(moves: Sequence[Motion]) -> float:
    """Time of moves with a pause after each."""
    return sum(part.duration_s + PAUSE_S for part in moves)


def _round(
    check: MoveCheck, windows: Mapping[int, tuple[float, float]], left: Mapping[int, Sequence[float]]
) -> dict[int, float]:
    """The slowest speed that is left of each joint, but of those whose window is too small for the time of all."""
    heads = {joint: own[0] for joint, own in left.items() if own}
    longest = max(heads, key=lambda joint: level_s(heads[joint]))
    period = _period_s(check, heads)
    room = {j: v for j, v in heads.items() if v * period <= windows[j][1] - windows[j][0]}
    return room or {longest: heads[longest]}


def _period_s(check: MoveCheck, speeds: Mapping[int, float]) -> float:
    """Way over speed of a round's strokes: the longest time at constant speed, and the longest ramps."""
    return max(map(level_s, speeds.values())) + max(ramps_s(check, joint, v) for joint, v in speeds.items())


def _strokes(
    check: MoveCheck,
    windows: Mapping[int, tuple[float, float]],
    speeds: Mapping[int, float],
    at: FloatArray,
    side: float,
    seconds: float,
) -> list[Motion]:
    """Moves of a round: to where it begins, there and back; none where a limit or the time would be broken."""
    begin, there, period = at.copy(), at.copy(), _period_s(check, speeds)
    for joint, speed in speeds.items():
        low, high = windows[joint]
        ways = [way for way in (side * speed * period, -side * speed * period) if low <= at[joint] + way <= high]
        if not ways:  # no room either way from here
            begin[joint] = low if side > 0 else high
        there[joint] = begin[joint] + (ways[0] if ways else side * speed * period)
    fastest = max(speeds.values())
    back = begin + WANDER * (there - begin)
    part = [move(check.limits, at, begin)] if np.any(np.abs(begin - at) > 1e-9) else []
    part += [move(check.limits, begin, there, fastest), move(check.limits, there, back, fastest)]
    home = [move(check.limits, back, check.limits.start)] if np.any(np.abs(back - check.limits.start) > 1e-9) else []
    if time_s([*part, *home]) > seconds or check.problem(*part, *home) is not None:
        return []
    return part
