"""Sweeps: constant speeds both ways, where the friction laws need them most for the time that they take.

Every joint strokes at a speed of its own, all along one line and back, since that takes no longer: a pair of strokes
costs the time that it adds to the program, next to none where other joints take as long. Half the difference of both
ways is each joint's friction: gravity, Coriolis torques and the accelerations of the ramps are even in the speeds and
cancel (``friction/friction_points.py``).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import zip_longest

import numpy as np

from collaudit.core.data.friction_result import FrictionFit
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.plan.friction_design import FrictionDesign, friction_design
from collaudit.core.plan.moves import STEP, Motion, MoveCheck, move

#: Time at constant speed: ramps and settling take little of the longer one, which is asked for where its way is short.
LEVEL_S, LONG_S, _SHORT_WAY = 0.8, 2.0, 0.4
#: What a section loses at both ends to settling, s: a quarter of the stroke, within these bounds.
_LOST_S, _LOST_SHARE = (0.2, 0.4), 0.25
#: Share of a stroke that the next one starts farther along, so that ripple is averaged; the way back is shorter.
WANDER = 0.1
#: Shortest way at constant speed, rad (m): some periods of a gear's ripple.
LEAST_WAY = 0.03
SLOWEST = 0.01
PAUSE_S = 0.05
_SPEEDS = 24
#: Speeds of a joint whose friction is not settled, before any is asked for again: a law is chosen by speeds left out.
_DISTINCT = 8
_GOLDEN = 0.618
_SPREAD = 0.04  # share by which a speed that is asked for again differs
#: A pair that adds no time to the program is taken to add this share of its own.
_LEAST_SHARE = 0.1
_INSIDE = 1e-6  # rad off the end of the range: rounding passes no limit
_WIDEST = 1.6  # rad to either side of the start


@dataclass(frozen=True, slots=True, eq=False)
class JointSweeps:
    """What is swept of one joint.

    Attributes:
        joint: number.
        window: lowest and highest position, rad.
        design: what is known of its friction.
        speeds: rad/s, each both ways, in the order asked for.
        added: (g, p, p) information that they add.
    """

    joint: int
    window: tuple[float, float]
    design: FrictionDesign
    speeds: tuple[float, ...]
    added: FloatArray

    def with_pair(self, speed: float, seconds: float) -> JointSweeps:
        """With both ways at one more speed, each with a section of so many seconds."""
        return replace(self, speeds=(*self.speeds, speed), added=self.added + self.design.information(speed, seconds))

    def half_widths(self) -> dict[str, float]:
        """Predicted half widths of the parameters, by symbol."""
        return self.design.half_widths(self.added, len(self.speeds))

    def settled(self, target: float) -> bool:
        """Whether every parameter's half width is below a share ``target`` of its size."""
        values = self.design.guesses[len(self.design.guesses) // 2]
        return all(half <= target * abs(values[symbol]) for symbol, half in self.half_widths().items())


@dataclass(frozen=True, slots=True, eq=False)
class SpeedGrid:
    """(n,) speeds that can be swept, (n,) times of both ways, s, and (g, n, p) weighted derivatives of the curve."""

    speed: FloatArray
    cost: FloatArray
    gradients: FloatArray


def choose_sweeps(
    check: MoveCheck, fits: Mapping[str, FrictionFit], joints: Sequence[int], seconds: float, target: float
) -> list[JointSweeps]:
    """Speeds of all joints: the pair of strokes that lowers relative variances most for the time it adds, in turn.

    Args:
        check: limits of the arm.
        fits: friction of earlier logs, by joint.
        joints: numbers of those to sweep.
        seconds: of all sweeps at most.
        target: half width, as a share of the parameter, that is enough.
    """
    found = [nothing_swept(check, fits, j) for j in joints]
    grids = [speed_grid(check, sweeps) for sweeps in found]
    costs: list[list[float]] = [[] for _ in joints]
    while True:
        asked = [_next(sweeps, grid, target) for sweeps, grid in zip(found, grids, strict=True)]
        best = (0.0, 0, 0.0, 0.0)
        for k, (gain, speed, cost) in enumerate(asked):
            longer = program_s([*costs[:k], [*costs[k], cost], *costs[k + 1 :]])
            rate = gain / max(longer - program_s(costs), _LEAST_SHARE * cost) if cost else 0.0
            if longer <= seconds and rate > best[0]:
                best = (rate, k, speed, cost)
        rate, k, speed, cost = best
        if rate <= 0.0:
            return [sweeps for sweeps in found if sweeps.speeds]
        costs[k].append(cost)
        found[k] = found[k].with_pair(speed, useful_s(level_s(speed)))


def program_s(costs: Sequence[Sequence[float]]) -> float:
    """Time of rounds, s, in each of which every joint does one of its pairs: the longest of all joints together."""
    ordered = [sorted(own, reverse=True) for own in costs]
    return sum(max(one) for one in zip_longest(*ordered, fillvalue=0.0))


def _next(sweeps: JointSweeps, grid: SpeedGrid, target: float) -> tuple[float, float, float]:
    """What a joint's best next pair of strokes gains, its speed and its time; zeros where none is left.

    Other speeds than before come first until there are enough, then all, a little off those that were.
    """
    used = sum((np.abs(grid.speed / u - 1.0) < _SPREAD for u in sweeps.speeds), np.zeros(grid.speed.size))
    possible = np.ones(grid.speed.size, dtype=bool)
    if sweeps.design.points + len(sweeps.speeds) < _DISTINCT:
        possible = used == 0
    elif sweeps.settled(target):
        return 0.0, 0.0, 0.0
    if not possible.any():
        return 0.0, 0.0, 0.0
    gain = np.where(possible, sweeps.design.gains(grid.gradients, sweeps.added), 0.0)
    k = int(np.argmax(gain / grid.cost))
    return float(gain[k]), float(grid.speed[k] * (1.0 - 0.9 * _SPREAD * (used[k] * _GOLDEN % 1.0))), float(grid.cost[k])


def put(pose: FloatArray, joint: int, position: float) -> FloatArray:
    """A pose with one joint elsewhere."""
    return np.where(np.arange(pose.size) == joint, position, pose)


def nothing_swept(check: MoveCheck, fits: Mapping[str, FrictionFit], joint: int) -> JointSweeps:
    """A joint's window, and what is known of its friction, before any sweep."""
    name = check.limits.joint_names[joint]
    window = _window(check, joint)
    fastest = _fastest(check, joint, window)
    design = friction_design(fits.get(name), float(check.limits.torque[joint]), fastest)
    return JointSweeps(joint, window, design, (), np.zeros_like(design.known))


def _window(check: MoveCheck, joint: int) -> tuple[float, float]:
    """Positions about the start that the joint can move between with the others at rest."""
    start = check.limits.start
    ends = []
    for limit, way in ((check.limits.low[joint], -1.0), (check.limits.high[joint], 1.0)):
        reach = max(0.0, min(abs(float(limit - start[joint])) - _INSIDE, _WIDEST))
        apart = STEP * check.clearance_m / float(check.reach_m[joint])
        steps = np.linspace(0.0, reach, int(np.ceil(reach / apart)) + 1)
        ray = np.tile(start, (steps.size, 1))
        ray[:, joint] += way * steps
        found = check.shapes.touching(ray)
        last = steps.size - 1 if found is None else max(0, found[0] - 1)
        ends.append(float(start[joint]) + way * float(steps[last]))
    return ends[0], ends[1]


def level_s(speed: float) -> float:
    """Time of a stroke at constant speed, s."""
    return max(LEVEL_S, min(LONG_S, _SHORT_WAY / speed), LEAST_WAY / speed)


def useful_s(level: float) -> float:
    """Time of the sections that strokes both ways give, s; ``level``: of a stroke at constant speed."""
    back = (1.0 - WANDER) * level
    return back - min(max(_LOST_SHARE * back, _LOST_S[0]), _LOST_S[1])


def ramps_s(check: MoveCheck, joint: int, speed: float) -> float:
    """What both ramps add to the time at constant speed, as a share of the way; the limit of the jerk rounds them."""
    a, jerk = float(check.limits.acceleration[joint]), float(check.limits.jerk[joint])
    return speed / a + max(a / jerk, 2.0 * float(np.sqrt(speed / jerk)) - speed / a)


def _way(check: MoveCheck, joint: int, speed: float) -> float:
    """Length of a stroke, rad: constant speed for long enough, and both ramps."""
    return speed * (level_s(speed) + ramps_s(check, joint, speed))


def _fastest(check: MoveCheck, joint: int, window: tuple[float, float]) -> float:
    """Highest speed that has room in a window."""
    speeds = np.geomspace(SLOWEST, 0.98 * float(check.limits.speed[joint]), 60)
    return max((float(v) for v in speeds if _way(check, joint, float(v)) <= window[1] - window[0]), default=SLOWEST)


def speed_grid(check: MoveCheck, sweeps: JointSweeps) -> SpeedGrid:
    """Speeds that can be swept, and the time that both ways take; none where nothing has room."""
    joint, (low, high) = sweeps.joint, sweeps.window
    begin = put(check.limits.start, joint, low)
    every = map(float, np.geomspace(SLOWEST, _fastest(check, joint, sweeps.window), _SPEEDS))
    ways = {v: way for v in every if (way := _way(check, joint, v)) <= high - low}
    motions = {v: move(check.limits, begin, put(begin, joint, low + way), v) for v, way in ways.items()}
    over = check.overloaded(list(motions.values())) if motions else []
    kept = {v: motion for (v, motion), name in zip(motions.items(), over, strict=True) if name is None}
    speeds = np.array(list(kept))
    costs = np.array([2.0 * (motion.duration_s + PAUSE_S) for motion in kept.values()])
    return SpeedGrid(speeds, costs, sweeps.design.gradients(speeds, np.array([useful_s(level_s(v)) for v in kept])))


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
