"""Causes, each a few columns of torque beside the residual: what it would add, had it been left out of the model.

With the residual r = effort - model of eq. (5), a cause with parameters b explains the part X b of it.
b is found by least squares from sums over blocks of time, and held against blocks that the solve has not seen.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from collaudit.core.causes.excess import Excess, rms
from collaudit.core.numeric.arrays import BoolArray, FloatArray
from collaudit.core.numeric.stats import STANDARD_ERRORS_95
from collaudit.core.residual.followed_offsets import BOUND_SHARE, LARGEST
from collaudit.core.robot.robot_model import RobotModel
from collaudit.core.torque_table.block_sums import Estimate, estimate, products_of


@dataclass(frozen=True, slots=True, eq=False)
class Trial:
    """One cause to be tried.

    Attributes:
        kind: of the cause.
        joints: those that it is about; empty for the arm.
        columns_nm: (n, j, k) torque for one unit of each parameter.
        prior_sd: (k,) physical width of the parameters, which holds what the motion does not tell.
        fit_sd: (k,) standard errors of what a fit has wrong of the parameters. That is alike in all of a log, so its
            scatter does not show it.
        what: the name of what is tried, beside joints.
    """

    kind: str
    joints: tuple[str, ...]
    columns_nm: FloatArray
    prior_sd: FloatArray
    fit_sd: Sequence[float] = (0.0,)
    what: str = ""


def trials(
    table: Excess,
    robot: RobotModel,
    described: RobotModel,
    gravity: bool,
    load_sd: Sequence[float],
    siblings: Iterable[tuple[str, RobotModel]] = (),
) -> Iterator[Trial]:
    """Every cause, the simplest first.

    Args:
        table: what is left over.
        robot: as the log was judged with, its tool included.
        described: the same without what a fit found.
        gravity: whether the effort holds that of gravity.
        load_sd: (4,) how well a load is known against what the fit identified.
        siblings: other descriptions of the family, by name, on the same base and with the same tool.
    """
    yield Trial("friction", (), table.friction_nm[:, :, None], np.array([1.0]))
    yield Trial("scale", (), table.model_nm[:, :, None], np.array([2.0]))
    yield Trial("delay", (), -table.slope_nm_s[:, :, None], np.array([0.1]))
    alone: dict[str, list[Trial]] = {"friction": [], "scale": [], "zero": []}
    for j, joint in enumerate(table.joints):
        alone["friction"].append(Trial("friction", (joint,), only(table.friction_nm, j), np.array([1.0])))
        alone["scale"].append(Trial("scale", (joint,), only(table.model_nm, j), np.array([2.0])))
        alone["zero"].append(Trial("zero", (joint,), _zero(table, j), np.full(2, 1e3 * table.usual_nm[j])))
        yield from (trials_of[j] for trials_of in alone.values())
    for i, k in combinations(range(len(table.joints)), 2):
        swapped = np.zeros_like(table.model_nm)
        swapped[:, i] = table.model_nm[:, k] - table.model_nm[:, i]
        swapped[:, k] = table.model_nm[:, i] - table.model_nm[:, k]
        known = table.known[:, i] & table.known[:, k]
        yield Trial("swapped", (table.joints[i], table.joints[k]), (swapped * known[:, None])[:, :, None], np.ones(1))
    if gravity:
        yield Trial("mounting", (), _of(table, lambda q, *_: robot.gravity_regressor(q)), np.full(3, 10.0))
        load = _of(table, lambda *motion: load_torques(robot, motion))
        yield Trial("tool", (), load, np.array([20.0, 5.0, 5.0, 5.0]), load_sd)
        for name, sibling in siblings:
            other, own = (_of(table, _rigid(one)) for one in (sibling, described))
            yield Trial("description", (), other - own, np.ones(1), what=name)
    end = robot.tool_frame
    yield Trial("pull", (), _of(table, lambda q, *_: robot.torque_per_newton(q, end)), np.full(3, 500.0))
    for at, place in (((), end), *_places(table, robot)):
        columns = _of(table, lambda q, *_, place=place: robot.base_torque_per_newton(q, place))
        yield Trial("force", at, columns, np.full(3, 500.0))
    if len(table.joints) > 1:
        for kind, its in alone.items():
            columns = np.concatenate([one.columns_nm for one in its], axis=2)
            yield Trial(kind, table.joints, columns, np.concatenate([one.prior_sd for one in its]))


def _places(table: Excess, robot: RobotModel) -> list[tuple[tuple[str, ...], str]]:
    """The ends of the links before the last: the joint that moves each, and a frame."""
    ends = ((joint, frame) for joint in table.joints[:-1] for frame in {robot.link_of(joint), robot.outer_frame(joint)})
    return sorted(((joint,), frame) for joint, frame in ends if frame is not None)


def only(torque_nm: FloatArray, j: int) -> FloatArray:
    """(n, j, 1) of one joint."""
    out = np.zeros((*torque_nm.shape, 1))
    out[:, j, 0] = torque_nm[:, j]
    return out


def _zero(table: Excess, j: int) -> FloatArray:
    """(n, j, 2) a constant torque of one joint, and one that drifts over the log, each of one N·m."""
    out = np.zeros((*table.known.shape, 2))
    out[:, j, 0] = table.known[:, j]
    out[:, j, 1] = table.known[:, j] * np.linspace(-1.0, 1.0, table.time_s.size)
    return out


def _of(table: Excess, torque_of: Callable[[FloatArray, FloatArray, FloatArray], FloatArray]) -> FloatArray:
    """(n, j, k) of the judged joints, by a function of position, velocity and acceleration (n, joints) without NaN."""
    moving = np.isfinite(np.hstack(table.motion)).all(axis=1)
    some = torque_of(*(np.ascontiguousarray(x[moving]) for x in table.motion))[:, table.columns]
    out = np.zeros((moving.size, *some.shape[1:]))
    out[moving] = some
    return out * table.known[:, :, None]


def _rigid(robot: RobotModel) -> Callable[[FloatArray, FloatArray, FloatArray], FloatArray]:
    """(n, j, 1) torque of rigid bodies, by a motion."""
    return lambda *motion: robot.inverse_dynamics(*motion)[:, :, None]


def load_torques(robot: RobotModel, motion: Sequence[FloatArray]) -> FloatArray:
    """(n, j, 4) torque of a body at the tool's frame: of a kg at its origin, and of kg·m along its axes.

    Its inertia about its own centre is left out: it hardly shows beside what a load weighs.

    Args:
        robot: with inertials.
        motion: position, velocity, acceleration, (n, j) each, without NaN.
    """
    turn, place, body = robot.in_joint(None)
    regressor = robot.torque_regressor(*(np.ascontiguousarray(x) for x in motion))
    mass, first = regressor[:, :, 10 * body], regressor[:, :, 10 * body + 1 : 10 * body + 4]
    return np.concatenate([(mass + first @ place)[:, :, None], first @ turn], axis=2)


#: Standard errors by which one cause must leave less than another to be told from it.
_CLEARLY = 3.0
#: What acts by the arm's pose. A zero that is held to its bound, or friction that changed in another way than by its
#: level, would be told as a part of it: 0.02 kg of a load, of a UR10.
_OF_POSES = frozenset({"tool", "mounting", "force", "pull"})


@dataclass(frozen=True, slots=True, eq=False)
class Solved:
    """One cause, tried.

    Attributes:
        trial: what was tried.
        value, half_width: (k,) parameters and half of their 95 % intervals, from blocks of time.
        share: of the excess that is gone in blocks that the solve has not seen; below 0 it makes things worse.
        least_share: of the two halves of the log the one in which less is gone.
        rest: (b,) what is left in each block by the solve that has not seen it: RMS over the usual, summed over joints.
    """

    trial: Trial
    value: FloatArray
    half_width: FloatArray
    share: float
    least_share: float
    rest: FloatArray

    def beats(self, other: Solved) -> bool:
        """Whether it clearly leaves less than another cause, over the blocks of time."""
        more = other.rest - self.rest
        return bool(more.mean() > _CLEARLY * more.std() / np.sqrt(more.size))


def solved(table: Excess, trial: Trial, before: FloatArray) -> Solved | None:
    """Try one cause; None where the motion does not hold it.

    Args:
        table: what is left over.
        trial: the cause.
        before: (b, j) excess of each block and joint without it.
    """
    if not trial.columns_nm.any():
        return None
    sums = _Sums.of(table, trial)
    gone, whole, rest = np.zeros(2), np.zeros(2), np.zeros(before.shape[0])
    for half in (0, 1):
        own = table.half == half
        size = sums.explained(table.half != half)[2]
        rest[own] = np.nan_to_num(size).sum(axis=1)[own]
        whole[half], gone[half] = before[own].sum(), (before[own] - table.beyond(size)[own]).sum()
    if not whole.all():
        return None
    every = np.ones(before.shape[0], dtype=np.bool_)
    if trial.kind in _OF_POSES:
        day = _Sums.of(table, trial, whole_day=True)  # of which nothing is held
        value, half_width = day.own(day.solve(every))
    else:
        value, half_width, _ = sums.explained(every)
    half_width = np.hypot(half_width, STANDARD_ERRORS_95 * np.array(trial.fit_sd))
    return Solved(trial, value, half_width, float(gone.sum() / whole.sum()), float((gone / whole).min()), rest)


@dataclass(frozen=True, slots=True, eq=False)
class _Sums:
    """Products of the columns of a cause, of what is followed beside it, and of the torque: over blocks of time.

    Each joint's level of friction and zero of torque are followed within the bounds in which a residual follows them:
    else a load is told too small. A solve of some blocks, and what it leaves in each, need these sums alone.

    What another day and the errors of a fit leave is more: both drift over the log, sliding friction changes beside its
    level, rotors are a tenth too large, and the zero lies as far off as a threshold.

    Attributes:
        products: (b, j, m, m) of the joint's m = k + f + 1 columns, in units of its usual level: k of the cause, f
            followed ones, the torque.
        count: (b, j) samples.
        prior_sd: (k,) of the cause's parameters.
        bound: (f, j) of the followed parameters.
    """

    products: FloatArray
    count: FloatArray
    prior_sd: FloatArray
    bound: FloatArray

    @classmethod
    def of(cls, table: Excess, trial: Trial, whole_day: bool = False) -> _Sums:
        """Of a cause's columns (n, j, k), beside what a residual follows, or all that a day may change."""
        followed, bound = [], []
        level, zero = np.full(len(table.joints), LARGEST), np.maximum(table.zero_bound_nm, 1e-9)
        if trial.kind != "friction":
            followed.append(table.friction_nm)
            bound.append(level)
        if trial.kind != "zero":
            followed.append(table.known.astype(float))
            bound.append(zero)
        if whole_day:
            drift = np.linspace(-1.0, 1.0, table.time_s.size)[:, None]
            spin = np.nan_to_num(table.motion[2][:, table.columns])
            followed += [drift * table.known, drift * table.friction_nm, np.sign(table.friction_nm), spin]
            zero = zero / BOUND_SHARE
            bound = [level, zero, zero, 0.5 * level, zero, zero]
        columns = np.concatenate([trial.columns_nm, np.stack([*followed, table.torque_nm], axis=2)], axis=2)
        columns = columns * (table.known / table.usual_nm)[:, :, None]
        return cls(
            products_of(columns, table.block),
            table.count,
            trial.prior_sd,
            np.array(bound).reshape(-1, len(table.joints)),
        )

    def explained(self, blocks: BoolArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """(k,) parameters of the cause by some of the blocks, half of their intervals, and (b, j) what all blocks keep.

        That is the RMS over the joint's usual level, NaN where too little is known.
        """
        count, found = self.prior_sd.size, self.solve(blocks)
        half_width = self.own(found)[1]
        followed = found.value[count:].reshape(self.bound.shape)
        level = np.clip(followed, -self.bound, self.bound)
        if np.any(level != followed):
            found = self.with_followed(level).solve(blocks)
        own = found.value[:count]
        return own, half_width, self.size(own, level)

    def own(self, found: Estimate) -> tuple[FloatArray, FloatArray]:
        """(k,) of a solution the parameters of the cause, and half of their intervals."""
        count = self.prior_sd.size
        variance = np.maximum(np.diag(found.covariance)[:count], 0.0)
        return found.value[:count], STANDARD_ERRORS_95 * np.sqrt(variance)

    def solve(self, blocks: BoolArray) -> Estimate:
        """Parameters of some blocks: k of the cause, then f of each joint, one followed column after the other."""
        count, (followed, joints) = self.prior_sd.size, self.bound.shape
        own = np.tile(np.arange(count), (joints, 1))
        place = np.hstack([own, count + np.arange(followed * joints).reshape(followed, joints).T])
        prior = np.concatenate([self.prior_sd, self.bound.ravel()]) ** -2.0
        return estimate(self.products[blocks], self.count[blocks], place, prior, usual=1.0)

    def with_followed(self, level: FloatArray) -> _Sums:
        """Without the followed columns, of which (f, j) is taken off the torque."""
        count, (followed, joints) = self.prior_sd.size, level.shape
        kept = np.zeros((joints, count + followed + 1, count + 1))
        kept[:, np.arange(count), np.arange(count)] = 1.0
        kept[:, -1, -1] = 1.0
        kept[:, count:-1, -1] = -level.T
        products = kept.transpose(0, 2, 1) @ self.products @ kept
        return _Sums(products, self.count, self.prior_sd, np.zeros((0, joints)))

    def size(self, own: FloatArray, level: FloatArray) -> FloatArray:
        """(b, j) RMS of what these parameters leave; NaN where too little is known."""
        all_of_joint = np.hstack([np.tile(own, (level.shape[1], 1)), level.T, -np.ones((level.shape[1], 1))])
        return rms(np.sum((self.products @ all_of_joint[:, :, None])[..., 0] * all_of_joint, axis=2), self.count)
