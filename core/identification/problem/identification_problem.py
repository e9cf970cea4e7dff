"""The identification problem as weighted, robust, prior-regularised least squares.

For joint j:  effort_j / k_j - contact_j = (Y(q, dq, ddq) pi)_j + I_j ddq_j + Fc_j sgn(dq_j) + Fv_j dq_j + o_j + noise,
with drive gain k, inertial parameters pi (prior: the robot's description), rotor inertia I, Coulomb and viscous
friction and an offset; beside them what ``problem_terms.py`` adds. Friction and offset have no prior: they are
projected out joint by joint. What remains is solved by Gauss-Newton steps (linear but for the gain) with Huber weights
and noise levels from the residual itself. Neighbouring errors are alike: the data's weight against the prior is divided
by how much more the sum of errors over a second varies than independent errors would (Kish's design effect).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from collaudit.core.identification.problem.identification_samples import Motion
from collaudit.core.identification.problem.problem_terms import Terms, Unknowns
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray
from collaudit.core.numeric.stats import HUBER_BOUND, robust_sd
from collaudit.core.torque_table.block_sums import generalised_inverse

_ITERATIONS = 12
#: A last step is shorter than this, squared and in standard errors of what the data and the prior tell.
_SHORT = 1e-6


@dataclass(frozen=True, slots=True, eq=False)
class Solution:
    """What the data and the prior say together.

    Attributes:
        inertials: (p,); armature: (j,); gain: (j,).
        nuisance: (j, k) coefficients of friction and offset, N·m; the offset is number ``OFFSET``.
        free: (p + 2 j,) which unknowns were free: inertials, rotor inertias, gains.
        sigma: (j,) robust noise level, N·m.
    """

    inertials: FloatArray
    armature: FloatArray
    gain: FloatArray
    nuisance: FloatArray
    free: BoolArray
    sigma: FloatArray

    @property
    def values(self) -> FloatArray:
        """(p + 2 j,) inertials, rotor inertias and gains."""
        return np.concatenate([self.inertials, self.armature, self.gain])

    def with_free(self, free: FloatArray) -> Solution:
        """The same with other values (f,) of the free unknowns."""
        every, p, joints = self.values, self.inertials.size, self.armature.size
        every[self.free] = free
        return replace(self, inertials=every[:p], armature=every[p : p + joints], gain=every[p + joints :])


@dataclass(slots=True, eq=False)
class State:
    """A solution on its way.

    Attributes:
        at: where it is; its nuisance and sigma are changed in place.
        weight: (n, j) what Huber's estimator makes of a residual, as its ratio; slope: (n, j) as its derivative.
        rest: (n, j) torque that is left, N·m.
        prior: (p,) inertial parameters before the data; rigid: (n, j) their torque.
    """

    at: Solution
    weight: FloatArray
    slope: FloatArray
    rest: FloatArray
    prior: FloatArray
    rigid: FloatArray


def solve(terms: Terms, unknowns: Unknowns, iterations: int = _ITERATIONS) -> Solution:
    """Estimate all unknowns from samples of motion.

    Args:
        terms: the samples and their columns.
        unknowns: priors; a zero standard deviation holds a parameter.
        iterations: most Gauss-Newton steps; with gains held only the weights still change after the first.
    """
    motion = terms.motion
    joints = motion.effort.shape[1]
    free, precision = _prior(motion, unknowns)
    gain = np.where(np.isfinite(unknowns.gain), unknowns.gain, 1.0)
    none = np.zeros((joints, terms.nuisance.shape[2]))
    state = _state(terms, Solution(unknowns.inertials, unknowns.armature, gain, none, free, np.ones(joints)))
    origin = unknowns.values[free]
    _fit_nuisance(terms, state)
    for _ in range(iterations):
        _reweigh(terms, state)
        if not free.any():
            _fit_nuisance(terms, state)
            continue
        gradient, data, friction = _normal(terms, state)
        before = state.at.values[free]
        gradient -= precision[free] * (before - origin)
        hessian = data + np.diag(precision[free])
        step = np.asarray(np.linalg.solve(hessian + 1e-12 * np.eye(before.size), gradient))
        moved = state.at.with_free(before + step)
        state.at = replace(moved, gain=np.where(np.abs(moved.gain) > 1e-9, moved.gain, state.at.gain))
        for j, place, alone, onto in friction:
            state.at.nuisance[j] += alone - onto @ step[place]
        if step @ hessian @ step < _SHORT:
            break
    _reweigh(terms, state)
    return replace(state.at, gain=np.where(np.isfinite(unknowns.gain), state.at.gain, np.nan))


def precision_of(terms: Terms, unknowns: Unknowns, solution: Solution) -> FloatArray:
    """(f, f) precision of the free unknowns about their solution, by the data and the prior together."""
    free, precision = _prior(terms.motion, unknowns)
    return _normal(terms, weighted_state(terms, solution))[1] + np.diag(precision[free])


def _prior(motion: Motion, unknowns: Unknowns) -> tuple[BoolArray, FloatArray]:
    """(p + 2 j,) which unknowns are free, and their precision before the data; gains of what does not move are not."""
    scales = unknowns.sd
    scales[-unknowns.gain.size :][~motion.moving.any(axis=0)] = 0.0
    free = np.asarray(scales > 0)
    precision = np.zeros(free.size)
    precision[free] = scales[free] ** -2.0
    return free, precision


def residual(terms: Terms, solution: Solution) -> FloatArray:
    """(n, j) torque that is left, N·m; meaningful where a joint moves."""
    return _unexplained(terms, _state(terms, solution))


def refit_nuisance(terms: Terms, solution: Solution) -> Solution:
    """The solution with friction and offset fitted again, after other unknowns were moved."""
    state = _state(terms, solution)
    for _ in range(3):
        _fit_nuisance(terms, state)
        _reweigh(terms, state)
    return state.at


def _state(terms: Terms, s: Solution) -> State:
    """The state of a solution, its weights not yet found."""
    at = replace(s, nuisance=s.nuisance.copy(), sigma=s.sigma.copy())
    weight = terms.motion.moving.astype(np.float64)
    return State(at, weight, weight.copy(), np.zeros_like(weight), s.inertials, terms.motion.regressor @ s.inertials)


def weighted_state(terms: Terms, solution: Solution) -> State:
    """The state that a solution ended in, with the weights of its samples there."""
    state = _state(terms, solution)
    _reweigh(terms, state)
    return state


def weighted_joints(state: State) -> list[int]:
    """Joints of which any sample counts."""
    return [j for j in range(state.at.sigma.size) if state.weight[:, j].any()]


def _unexplained(terms: Terms, state: State) -> FloatArray:
    """(n, j) torque that the unknowns leave, N·m."""
    motion, at = terms.motion, state.at
    change = at.inertials - state.prior
    out = motion.effort / at.gain - motion.contact - state.rigid - motion.acceleration * at.armature
    for j in range(out.shape[1]):
        out[:, j] -= terms.columns[j] @ change[terms.index[j]] + terms.nuisance[j] @ at.nuisance[j]
    return np.asarray(out)


def _fit_nuisance(terms: Terms, state: State) -> None:
    """Friction and offset of every joint for what is left by the rest."""
    rest = _unexplained(terms, state)
    for j in range(rest.shape[1]):
        weight, columns = state.weight[:, j], terms.nuisance[j]
        if np.count_nonzero(weight) >= 4:
            weighed = columns * weight[:, None]
            state.at.nuisance[j] += generalised_inverse(weighed.T @ columns) @ (weighed.T @ rest[:, j])


def _reweigh(terms: Terms, state: State) -> None:
    """What is left, each joint's noise (median absolute residual), Huber weights, and the design effect of clusters."""
    rest = state.rest = _unexplained(terms, state)
    for j in range(rest.shape[1]):
        use = terms.motion.moving[:, j]
        if not use.any():
            continue
        state.at.sigma[j] = max(robust_sd(rest[use, j]), 1e-4)
        ratio = np.abs(rest[:, j]) / state.at.sigma[j]
        weight = np.where(use, np.minimum(1.0, HUBER_BOUND / np.maximum(ratio, 1e-9)), 0.0)
        together = terms.by_cluster(np.where(use, weight * rest[:, j], 0.0))
        alone = float(np.sum((weight * rest[:, j])[use] ** 2))
        design = max(1.0, float(np.sum(together**2)) / max(alone, 1e-30))
        state.weight[:, j] = weight / design
        state.slope[:, j] = np.where(use & (ratio <= HUBER_BOUND), 1.0 / design, 0.0)


