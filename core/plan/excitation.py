"""An exciting trajectory: moves between poses, each the one that tells most for its time of what is not known yet.

The joint torques are linear in inertial parameters, rotor inertias, gains' errors and friction that goes with the load;
friction of its own and an offset stand beside them, without a prior, as in the identification
(``torque_terms.py``). The information of samples is Phi^T Phi / s²; the determinant of the unknowns'
covariance is made small (D-optimal: Atkinson, Donev and Tobias, Optimum Experimental Designs, 2007), given
what earlier logs determine. Poses are chosen one after the other out of random ones, so that every move can be checked
against all limits before it is taken.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from collaudit.core.config.schema import Config
from collaudit.core.data.audit_result import FrictionFile
from collaudit.core.identification.solved_problem import GAIN_SD, inertials_prior_sd
from collaudit.core.identification.torque_terms import FRICTION_COLUMNS, BaseMap, base_map, friction_columns
from collaudit.core.numeric.arrays import FloatArray, IntArray
from collaudit.core.numeric.stats import STANDARD_ERRORS_95
from collaudit.core.plan.moves import Motion, MoveCheck, move
from collaudit.core.robot.robot_model import RobotModel

#: Prior standard deviations: of inertials as a share, of rotor inertia as a share of the arm's largest, of friction a
#: N·m of load.
_SHARE, _ROTOR_SHARE, _LOAD = 0.2, 0.5, 0.1
#: Standard deviation of the torque where no log says, as a share of the joint's highest.
_UNKNOWN_NOISE = 0.01
_NEXT_TO_NONE = 1e-6  # information on these before the data, in units of the noise


@dataclass(frozen=True, slots=True, eq=False)
class Unknowns:
    """Unknowns of an arm, in units of their prior standard deviation.

    Attributes:
        labels: (u,) of the parameters that are reported: base parameters, then the rest, and their units.
        rows: (u, m0) reported parameters as combinations of the m0 unknowns, in their own units.
        scale: (m0,) prior standard deviations: ten inertials a body, j rotors, j gains (where asked for), j of load.
        earlier: (m0, m0) information of earlier logs, in units of the prior.
        noise: (j,) standard deviation of an independent sample's torque, N·m.
        measured: (j,) whether the noise comes from a log.
        with_gain: whether gains are unknown.
    """

    labels: tuple[tuple[str, str], ...]
    rows: FloatArray
    scale: FloatArray
    earlier: FloatArray
    noise: FloatArray
    measured: tuple[bool, ...]
    with_gain: bool

    def information(self, robot: RobotModel, q: FloatArray, v: FloatArray, a: FloatArray, weight: float) -> FloatArray:
        """(m, m) information of samples (n, j), each worth ``weight`` independent ones; unknowns, then friction."""
        regressor = robot.torque_regressor(q, v, a)
        rigid = regressor @ robot.inertial_parameters
        count, (samples, joints), inertials = self.scale.size, q.shape, regressor.shape[2]
        each = np.arange(joints)
        columns = np.zeros((samples, joints, count + FRICTION_COLUMNS * joints))
        columns[:, :, :inertials] = regressor
        columns[:, each, inertials + each] = a
        if self.with_gain:
            columns[:, each, inertials + joints + each] = rigid
        columns[:, each, count - joints + each] = np.sign(v) * np.abs(rigid)
        columns[:, :, :count] *= self.scale
        nuisance = count + FRICTION_COLUMNS * each[:, None] + np.arange(FRICTION_COLUMNS)
        columns[:, each[:, None], nuisance] = friction_columns(v.ravel(), a.ravel()).reshape(
            samples, joints, FRICTION_COLUMNS
        )
        moving = (columns / self.noise[:, None])[np.abs(v) > 1e-6]
        return np.asarray(weight * moving.T @ moving)

    def prior(self) -> FloatArray:
        """(m, m) information before the motion: prior and earlier logs; next to none on what stands beside."""
        count = self.scale.size
        out = np.diag(np.concatenate([np.ones(count), np.repeat(self.noise**-2.0, FRICTION_COLUMNS) * _NEXT_TO_NONE]))
        out[:count, :count] += self.earlier
        return out

    def criterion(self, information: FloatArray) -> float:
        """Log det of the unknowns' information, friction and offset projected out (Schur complement)."""
        nuisance = information[self.scale.size :, self.scale.size :]
        return float(np.linalg.slogdet(information)[1] - np.linalg.slogdet(nuisance)[1])

    def half_widths(self, information: FloatArray) -> FloatArray:
        """(u,) half widths of 95 % intervals of the reported parameters, in their own units."""
        size = np.sqrt(np.maximum(np.diag(information), 1e-300))
        covariance = np.linalg.inv(information / np.outer(size, size)) / np.outer(size, size)
        part = covariance[: self.scale.size, : self.scale.size] * np.outer(self.scale, self.scale)
        return np.asarray(
            STANDARD_ERRORS_95 * np.sqrt(np.maximum(np.einsum("up,pq,uq->u", self.rows, part, self.rows), 0.0))
        )


