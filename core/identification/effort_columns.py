"""What explains a joint's effort without contact, as columns of a regression: wide enough for any arm, held by a prior.

Of the description its torque and that torque's rate (an effort stamped late), free; and what its inertials may be off
by, tool and payload included, as the few directions in which that changes this motion's torque, about zero. Beside them
friction, rotor inertia, gravity about the joint's own axis, an offset. The samples are thinned: nothing here is faster
than the filters.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from collaudit.core.data.joint_log import MOVING_RAD_S
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray, blocks
from collaudit.core.numeric.filters import differentiate, low_pass
from collaudit.core.numeric.parallel import Progress
from collaudit.core.numeric.robust_regression import RobustFit
from collaudit.core.numeric.stats import few_values, median_of, quantile_of, robust_sd
from collaudit.core.prepare.prepared import Prepared
from collaudit.core.robot.robot_model import RobotModel
from collaudit.core.torque_table.log_samples import one_way

#: Samples looked at in a second; half of that in more than so many.
_RATE_HZ, _MANY = 50.0, 15_000
#: Samples whose inertial columns tell directions, and that the regression is made on.
_DRAWN = 6000
#: Around a reversal friction is not that of sliding: presliding and breakaway would be taken for contact.
_SETTLED_S = 0.15
_LEAST_S = 2.0  # of settled motion, for a joint to tell anything
#: Speeds over which friction may fall from breakaway: Stribeck velocities of gears, rad/s, and shares of the fastest.
_FADES, _OF_FASTEST = (0.03, 0.1), (0.15, 0.4)
#: A body may be off by this share of its mass, or of the arm's if that is more: an unstated tool.
_OWN_SHARE, _ARM_SHARE = 0.3, 0.03
#: Directions that change the torque by less than this share of the effort's spread, or come after so many, are left.
_NEGLIGIBLE, _MOST = 1e-3, 30
#: An effort of no more different values than this is known to a step at best.
_COARSE = 60
_AT_ONCE = 4096  # samples of inertial columns that memory holds


@dataclass(frozen=True, slots=True, eq=False)
class JointColumns:
    """One joint's effort and what explains it, at (m,) thinned samples.

    Attributes:
        j: the joint's column.
        period_s: of the samples.
        position, velocity, acceleration, effort: (m,); the effort filtered as the motion is.
        torque, rate: (m,) of the model and the tool, and its slope a second; None without a model.
        axes: (m, 3 a) sign, speed, acceleration of the axes that turn with several joints.
        known: (m,) where all of these are.
        settled: (m,) where the joint has slid one way for a while, and will.
        settled_draws: (k,) numbers of drawn samples that are settled; ``drawn`` (k,) of all samples.
        directions: (p, z) of the inertial parameters, each a standard deviation of the prior.
        prior_sd: (c,) of the coefficients of all columns.
        usual: robust standard deviation of the effort; step: that it comes in, 0 of a fine one.
        fastest: speed.
    """

    j: int
    period_s: float
    position: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    effort: FloatArray
    torque: FloatArray | None
    rate: FloatArray | None
    axes: FloatArray
    known: BoolArray
    settled: BoolArray
    settled_draws: IntArray
    drawn: IntArray
    directions: FloatArray
    prior_sd: FloatArray
    usual: float
    step: float
    fastest: float

    def friction(self, rows: IntArray) -> FloatArray:
        """(k, f) columns of friction: level, slope, what fades with speed, what goes with load."""
        speed, way = np.abs(self.velocity[rows]), np.where(self.velocity[rows] < 0, -1.0, 1.0)
        widths = (*_FADES, *(share * self.fastest for share in _OF_FASTEST))
        parts = [np.ones_like(speed), speed, *(np.exp(-speed / width) for width in widths)]
        if self.torque is not None:
            parts.append(np.abs(self.torque[rows]))
        return np.asarray(way[:, None] * np.column_stack(parts))

    def others(self, rows: IntArray) -> FloatArray:
        """(k, o) columns of offset, rotor, own gravity, axes, model and tool."""
        q, v, a = self.position[rows], self.velocity[rows], self.acceleration[rows]
        lag = a * np.exp(-np.abs(v) / _FADES[-1])
        parts = [np.ones_like(v), np.abs(v), a, lag, np.cos(q), np.sin(q), *self.axes[rows].T]
        if self.torque is not None and self.rate is not None:
            parts += [self.torque[rows], self.rate[rows]]
        return np.column_stack(parts)

    def columns(self, rows: IntArray, regressor: FloatArray) -> tuple[FloatArray, FloatArray]:
        """(k, f) of :meth:`friction` the way that the joint moves, and (k, c - f) of everything else.

        Args:
            rows: (k,) sample numbers.
            regressor: (k, p) derivative of the joint's torque by the inertial parameters there.
        """
        return self.friction(rows), np.column_stack([self.others(rows), regressor @ self.directions])

    def rest(self, rows: IntArray, regressor: FloatArray, fit: RobustFit) -> tuple[FloatArray, FloatArray]:
        """(k,) what a fit leaves at rows, and (k,) by how much the estimate's own error widens it.

        Unsettled friction is anything between that of both directions: what is left is what lies beyond.
        """
        friction, others = self.columns(rows, regressor)
        sliding = friction @ fit.coefficients[: friction.shape[1]]
        left = self.effort[rows] - others @ fit.coefficients[friction.shape[1] :]
        held = np.clip(left, -np.abs(sliding), np.abs(sliding))
        left -= np.where(self.settled[rows], sliding, held)
        return np.where(self.known[rows], left, 0.0), fit.widening(np.column_stack([friction, others]))


@dataclass(frozen=True, slots=True, eq=False)
class ThinnedMotion:
    """A log's motion at (m,) samples.

    Attributes:
        robot: the arm.
        count: n samples of the log; every: how many of them one stands for; period_s: from one to the next.
        rows: (m,) sample numbers.
        position, velocity, acceleration: (m, j).
        moving: (m,) where the motion is known and any joint moves.
        drawn: (d,) numbers of those whose inertial columns are at hand, one in ``thinning``.
        regressor: (d, j, p) derivative of the torques by the inertial parameters; p = 0 without a model.
    """

    robot: RobotModel
    count: int
    every: int
    period_s: float
    rows: IntArray
    position: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    moving: BoolArray
    drawn: IntArray
    thinning: int
    regressor: FloatArray

    def samples(self, values: BoolArray) -> BoolArray:
        """(n,) what is known at (m,) samples, at all of the log."""
        return values[np.minimum(np.arange(self.count) // self.every, values.size - 1)]

    def inertial(self, at: IntArray) -> FloatArray:
        """(k, j, p) at sample numbers."""
        if not self.robot.has_inertials:
            return np.zeros((at.size, self.velocity.shape[1], 0))
        return self.robot.torque_regressor(self.position[at], self.velocity[at], self.acceleration[at])

    def rests(
        self, joints: Sequence[JointColumns], fits: Sequence[RobustFit], progress: Progress
    ) -> list[tuple[FloatArray, FloatArray]]:
        """For each joint (m,) what its fit leaves, and (m,) by how much the estimate's own error widens that."""
        out = [(np.zeros(self.rows.size), np.ones(self.rows.size)) for _ in joints]
        moving = np.flatnonzero(self.moving)
        for block in blocks(moving.size, _AT_ONCE):
            at = moving[block]
            regressor = self.inertial(at)
            for joint, fit, (rest, widening) in zip(joints, fits, out, strict=True):
                rest[at], widening[at] = joint.rest(at, regressor[:, joint.j], fit)
            progress(block.stop, moving.size)
        return out


