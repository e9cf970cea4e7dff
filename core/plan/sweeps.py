"""Sweeps: one joint at a time, at constant speeds both ways, where the friction law needs them most for their time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from collaudit.core.data.friction_result import FrictionFit
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.plan.checks import STEP, MoveCheck
from collaudit.core.plan.friction_design import FrictionDesign, friction_design
from collaudit.core.plan.timing import Motion, move

#: Time at constant speed: ramps and settling take little of the longer one, which is asked for where its way is short.
LEVEL_S, LONG_S, _SHORT_WAY = 0.8, 2.0, 0.4
#: What a section loses at both ends to settling and to the filter of speed, s.
_LOST_S = 0.2
#: Shortest way at constant speed, rad (m): some periods of a gear's ripple.
LEAST_WAY = 0.03
SLOWEST = 0.01
PAUSE_S = 0.05
_SPEEDS = 24
#: Speeds of a joint whose friction is not settled, before any is asked for again: a law is chosen by speeds left out.
_DISTINCT = 8
_WANDER = 0.1  # share of a stroke that the next one starts farther along, so that a gear's ripple is averaged
_GOLDEN = 0.618
_SPREAD = 0.04  # share by which a speed that is asked for again differs
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
    """Speeds of all joints: the pair of sweeps that lowers relative variances most for its time, in turn.

    Args:
        check: limits of the arm.
        fits: friction of earlier logs, by joint.
        joints: numbers of those to sweep.
        seconds: of all sweeps at most.
        target: half width, as a share of the parameter, that is enough.
    """
    found = [nothing_swept(check, fits, j) for j in joints]
    grids = [speed_grid(check, sweeps) for sweeps in found]
    left = seconds
    while True:
        asked = [_next(sweeps, grid, left, target) for sweeps, grid in zip(found, grids, strict=True)]
        k = int(np.argmax([rate for rate, _, _ in asked]))
        rate, speed, cost = asked[k]
        if rate <= 0.0:
            return [sweeps for sweeps in found if sweeps.speeds]
        left -= cost
        found[k] = _with(found[k], speed)


def _next(sweeps: JointSweeps, grid: SpeedGrid, left: float, target: float) -> tuple[float, float, float]:
    """What a joint's best next pair of sweeps gains a second, its speed and its time; a gain of 0 where none is left.

    Other speeds than before come first until there are enough, then all, a little off those that were.
    """
    used = sum((np.abs(grid.speed / u - 1.0) < _SPREAD for u in sweeps.speeds), np.zeros(grid.speed.size))
    possible = grid.cost <= left
    if sweeps.design.points + len(sweeps.speeds) < _DISTINCT:
        possible &= used == 0
    elif sweeps.settled(target):
        return 0.0, 0.0, 0.0
    if not possible.any():
        return 0.0, 0.0, 0.0
    rate = np.where(possible, sweeps.design.gains(grid.gradients, sweeps.added) / grid.cost, 0.0)
    k = int(np.argmax(rate))
    return float(rate[k]), float(grid.speed[k] * (1.0 - 0.9 * _SPREAD * (used[k] * _GOLDEN % 1.0))), float(grid.cost[k])


def sweep_moves(
    check: MoveCheck, sweeps: JointSweeps, start: FloatArray, seconds: float
) -> tuple[list[Motion], JointSweeps]:
    """Moves of one joint's sweeps: both ways at every speed, the slow ones first, from start and back to it.

    Args:
        check: limits of the arm; links are free in the whole window.
        sweeps: which.
        start: (j,) positions before and after.
        seconds: of all moves at most, pauses included.

    Returns:
        The moves, and the sweeps without those that would break a limit or for which there is no time.
    """
    joint, (low, high) = sweeps.joint, sweeps.window
    at, heading = start.copy(), 1.0
    moves: list[Motion] = []
    done = JointSweeps(joint, sweeps.window, sweeps.design, (), np.zeros_like(sweeps.added))
    for speed in sorted(sweeps.speeds):
        way, part = _way(check, joint, speed), []
        if not low <= at[joint] + heading * way <= high:
            heading = -heading
        if not low <= at[joint] + heading * way <= high:  # no room either way from here
            part.append(move(check.limits, at, _put(at, joint, low if heading > 0 else high)))
        begin = part[-1].q[-1] if part else at
        there = _put(begin, joint, begin[joint] + heading * way)
        back = _put(begin, joint, float(np.clip(begin[joint] + heading * _WANDER * way, low, high)))
        part += [move(check.limits, begin, there, speed), move(check.limits, there, back, speed)]
        home = move(check.limits, back, start) if np.any(np.abs(back - start) > 1e-9) else None
        every = [*moves, *part, *([home] if home else [])]
        if sum(one.duration_s + PAUSE_S for one in every) > seconds or any(check.overloaded([*part, *every[-1:]])):
            continue
        moves, at, done = [*moves, *part], back, _with(done, speed)
    if np.any(np.abs(at - start) > 1e-9):
        moves.append(move(check.limits, at, start))
    return moves, done


def _put(pose: FloatArray, joint: int, position: float) -> FloatArray:
    return np.where(np.arange(pose.size) == joint, position, pose)


def nothing_swept(check: MoveCheck, fits: Mapping[str, FrictionFit], joint: int) -> JointSweeps:
    """A joint's window, and what is known of its friction, before any sweep."""
    name = check.limits.joint_names[joint]
    window = _window(check, joint)
    fastest = _fastest(check, joint, window)
    design = friction_design(fits.get(name), float(check.limits.torque[joint]), fastest)
    return JointSweeps(joint, window, design, (), np.zeros_like(design.known))