def unknowns_of(robot: RobotModel, config: Config, friction: FrictionFile | None, torque_nm: FloatArray) -> Unknowns:
    """Unknowns of an arm with their priors, and what an earlier fit found of them.

    Args:
        robot: with inertials.
        config: which gains and how far the description is believed.
        friction: of earlier logs.
        torque_nm: (j,) highest torques.
    """
    assert robot.bodies is not None
    names = robot.joint_names
    found = None if friction is None else friction.identified
    share = found.prior_sd if found is not None and found.prior_sd > 0 else _SHARE
    inertials = np.maximum(inertials_prior_sd(robot.inertial_parameters, share), 1e-9)
    pose = np.tile(0.5 * np.nan_to_num(robot.position_limits.sum(axis=1)), (len(names), 1))
    still = np.zeros_like(pose)
    own = np.diag(robot.inverse_dynamics(pose, still, np.eye(len(names))) - robot.gravity_torque(pose))
    rotors = np.full(len(names), _ROTOR_SHARE * float(own.max()))
    gain = config.log.units.has_constants or "gain" in (config.fit.estimate or ())
    scale = np.concatenate([inertials, rotors, np.full(len(names) * gain, GAIN_SD), np.full(len(names), _LOAD)])
    base = base_map(robot, tuple(robot.bodies.joint_names))
    rows, labels = _reported(base, names, gain, inertials.size)
    return Unknowns(
        labels, rows, scale, _earlier(friction, labels, rows, scale), *_noise(names, friction, torque_nm), gain
    )


def _reported(
    base: BaseMap, names: Sequence[str], gain: bool, inertials: int
) -> tuple[FloatArray, tuple[tuple[str, str], ...]]:
    """Base parameters, then every other unknown by itself."""
    others = len(names) * (2 + gain)
    rows = np.zeros((len(base.names) + others, inertials + others))
    rows[: len(base.names), :inertials] = base.matrix
    rows[len(base.names) :, inertials:] = np.eye(others)
    labels = [("base parameter", name) for name in base.names]
    for kind in ("rotor inertia", *(["gain"] if gain else []), "load friction"):
        labels += [(kind, name) for name in names]
    return rows, tuple(labels)


def _earlier(
    friction: FrictionFile | None, labels: Sequence[tuple[str, str]], rows: FloatArray, scale: FloatArray
) -> FloatArray:
    """(m, m) information, in units of the prior, that brings each reported parameter to the interval it has already."""
    out = np.zeros((scale.size, scale.size))
    for k, half in enumerate(reported_half_widths(friction, labels)):
        row = rows[k] * scale
        prior, sd = float(row @ row), (half or np.inf) / STANDARD_ERRORS_95
        if half is not None and 0.0 < sd**2 < prior:
            out += np.outer(row, row) / prior * (1.0 / sd**2 - 1.0 / prior)
    return out


def reported_half_widths(friction: FrictionFile | None, labels: Sequence[tuple[str, str]]) -> list[float | None]:
    """Half widths that a fit states for the reported parameters; None where it has no interval."""
    known: dict[tuple[str, str], tuple[float | None, float | None] | None] = {}
    if friction is not None and friction.identified is not None:
        known |= {("base parameter", base.name): base.ci95 for base in friction.identified.base_parameters}
        for name, joint in friction.identified.joints.items():
            known[("rotor inertia", name)] = joint.armature_ci95
            known[("gain", name)] = joint.gain_ci95
    if friction is not None:
        for name, variation in friction.trends.items():
            loads = [trend.ci95 for trend in variation.trends if trend.against == "load"]
            known |= {("load friction", name): loads[0]} if loads else {}
    return [half_width(known.get(label)) for label in labels]


