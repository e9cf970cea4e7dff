"""Moves from rest to rest within an arm's hard limits: straight in joint space, timed, and checked.

Limits are the description's, replaced by what ``[plan]`` states; none is guessed silently. Ruckig (Berscheid and
Kroeger, Jerk-limited real-time trajectory generation with arbitrary target states, 2021) gives the fastest profile of
the share of the way; its phases of constant jerk are the knots of the motion, between which every position is a cubic
polynomial of time. So what is sampled from the knots is what was checked: range, torque with friction, links, table and
workspace.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from collaudit.core.config.schema import PlanConfig, RobotConfig
from collaudit.core.errors import ConfigError, NotJudgedError
from collaudit.core.friction.friction_model import FrictionModel
from collaudit.core.numeric.arrays import BoolArray, FloatArray
from collaudit.core.robot.arm_shapes import ArmShapes, Surroundings
from collaudit.core.robot.robot_description import unknown_name
from collaudit.core.robot.robot_model import RobotModel

#: Where no acceleration is stated, the highest speed takes a second; where no jerk is, the highest acceleration 0.2 s.
TO_SPEED_S, TO_ACCELERATION_S = 1.0, 0.2
#: Kept free at each end of a joint's range, rad (m if prismatic): what a drive overshoots.
POSITION_MARGIN_RAD = 0.05
#: Share of a drive's highest torque that model and friction together may ask for; the rest is the controller's.
TORQUE_SHARE = 0.8
_BY_JOINT = ("start_rad", "position_rad", "speed_rad_s", "acceleration_rad_s2", "torque_nm")
#: Time is stretched by this: no limit is met exactly, so that rounding in a file cannot pass it.
RESERVE = 1.01
#: Links are checked with this many clearances, at positions between which no point moves farther than half of one:
#: two points approach each other by half a clearance at most in between.
MARGIN, STEP = 1.5, 0.5
#: Friction of a joint without a law, as a share of its highest torque.
UNKNOWN_FRICTION = 0.2
#: Where torque is looked at: so often where speeds change, so far apart where they do not. It bends little in between,
#: and is kept away from the limit by this share.
_TORQUE_STEP_S, _TORQUE_WAY, _TORQUE_RESERVE = 0.02, 0.05, 0.97


@dataclass(frozen=True, slots=True, eq=False)
class ArmLimits:
    """What a motion keeps within; rad and N·m, or m and N of prismatic joints.

    Attributes:
        joint_names: j joints in model order.
        low, high: (j,) positions, margin taken off.
        speed, acceleration, jerk: (j,).
        torque: (j,), the share that may be asked for taken.
        start: (j,) where the motion starts and ends.
        assumed: which limits are not stated, in words.
    """

    joint_names: tuple[str, ...]
    low: FloatArray
    high: FloatArray
    speed: FloatArray
    acceleration: FloatArray
    jerk: FloatArray
    torque: FloatArray
    start: FloatArray
    assumed: tuple[str, ...]

    def inside(self, q: FloatArray) -> BoolArray:
        """(n,) which of (n, j) positions are within the range of every joint."""
        return np.asarray(np.all((q >= self.low - 1e-9) & (q <= self.high + 1e-9), axis=1))


def arm_limits(robot: RobotModel, settings: RobotConfig, plan: PlanConfig,
               speed_scale: float = 1.0) -> ArmLimits:  # fmt: skip
    """Limits of an arm.

    Args:
        robot: the arm.
        settings, plan: the configuration's tables.
        speed_scale: the motion takes 1 / speed_scale of its time: speeds shrink by it, accelerations by its square,
            jerks by its cube.

    Raises:
        ConfigError: a limit is neither described nor stated, or the start is outside of the limits.
    """
    if settings.reduction is not None or settings.joint_offset_rad is not None:
        raise ConfigError(
            "no motion is planned for an arm whose controller counts other joint angles than its description",
            where="[robot] reduction, joint_offset_rad",
            hint="give a configuration for the plan whose description has the controller's zero, without these keys",
        )
    names = robot.joint_names
    for key in _BY_JOINT:
        for name in getattr(plan, key):
            if name not in names:
                raise unknown_name("the robot has no such joint", f"[plan] {key}", name, names)
    described = zip(names, robot.position_limits, strict=True)
    ranges = np.array([plan.position_rad.get(name, tuple(row)) for name, row in described])
    speed = _stated(plan.speed_rad_s, names, robot.speed_limits)
    torque = _stated(plan.torque_nm, names, robot.effort_limit_nm)
    _refuse_missing(names, {"position_rad": ranges.sum(axis=1), "speed_rad_s": speed, "torque_nm": torque})
    low, high = ranges[:, 0] + POSITION_MARGIN_RAD, ranges[:, 1] - POSITION_MARGIN_RAD
    for name, a, b in zip(names, low, high, strict=True):
        if not a < b:
            raise ConfigError("the range of a joint leaves no room", where=f"[plan] position_rad: {name}",
                              found=f"{a:.3g} to {b:.3g}, margin taken off", expected="room")  # fmt: skip
    acceleration = _stated(plan.acceleration_rad_s2, names, speed / TO_SPEED_S)
    jerk = acceleration / TO_ACCELERATION_S
    start = _stated(plan.start_rad, names, 0.5 * (low + high))
    found = ArmLimits(
        names, low, high, speed * speed_scale, acceleration * speed_scale**2, jerk * speed_scale**3,
        TORQUE_SHARE * torque, start, _assumed(plan, names),
    )  # fmt: skip
    _refuse_start(found)
    return found


def _stated(stated: Mapping[str, float], names: tuple[str, ...], otherwise: FloatArray) -> FloatArray:
    return np.array([stated.get(name, float(value)) for name, value in zip(names, otherwise, strict=True)])


def _refuse_missing(names: tuple[str, ...], known: Mapping[str, FloatArray]) -> None:
    for key, values in known.items():
        lacking = [name for name, value in zip(names, values, strict=True) if not np.isfinite(value)]
        if lacking:
            raise ConfigError(
                "the arm has no such limit, and none is guessed",
                where=f"[plan] {key}",
                found=f"nothing for {', '.join(lacking)}, neither in the robot's description nor stated",
                expected="a value for every joint",
                hint=f"state it from the robot's data sheet, e.g. {key} = {{ {lacking[0]} = … }}",
            )


def _refuse_start(limits: ArmLimits) -> None:
    for k, name in enumerate(limits.joint_names):
        if not limits.low[k] <= limits.start[k] <= limits.high[k]:
            raise ConfigError(
                "the start is outside of the joint's range",
                where=f"[plan] start_rad: {name}",
                found=f"{limits.start[k]:.4g}",
                expected=f"{limits.low[k]:.4g} to {limits.high[k]:.4g}, margin taken off",
            )


def _assumed(plan: PlanConfig, names: tuple[str, ...]) -> tuple[str, ...]:
    words = [f"jerk: taken so that the highest acceleration takes {TO_ACCELERATION_S:g} s"]
    if lacking := [name for name in names if name not in plan.acceleration_rad_s2]:
        text = (
            f"acceleration of {', '.join(lacking)}: not stated, taken so that the highest speed takes {TO_SPEED_S:g} s"
        )
        words.insert(0, text)
    if lacking := [name for name in names if name not in plan.start_rad]:
        words.append(f"start of {', '.join(lacking)}: not stated, the middle of the range")
    return tuple(words)


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """Knots of a motion whose positions are cubic in time between them.

    Attributes:
        time_s: (k,) ascending, from 0.
        q, v: (k, j) rad and rad/s.
    """

    time_s: FloatArray
    q: FloatArray
    v: FloatArray

    @property
    def duration_s(self) -> float:
        """How long it takes."""
        return float(self.time_s[-1])

    def sampled(self, period_s: float) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Times (n,), positions, velocities and accelerations (n, j) every ``period_s`` and at the end."""
        count = int(np.ceil(self.duration_s / period_s - 1e-9))
        return self.at(np.minimum(np.arange(count + 1) * period_s, self.duration_s))

    def watched(self, period_s: float, way: float) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """As :meth:`sampled`, at every knot and between: so often where speeds change, else so far apart (rad, m)."""
        length, level = np.diff(self.time_s), np.all(np.diff(self.v, axis=0) == 0.0, axis=1)
        steps = np.where(level, np.abs(np.diff(self.q, axis=0)).max(axis=1) / way, length / period_s)
        count = np.maximum(np.ceil(steps), 1.0).astype(np.int64)
        phase = np.repeat(np.arange(count.size), count)
        within = np.arange(phase.size) - (np.cumsum(count) - count)[phase]
        return self.at(np.append(self.time_s[phase] + within / count[phase] * length[phase], self.time_s[-1]))

    def with_knots(self, period_s: float) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """As :meth:`sampled`, and at every knot: what is cubic between these rows is the motion itself."""
        grid = np.arange(0.0, self.duration_s, period_s)
        near = np.searchsorted(self.time_s, grid)
        gap = np.minimum(
            np.abs(grid - self.time_s[near - 1]), np.abs(self.time_s[np.minimum(near, self.time_s.size - 1)] - grid)
        )
        return self.at(np.union1d(self.time_s, grid[gap > 0.1 * period_s]))

    def at(self, t: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Times (n,), and positions, velocities and accelerations (n, j) there, by cubic Hermite interpolation."""
        from scipy.interpolate import CubicHermiteSpline  # takes a while to import

        motion = CubicHermiteSpline(self.time_s, self.q, self.v)
        return t, motion(t), motion(t, 1), motion(t, 2)


def move(limits: ArmLimits, start: FloatArray, goal: FloatArray, speed: float | None = None) -> Motion:
    """The fastest straight move from rest to rest.

    Args:
        limits: of the arm.
        start, goal: (j,) rad.
        speed: of the joint with the longest way at most, rad/s; None for as fast as the limits let it.

    Raises:
        NotJudgedError: ruckig is not installed.
    """
    way = goal - start
    size = np.abs(way)
    active = size > 1e-9
    top, acceleration, jerk = (
        float(np.min(limit[active] / size[active])) for limit in (limits.speed, limits.acceleration, limits.jerk)
    )
    top /= RESERVE
    if speed is not None:
        top = min(top, speed / float(size.max()))
    time, share, rate = _profile(top, acceleration / RESERVE**2, jerk / RESERVE**3)
    return Motion(time, start + share[:, None] * way, rate[:, None] * way)


def _profile(top: float, acceleration: float, jerk: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Times, shares of the way and their rates (k,) at the ends of the phases of the profile from 0 to 1."""
    try:
        from ruckig import InputParameter, Ruckig, Trajectory
    except ImportError as error:
        raise NotJudgedError("motions are timed with ruckig, which is not installed",
                             hint='pip install "collaudit[plan]"') from error  # fmt: skip
    asked, found = InputParameter(1), Trajectory(1)
    asked.current_position, asked.target_position = [0.0], [1.0]
    asked.max_velocity, asked.max_acceleration, asked.max_jerk = [top], [acceleration], [jerk]
    result = Ruckig(1).calculate(asked, found)
    if int(result.value) < 0:
        raise RuntimeError(f"ruckig gives no profile: {result}")
    profile = found.profiles[0][0]
    length = np.array(profile.t)
    time = np.concatenate([[0.0], np.cumsum(length)])
    kept = np.concatenate([[True], length > 1e-9])
    return time[kept], np.array(profile.p)[kept], np.array(profile.v)[kept]


def joined(moves: Sequence[Motion], pause_s: float) -> Motion:
    """Moves one after the other, with a pause at rest after each; each must start where the one before ends."""
    times, q, v, now = [], [], [], 0.0
    for part in moves:
        times.append(part.time_s + now)
        q.append(part.q)
        v.append(part.v)
        now += part.duration_s + pause_s
    every = np.concatenate(times)
    keep = np.r_[True, np.diff(every) > 1e-9]
    return Motion(every[keep], np.concatenate(q)[keep], np.concatenate(v)[keep])


@dataclass(frozen=True, slots=True, eq=False)
class MoveCheck:
    """All limits of an arm.

    Attributes:
        robot: the arm; without inertials no torque is checked.
        limits: hard limits.
        shapes: of links and surroundings, with ``MARGIN`` clearances.
        reach_m: (j,) of the shapes.
        clearance_m: as stated.
        friction: laws by joint.
    """

    robot: RobotModel
    limits: ArmLimits
    shapes: ArmShapes
    reach_m: FloatArray
    clearance_m: float
    friction: Mapping[str, FrictionModel]

    def problem(self, *motions: Motion) -> str | None:
        """What motions from rest to rest violate, in words; None where they keep all limits."""
        if not all(self.limits.inside(motion.q).all() for motion in motions):
            return "a joint's range"
        for joint in self.overloaded(motions):
            if joint is not None:
                return f"the torque of {joint}"
        found = self.shapes.touching(np.concatenate([self._places(motion) for motion in motions]))
        return None if found is None else found[1]

    def torque_nm(self, q: FloatArray, v: FloatArray, a: FloatArray) -> FloatArray:
        """(n, j) torque of model and friction; friction that is not known, or at rest, in the worse direction."""
        torque = self.robot.inverse_dynamics(q, v, a)
        for j, name in enumerate(self.robot.joint_names):
            law, speed = self.friction.get(name), np.abs(v[:, j])
            worse = np.sign(torque[:, j])
            if law is None:
                torque[:, j] += worse * UNKNOWN_FRICTION * float(self.limits.torque[j])
                continue
            size = np.maximum(np.abs(law.torque(v[:, j])), np.where(speed > law.speed_range[0], 0.0, law.hold))
            torque[:, j] += np.where(speed > 1e-6, np.sign(v[:, j]), worse) * size
        return torque

    def overloaded(self, motions: Sequence[Motion]) -> list[str | None]:
        """Of every motion a joint whose torque exceeds its limit; None where none does, or no model tells."""
        if not self.robot.has_inertials:
            return [None] * len(motions)
        samples = [motion.watched(_TORQUE_STEP_S, _TORQUE_WAY)[1:] for motion in motions]
        torque = self.torque_nm(*(np.concatenate(part) for part in zip(*samples, strict=True)))
        over = np.abs(torque) > _TORQUE_RESERVE * self.limits.torque
        ends = np.cumsum([len(q) for q, _, _ in samples])[:-1]
        each = [part.any(axis=0) for part in np.split(over, ends)]
        return [self.robot.joint_names[int(np.argmax(one))] if one.any() else None for one in each]

    def _places(self, motion: Motion) -> FloatArray:
        """(m, j) positions along a motion, at most half a clearance of any point's way apart."""
        out = [motion.q[:1]]
        for a, b in zip(motion.q, motion.q[1:], strict=False):  # between knots of a straight move
            way = float(np.abs(b - a) @ self.reach_m)
            count = int(np.ceil(way / (STEP * self.clearance_m)))
            out.append(a + np.linspace(0.0, 1.0, count + 1)[1:, None] * (b - a) if count else b[None])
        return np.concatenate(out)


def padded(around: Surroundings) -> Surroundings:
    """Surroundings with the margin that checks at single positions need."""
    return replace(around, clearance_m=MARGIN * around.clearance_m)