def _with(sweeps: JointSweeps, speed: float) -> JointSweeps:
    added = sweeps.added + sweeps.design.information(speed, useful_s(speed))
    return JointSweeps(sweeps.joint, sweeps.window, sweeps.design, (*sweeps.speeds, speed), added)


def _window(check: MoveCheck, joint: int) -> tuple[float, float]:
    """Positions about the start that the joint can move between with the others at rest."""
    start = check.limits.start
    ends = []
    for limit, way in ((check.limits.low[joint], -1.0), (check.limits.high[joint], 1.0)):
        reach = min(abs(float(limit - start[joint])), _WIDEST)
        apart = STEP * check.clearance_m / float(check.reach_m[joint])
        steps = np.linspace(0.0, reach, int(np.ceil(reach / apart)) + 1)
        ray = np.tile(start, (steps.size, 1))
        ray[:, joint] += way * steps
        found = check.shapes.touching(ray)
        last = steps.size - 1 if found is None else max(0, found[0] - 1)
        ends.append(float(start[joint]) + way * float(steps[last]))
    return ends[0], ends[1]


def _level_s(speed: float) -> float:
    """Time of a stroke at constant speed, s."""
    return max(LEVEL_S, min(LONG_S, _SHORT_WAY / speed), LEAST_WAY / speed)


def useful_s(speed: float) -> float:
    """Time of the section that a stroke gives, s."""
    return _level_s(speed) - _LOST_S


def _way(check: MoveCheck, joint: int, speed: float) -> float:
    """Length of a stroke, rad: constant speed for long enough, and both ramps, which the limit of the jerk rounds."""
    a, jerk = float(check.limits.acceleration[joint]), float(check.limits.jerk[joint])
    rounding = max(a / jerk, 2.0 * float(np.sqrt(speed / jerk)) - speed / a)
    return speed * (_level_s(speed) + speed / a + rounding)


def _fastest(check: MoveCheck, joint: int, window: tuple[float, float]) -> float:
    """Highest speed that has room in a window."""
    speeds = np.geomspace(SLOWEST, 0.98 * float(check.limits.speed[joint]), 60)
    return max((float(v) for v in speeds if _way(check, joint, float(v)) <= window[1] - window[0]), default=SLOWEST)


def speed_grid(check: MoveCheck, sweeps: JointSweeps) -> SpeedGrid:
    """Speeds that can be swept, and the time that both ways take; none where nothing has room."""
    joint, (low, high) = sweeps.joint, sweeps.window
    begin = _put(check.limits.start, joint, low)
    every = map(float, np.geomspace(SLOWEST, _fastest(check, joint, sweeps.window), _SPEEDS))
    ways = {v: way for v in every if (way := _way(check, joint, v)) <= high - low}
    motions = {v: move(check.limits, begin, _put(begin, joint, low + way), v) for v, way in ways.items()}
    over = check.overloaded(list(motions.values())) if motions else []
    kept = {v: motion for (v, motion), name in zip(motions.items(), over, strict=True) if name is None}
    speeds = np.array(list(kept))
    costs = np.array([2.0 * (motion.duration_s + PAUSE_S) for motion in kept.values()])
    return SpeedGrid(speeds, costs, sweeps.design.gradients(speeds, np.array([useful_s(v) for v in kept])))