def motion_of(prepared: Prepared) -> ThinnedMotion:
    """The log's motion, thinned, with the inertial columns of some of it."""
    series, n = prepared.series, prepared.series.time_s.size
    every = max(1, round(1.0 / (_RATE_HZ * series.period_s)))
    every *= 1 if n <= _MANY * every else 2
    rows = np.arange(every // 2, n, every) if n > every else np.arange(n)
    q, v, a = (np.nan_to_num(np.asarray(table[rows]), nan=np.inf) for table in series.motion)
    known = np.isfinite(q + v + a).all(axis=1) & ~series.edge[rows]
    q, v, a = (np.where(known[:, None], x, 0.0) for x in (q, v, a))
    moving = known & (np.abs(v) > MOVING_RAD_S).any(axis=1)
    drawn = np.flatnonzero(moving)
    thinning = max(1, -(-drawn.size // _DRAWN))
    drawn, period_s = drawn[::thinning], every * series.period_s
    empty = np.zeros((0, v.shape[1], 0))
    out = ThinnedMotion(prepared.robot, n, every, period_s, rows, q, v, a, moving, drawn, thinning, empty)
    return replace(out, regressor=out.inertial(drawn))


def joint_columns(prepared: Prepared, motion: ThinnedMotion, j: int) -> JointColumns | None:
    """One joint's; None where it hardly moves or its effort is not known."""
    series, rows = prepared.series, motion.rows
    if series.effort is None:
        return None
    effort = low_pass(series.effort[:, j : j + 1], series.segments, series.period_s, series.bandwidth_hz)[rows, 0]
    known = motion.moving & np.isfinite(effort) & ~series.saturated[rows, j]
    torque = rate = None
    whole = prepared.explained_nm(series.joint_names[j])
    if whole is not None:
        torque, rate = whole[rows], differentiate(whole, series.segments, series.period_s)[rows]
        known &= np.isfinite(torque)
        torque, rate = (np.nan_to_num(np.where(known, x, 0.0)) for x in (torque, rate))
    margin = round(_SETTLED_S / series.period_s)
    # by time alone: a clamp begins at a standstill, and every moment after it is wanted
    settled, axes = known & one_way(series.velocity_rad_s[:, j], MOVING_RAD_S, margin)[rows], []
    for coupling in series.couplings:
        weights = np.array([coupling.weights.get(name, 0.0) for name in series.joint_names])
        if weights[j] != 0.0:  # where such an axis reverses, its friction is not that of sliding
            settled &= one_way(series.velocity_rad_s @ weights, MOVING_RAD_S, margin)[rows]
            speed = motion.velocity @ weights
            axes += [np.sign(speed), speed, motion.acceleration @ weights]
    settled_draws = np.flatnonzero(settled[motion.drawn])
    if np.count_nonzero(settled) * motion.period_s < _LEAST_S or settled_draws.size < 2:
        return None
    drawn = motion.drawn[settled_draws]
    usual = robust_sd(effort[drawn] - median_of(effort[drawn]))
    unknown = usual if torque is None or series.effort_unit != "Nm" else median_of(np.abs(effort - torque)[drawn])
    unit = 1.0
    if torque is not None and series.effort_unit != "Nm":
        unit = usual / max(robust_sd(torque[drawn] - median_of(torque[drawn])), 1e-9)
    directions = _directions(motion, j, settled_draws, unit * _inertial_sd(motion.robot), _NEGLIGIBLE * usual)
    out = JointColumns(
        j, motion.period_s, motion.position[:, j], motion.velocity[:, j], motion.acceleration[:, j],
        np.where(known, effort, 0.0), torque, rate, np.array(axes).reshape(-1, rows.size).T, known, settled,
        settled_draws, drawn, directions, np.zeros(0), usual, _step(series.effort[:, j]),
        quantile_of(np.abs(motion.velocity[drawn, j]), 0.999),
    )  # fmt: skip
    free = np.inf
    fades = [unknown] * (len(_FADES) + len(_OF_FASTEST))
    load = [] if torque is None else [free]
    count = out.others(drawn[:1]).shape[1]
    sd = [free, free, *fades, *load, *[free] * count, *[1.0] * directions.shape[1]]
    return replace(out, prior_sd=np.maximum(sd, 1e-9))


def _inertial_sd(robot: RobotModel) -> FloatArray:
    """(p,) of the prior: of a body's mass, and of its moments with the arm's usual radius of gyration about a joint."""
    if not robot.has_inertials:
        return np.zeros(0)
    ten = robot.inertial_parameters.reshape(-1, 10)
    mass = np.maximum(_OWN_SHARE * ten[:, 0], _ARM_SHARE * ten[:, 0].sum())
    heavy = ten[:, 0] > 0
    radius = np.sqrt(median_of(ten[heavy][:, [4, 6, 9]].sum(axis=1) / ten[heavy, 0]))
    return np.asarray((mass[:, None] * radius ** np.array([0, 1, 1, 1, 2, 2, 2, 2, 2, 2])).ravel())


def _directions(motion: ThinnedMotion, j: int, settled_draws: IntArray, sd: FloatArray, least: float) -> FloatArray:
    """(p, z) directions of the inertial parameters in which a standard deviation changes the joint's torque by more."""
    columns = motion.regressor[settled_draws, j] * sd
    values, vectors = np.linalg.eigh(columns.T @ columns / settled_draws.size)
    best = np.argsort(values)[::-1][:_MOST]
    return np.asarray(sd[:, None] * vectors[:, best[values[best] > least**2]])


def _step(effort: FloatArray) -> float:
    """The step of an effort that takes few different values; 0 of a finer one."""
    values = few_values(effort[np.isfinite(effort)], _COARSE)
    return 0.0 if values is None or values.size < 2 else float(np.median(np.diff(values)))