def half_width(bounds: tuple[float | None, float | None] | None) -> float | None:
    """Half the width of an interval; None where it is open, or none is known."""
    if bounds is None or bounds[0] is None or bounds[1] is None:
        return None
    return 0.5 * (bounds[1] - bounds[0])


def _noise(
    names: Sequence[str], friction: FrictionFile | None, torque_nm: FloatArray
) -> tuple[FloatArray, tuple[bool, ...]]:
    """(j,) torque that model and friction left in motion of earlier logs, and whether one says."""
    out, measured = np.asarray(_UNKNOWN_NOISE * torque_nm), []
    for j, name in enumerate(names):
        threshold = None if friction is None or friction.thresholds is None else friction.thresholds.joints.get(name)
        measured.append(threshold is not None and bool(threshold.rms_nm))
        if threshold is not None and threshold.rms_nm:
            out[j] = threshold.rms_nm
    return out, tuple(measured)


#: Between samples that count as independent: errors of a model and of a gear last about so long.
INDEPENDENT_S = 0.2
_SAMPLE_S = 0.05
PAUSE_S = 0.1
_TRIED = 24
_STUCK = 8  # rounds without any free move, after which the search ends


@dataclass(frozen=True, slots=True, eq=False)
class Excitation:
    """Moves, and the information (m, m) of all unknowns and of friction beside them."""

    moves: tuple[Motion, ...]
    information: FloatArray


def excite(check: MoveCheck, unknowns: Unknowns, joints: IntArray, seconds: float, seed: int = 0) -> Excitation:
    """Choose moves from the start and back to it.

    Args:
        check: limits of the arm.
        unknowns: what is not known, and how well it is.
        joints: numbers of those that may move.
        seconds: of all moves at most, pauses included.
        seed: of the poses that are tried.
    """
    rng, limits = np.random.default_rng(seed), check.limits
    information = unknowns.prior()
    moves: list[Motion] = []
    at, left, stuck = limits.start, seconds, 0
    while stuck < _STUCK:
        tried = _tried(check, unknowns, information, at, left, (joints, rng))
        if not tried:  # no time left
            break
        taken = next((one for one in tried if check.problem(*one[:2]) is None), None)
        if taken is None:
            stuck += 1
            continue
        there, _, added = taken
        stuck, at = 0, there.q[-1]
        moves.append(there)
        information = information + added
        left -= there.duration_s + PAUSE_S
    if moves:
        moves.append(move(limits, at, limits.start))
        information = information + information_of(check, unknowns, moves[-1])
    return Excitation(tuple(moves), information)


def _tried(
    check: MoveCheck, unknowns: Unknowns, information: FloatArray, at: FloatArray, left: float,
    chance: tuple[IntArray, np.random.Generator],
) -> list[tuple[Motion, Motion, FloatArray]]:  # fmt: skip
    """Random moves that leave time for the way home from their ends, what they tell; the best for their time first."""
    limits, before, found = check.limits, unknowns.criterion(information), []
    for _ in range(_TRIED):
        goal = _pose(at, limits.low, limits.high, *chance)
        there = move(limits, at, goal)
        cost = there.duration_s + PAUSE_S
        if cost > left:
            continue
        home = move(limits, goal, limits.start)
        if cost + home.duration_s + PAUSE_S <= left:
            added = information_of(check, unknowns, there)
            found.append(((unknowns.criterion(information + added) - before) / cost, (there, home, added)))
    return [one for _, one in sorted(found, key=lambda pair: -pair[0])]


def information_of(check: MoveCheck, unknowns: Unknowns, motion: Motion) -> FloatArray:
    """(m, m) information of a motion's samples on all unknowns and on friction and offset of every joint."""
    _, q, v, a = motion.sampled(_SAMPLE_S)
    return unknowns.information(check.robot, q, v, a, _SAMPLE_S / INDEPENDENT_S)


def _pose(at: FloatArray, low: FloatArray, high: FloatArray, joints: IntArray, rng: np.random.Generator) -> FloatArray:
    """A random pose; some joints may stay where they are, and ranges beyond a turn are not all used."""
    goal = at.copy()
    moved = joints[rng.random(joints.size) < rng.choice([0.5, 1.0])]
    moved = moved if moved.size else joints
    middle, half = 0.5 * (low + high), np.minimum(0.5 * (high - low), 0.5 * np.pi)
    goal[moved] = np.clip(rng.uniform(middle - half, middle + half), low, high)[moved]
    return goal