def jacobian(terms: Terms, state: State, j: int) -> tuple[IntArray, FloatArray]:
    """Which unknowns joint j feels, and (n, f_j) derivatives of its torque by them.

    The free ones come first, then friction and offset of each joint (k,), which are the last k of joint j's own.
    """
    at, free = state.at, state.at.free
    p, joints = at.inertials.size, at.armature.size
    parts, unknown = [terms.columns[j]], [terms.index[j]]
    if free[p + j]:
        parts.append(terms.motion.acceleration[:, j, None])
        unknown.append(np.array([p + j]))
    if free[p + joints + j]:
        smooth = terms.motion.effort[:, j] / at.gain[j] - state.rest[:, j]
        parts.append((smooth / at.gain[j])[:, None])
        unknown.append(np.array([p + joints + j]))
    place, kinds = (np.cumsum(free) - 1)[np.concatenate(unknown)], terms.nuisance.shape[2]
    friction = np.count_nonzero(free) + kinds * j + np.arange(kinds)
    return np.concatenate([place, friction]), np.concatenate([*parts, terms.nuisance[j]], axis=1)


#: Friction and offset of a joint in a step: its number, which unknowns it feels, what they change by where nothing else
#: moves (k,), and (k, f_j) times the step of those unknowns less.
_Projected = tuple[int, IntArray, FloatArray, FloatArray]


def _normal(terms: Terms, state: State) -> tuple[FloatArray, FloatArray, list[_Projected]]:
    """Gradient (f,) and data part of the precision matrix (f, f), and friction and offset, which are projected out."""
    size = int(state.at.free.sum())
    gradient, data, friction = np.zeros(size), np.zeros((size, size)), list[_Projected]()
    for j in weighted_joints(state):
        root = np.sqrt(state.weight[:, j]) / state.at.sigma[j]
        place, columns = jacobian(terms, state, j)
        every = np.column_stack([columns, state.rest[:, j]]) * root[:, None]
        products, count = every.T @ every, place.size - terms.nuisance.shape[2]
        place = place[:count]
        shared, inverse = products[count:-1, :count], generalised_inverse(products[count:-1, count:-1])
        alone, onto = inverse @ products[count:-1, -1], inverse @ shared
        friction.append((j, place, alone, onto))
        gradient[place] += products[:count, -1] - shared.T @ alone
        data[np.ix_(place, place)] += products[:count, :count] - shared.T @ onto
    return gradient, data, friction
