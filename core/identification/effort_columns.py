"""What explains a joint's effort without contact, as columns of a regression: wide enough for any arm, held by a prior.

Of the description its torque and that torque's rate (an effort stamped late), free; and what its inertials may be off
by, tool and payload included, as the few directions in which that changes this motion's torque, about zero. Beside them
friction, rotor inertia, gravity about the joint's own axis, an offset. The samples are thinned: nothing here is faster
than the filters.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from collaudit.core.data.uniform_series import MOVING_RAD_S, UniformSeries
from collaudit.core.dataclass import dataclass
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray
from collaudit.core.numeric.blocks import blocks
from collaudit.core.numeric.filters import differentiate, low_pass
from collaudit.core.numeric.robust_regression import RobustFit
from collaudit.core.numeric.stage_progress import Progress
from collaudit.core.numeric.stats import median_of, quantile_of, robust_sd
from collaudit.core.prepare.channel_shift import steady
from collaudit.core.prepare.prepared import Prepared
from collaudit.core.robot.robot_model import RobotModel

#: Samples looked at in a second; half of that where the log has more than so many.
_RATE_HZ, _MANY = 50.0, 30_000
#: Samples in motion that the regression is made on, and those whose inertial columns memory holds at once.
_DRAWN, _AT_ONCE = 6000, 4096
#: Around a reversal friction is not that of sliding: presliding and breakaway would be taken for contact.
_SETTLED_S = 0.15
_LEAST_S = 2.0  # of settled motion, for a joint to tell anything
#: Speeds over which friction may fall from breakaway: Stribeck velocities of gears, rad/s, and shares of the fastest.
_FADES, _OF_FASTEST = (0.03, 0.1), (0.15, 0.4)
#: A body may be off by this share of its mass, or of the arm's if that is more: an unstated tool.
_OWN_SHARE, _ARM_SHARE = 0.3, 0.03
#: Directions that change the torque by less than this share of the effort's spread, or come after so many, are left.
_NEGLIGIBLE, _MOST = 1e-3, 30
#: The spread of a residual is taken for no less than this share of the effort's own: no model is better than that.
_LEAST_SHARE = 0.01


@dataclass(frozen=True, slots=True, eq=False)
class JointColumns:
    """One joint's effort and what explains it, at (m,) thinned samples.

    Attributes:
        j: the joint's column.
        period_s: of the samples.
        speed, acceleration: (m,) their sizes.
        effort: (m,) filtered as the motion is.
        friction: (m, f) columns whose sign is that of the motion.
        others: (m, o) columns but for the inertial ones.
        known: (m,) where all of these are.
        settled: (m,) where the joint has slid one way for a while, and will.
        drawn: (k,) settled samples that the regression is made on; told: (k,) which they are of those drawn of the log.
        directions: (p, z) of the inertial parameters, each a standard deviation of the prior.
        prior_sd: (f + o + z,) of the coefficients, about zero.
        least: spread below which no model is believed, in the unit of the effort.
    """

    j: int
    period_s: float
    speed: FloatArray
    acceleration: FloatArray
    effort: FloatArray
    friction: FloatArray
    others: FloatArray
    known: BoolArray
    settled: BoolArray
    drawn: IntArray
    told: IntArray
    directions: FloatArray
    prior_sd: FloatArray
    least: float

    def columns(self, rows: IntArray, regressor: FloatArray) -> FloatArray:
        """(k, f + o + z) at rows (k,), with the derivative (k, p) of the joint's torque by the inertial parameters."""
        return np.column_stack([self.friction[rows], self.others[rows], regressor @ self.directions])

    def rest(self, rows: IntArray, regressor: FloatArray, fit: RobustFit) -> tuple[FloatArray, FloatArray]:
        """(k,) what a fit leaves at rows, and (k,) by how much the estimate's own error widens it.

        Unsettled friction is anything between that of both directions: what is left is what lies beyond.
        """
        columns, f = self.columns(rows, regressor), self.friction.shape[1]
        sliding = columns[:, :f] @ fit.coefficients[:f]
        left = self.effort[rows] - columns[:, f:] @ fit.coefficients[f:]
        held = np.clip(left, -np.abs(sliding), np.abs(sliding))
        left -= np.where(self.settled[rows], sliding, held)
        return np.where(self.known[rows], left, 0.0), fit.widening(columns)


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
    rows = np.arange(min(every // 2, n - 1), n, every)
    q, v, a = (x[rows] for x in (series.position_rad, series.velocity_rad_s, series.acceleration_rad_s2))
    known = np.isfinite(q + v + a).all(axis=1) & ~series.edge[rows]
    q, v, a = (np.where(known[:, None], x, 0.0) for x in (q, v, a))
    moving = known & (np.abs(v) > MOVING_RAD_S).any(axis=1)
    thinning = max(1, -(-int(np.count_nonzero(moving)) // _DRAWN))
    drawn, period_s = np.flatnonzero(moving)[::thinning], every * series.period_s
    nothing = np.zeros((0, v.shape[1], 0))
    out = ThinnedMotion(prepared.robot, n, every, period_s, rows, q, v, a, moving, drawn, thinning, nothing)
    return replace(out, regressor=out.inertial(drawn))


def joint_columns(prepared: Prepared, motion: ThinnedMotion, j: int) -> JointColumns | None:
    """One joint's; None where it hardly moves or its effort is not known."""
    series, rows = prepared.series, motion.rows
    if series.effort is None:
        return None
    effort = low_pass(series.effort[:, j : j + 1], series.segments, series.period_s, series.bandwidth_hz)[rows, 0]
    model = _model(prepared, rows, j)
    known = motion.moving & np.isfinite(effort) & np.isfinite(model).all(axis=1) & ~series.saturated[rows, j]
    effort, model = np.where(known, effort, 0.0), np.where(known[:, None], model, 0.0)
    slides, axes = _sliding(series, motion, j)
    told = np.flatnonzero((known & slides)[motion.drawn])
    drawn = motion.drawn[told]
    if np.count_nonzero(known & slides) * motion.period_s < _LEAST_S or told.size < 2:
        return None
    v, a, q = motion.velocity[:, j], motion.acceleration[:, j], motion.position[:, j]
    speed, way = np.abs(v), np.where(v < 0, -1.0, 1.0)
    fades = (*_FADES, *(share * quantile_of(speed[drawn], 0.999) for share in _OF_FASTEST))
    friction = np.column_stack([np.ones_like(v), speed, np.abs(model[:, :1]), *(np.exp(-speed / w) for w in fades)])
    lag = a * np.exp(-speed / _FADES[-1])
    others = np.column_stack([np.ones_like(v), speed, a, lag, np.cos(q), np.sin(q), model, *axes])
    usual, unit, unexplained = robust_sd(effort[drawn] - median_of(effort[drawn])), 1.0, effort[drawn]
    if model.shape[1] and series.effort_unit == "Nm":
        unexplained = unexplained - model[drawn, 0]  # friction, for the most part
    elif model.shape[1]:
        unit = usual / max(robust_sd(model[drawn, 0] - median_of(model[drawn, 0])), 1e-9)
    directions = _directions(motion, j, told, unit * _inertial_sd(motion.robot), _NEGLIGIBLE * usual)
    free = np.full(friction.shape[1] - len(fades), np.inf), np.full(others.shape[1], np.inf)
    fading = np.full(len(fades), max(median_of(np.abs(unexplained)), 1e-9))
    return JointColumns(
        j=j,
        period_s=motion.period_s,
        speed=speed,
        acceleration=np.abs(a),
        effort=effort,
        friction=way[:, None] * friction,
        others=others,
        known=known,
        settled=known & slides,
        drawn=drawn,
        told=told,
        directions=directions,
        prior_sd=np.concatenate([free[0], fading, free[1], np.ones(directions.shape[1])]),
        least=max(_LEAST_SHARE * usual, 1e-9),
    )


def _model(prepared: Prepared, rows: IntArray, j: int) -> FloatArray:
    """(m, 2) torque of the description and the tool on a joint, and its slope a second; (m, 0) without a model."""
    if prepared.rigid_nm is None:
        return np.zeros((rows.size, 0))
    contact = prepared.contact_nm
    torque = prepared.rigid_nm[:, j] if contact is None else prepared.rigid_nm[:, j] + contact[:, j]
    rate = differentiate(torque, prepared.series.segments, prepared.series.period_s)
    return np.column_stack([torque[rows], np.nan_to_num(rate[rows])])


def _sliding(series: UniformSeries, motion: ThinnedMotion, j: int) -> tuple[BoolArray, list[FloatArray]]:
    """(m,) where a joint, and every axis that turns with it and others, goes on one way; columns of those axes."""
    margin = round(_SETTLED_S / series.period_s)
    slides, columns = steady(series.velocity_rad_s[:, j], MOVING_RAD_S, margin)[motion.rows], []
    for coupling in series.couplings:
        weights = np.array([coupling.weights.get(name, 0.0) for name in series.joint_names])
        if weights[j] != 0.0:
            slides &= steady(series.velocity_rad_s @ weights, MOVING_RAD_S, margin)[motion.rows]
            speed = motion.velocity @ weights
            columns += [np.sign(speed), speed, motion.acceleration @ weights]
    return slides, columns


def _inertial_sd(robot: RobotModel) -> FloatArray:
    """(p,) of the prior: of a body's mass, and of its moments with the arm's usual radius of gyration about a joint."""
    if not robot.has_inertials:
        return np.zeros(0)
    ten = robot.inertial_parameters.reshape(-1, 10)
    mass = np.maximum(_OWN_SHARE * ten[:, 0], _ARM_SHARE * ten[:, 0].sum())
    heavy = ten[ten[:, 0] > 0]
    radius = np.sqrt(median_of(np.maximum(heavy[:, [4, 6, 9]].sum(axis=1), 0.0) / heavy[:, 0])) if heavy.size else 0.0
    return np.asarray((mass[:, None] * radius ** np.array([0, 1, 1, 1, 2, 2, 2, 2, 2, 2])).ravel())


def _directions(motion: ThinnedMotion, j: int, told: IntArray, sd: FloatArray, least: float) -> FloatArray:
    """(p, z) directions of the inertial parameters in which a standard deviation changes the joint's torque by more."""
    columns = motion.regressor[told, j] * sd
    values, vectors = np.linalg.eigh(columns.T @ columns / told.size)
    best = np.argsort(values)[::-1][:_MOST]
    return np.asarray(sd[:, None] * vectors[:, best[values[best] > least**2]])
