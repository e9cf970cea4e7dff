"""The identification problem as weighted, robust, prior-regularised least squares.

For joint j:  effort_j / k_j - contact_j = (Y(q, dq, ddq) pi)_j + I_j ddq_j + Fc_j sgn(dq_j) + Fv_j dq_j + o_j + noise,

with drive gain k, inertial parameters pi (prior: the robot's description), rotor inertia I, Coulomb and viscous
friction and an offset; beside them what ``nuisance.py`` adds. Friction and offset have no prior: they are projected out
joint by joint. What remains is solved by Gauss-Newton steps (linear but for the gain) with Huber weights and noise
levels from the residual itself. Neighbouring errors are alike: the data's weight against the prior is divided by how
much more the sum of errors over a second varies than independent errors would (Kish's design effect).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from collaudit.core.identification.problem.identification_samples import Motion
from collaudit.core.identification.problem.nuisance import generalised_inverse
from collaudit.core.identification.problem.problem_terms import Terms
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray
from collaudit.core.numeric.stats import HUBER_BOUND, robust_sd

_ITERATIONS = 12
#: A last step is shorter than this, squared and in standard errors of what the data and the prior tell.
_SHORT = 1e-6


@dataclass(frozen=True, slots=True, eq=False)
class Unknowns:
    """What is known before the data, and how well.

    Attributes:
        inertials: (p,) prior of the inertial parameters.
        inertials_prior_sd: (p,) its standard deviation; 0 holds a parameter.
        armature, armature_prior_sd: (j,) the same for rotor inertia.
        gain: (j,) starting values of the drive gains.
        gain_prior_sd: (j,) prior of the gains about ``gain``; 0 holds one, inf leaves it to the data.
        springs: (j,) joints with a torque by their angle; None for none.
    """

    inertials: FloatArray
    inertials_prior_sd: FloatArray
    armature: FloatArray
    armature_prior_sd: FloatArray
    gain: FloatArray
    gain_prior_sd: FloatArray
    springs: BoolArray | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Solution:
    """What the data and the prior say together.

    Attributes:
        inertials: (p,); armature: (j,); gain: (j,).
        nuisance: (j, k) coefficients of friction and offset, N·m; the offset is number ``nuisance.OFFSET``.
        free: (p + 2 j,) which unknowns were free: inertials, rotor inertias, gains.
        sigma: (j,) robust noise level, N·m.
    """

    inertials: FloatArray
    armature: FloatArray
    gain: FloatArray
    nuisance: FloatArray
    free: BoolArray
    sigma: FloatArray


@dataclass(slots=True, eq=False)
class State:
    """The unknowns on their way; ``rigid`` (n, j) is the torque of the inertial parameters before the data.

    ``slope`` (n, j) is the derivative of what Huber's estimator makes of a residual, as ``weight`` is its ratio.
    """

    inertials: FloatArray
    armature: FloatArray
    gain: FloatArray
    nuisance: FloatArray
    sigma: FloatArray
    weight: FloatArray
    slope: FloatArray
    prior: FloatArray
    rigid: FloatArray


def terms_of(motion: Motion, regressor: FloatArray, unknowns: Unknowns) -> Terms:
    """What :func:`solve` and the others need of the samples, for unknowns with the same parameters free."""
    return Terms.of(motion, regressor, np.asarray(unknowns.inertials_prior_sd > 0), unknowns.springs)


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
    origin = np.concatenate([unknowns.inertials, unknowns.armature, unknowns.gain])
    gain = np.where(np.isfinite(unknowns.gain), unknowns.gain, 1.0)
    none = np.zeros((joints, terms.nuisance.shape[2]))
    state = _state(terms, unknowns.inertials, unknowns.armature, gain, none, np.ones(joints))
    _fit_nuisance(terms, state)
    for _ in range(iterations):
        reweigh(terms, state)
        before = np.concatenate([state.inertials, state.armature, state.gain])
        if not free.any():
            _fit_nuisance(terms, state)
            continue
        gradient, data, friction = _normal(terms, state, free)
        gradient -= precision[free] * (before - origin)[free]
        hessian = data + np.diag(precision[free])
        step = np.linalg.solve(hessian + 1e-12 * np.eye(int(free.sum())), gradient)
        _move(state, before, np.asarray(step), free)
        for part in friction:
            state.nuisance[part.joint] += part.alone - part.onto @ step[part.place]
        if step @ hessian @ step < _SHORT:
            break
    reweigh(terms, state)
    state.gain = np.where(np.isfinite(unknowns.gain), state.gain, np.nan)
    return Solution(state.inertials, state.armature, state.gain, state.nuisance, free, state.sigma)


def precision_of(terms: Terms, unknowns: Unknowns, solution: Solution) -> FloatArray:
    """(f, f) precision of the free unknowns about their solution, by the data and the prior together."""
    free, precision = _prior(terms.motion, unknowns)
    return _normal(terms, weighted_state(terms, solution), free)[1] + np.diag(precision[free])


def _prior(motion: Motion, unknowns: Unknowns) -> tuple[BoolArray, FloatArray]:
    """(p + 2 j,) which unknowns are free, and their precision before the data; gains of what does not move are not."""
    scales = prior_sd(unknowns)
    scales[-unknowns.gain.size :][~motion.moving.any(axis=0)] = 0.0
    free = np.asarray(scales > 0)
    precision = np.zeros(free.size)
    precision[free] = scales[free] ** -2.0
    return free, precision


def prior_sd(unknowns: Unknowns) -> FloatArray:
    """(p + 2 j,) standard deviations of inertials, rotor inertias and gains before the data."""
    return np.concatenate([unknowns.inertials_prior_sd, unknowns.armature_prior_sd, unknowns.gain_prior_sd])


def residual(terms: Terms, solution: Solution) -> FloatArray:
    """(n, j) torque that is left, N·m; meaningful where a joint moves."""
    return unexplained_torque(terms, state_of(terms, solution))


def refit_nuisance(terms: Terms, solution: Solution) -> Solution:
    """The solution with friction and offset fitted again, after other unknowns were moved."""
    state = state_of(terms, solution)
    for _ in range(3):
        _fit_nuisance(terms, state)
        reweigh(terms, state)
    return replace(solution, nuisance=state.nuisance, sigma=state.sigma)


def _state(
    terms: Terms, inertials: FloatArray, armature: FloatArray, gain: FloatArray, nuisance: FloatArray, sigma: FloatArray
) -> State:
    weight = terms.motion.moving.astype(np.float64)
    rigid = terms.regressor @ inertials
    return State(inertials.copy(), armature.copy(), gain, nuisance, sigma, weight, weight.copy(), inertials, rigid)


def state_of(terms: Terms, s: Solution) -> State:
    """The state that a solution ended in, its weights not yet found."""
    return _state(terms, s.inertials, s.armature, s.gain, s.nuisance.copy(), s.sigma.copy())


def weighted_state(terms: Terms, solution: Solution) -> State:
    """The state that a solution ended in, with the weights of its samples there."""
    state = state_of(terms, solution)
    reweigh(terms, state)
    return state


def weighted_joints(state: State) -> list[int]:
    """Joints of which any sample counts."""
    return [j for j in range(state.sigma.size) if state.weight[:, j].any()]


def _move(state: State, before: FloatArray, step: FloatArray, free: BoolArray) -> None:
    after = before.copy()
    after[free] += step
    p, joints = state.inertials.size, state.armature.size
    state.inertials, state.armature = after[:p], after[p : p + joints]
    state.gain = np.where(np.abs(after[p + joints :]) > 1e-9, after[p + joints :], before[p + joints :])


def unexplained_torque(terms: Terms, state: State) -> FloatArray:
    """(n, j) torque that the unknowns leave, N·m."""
    motion = terms.motion
    change = state.inertials - state.prior
    out = motion.effort / state.gain - motion.contact - state.rigid - motion.acceleration * state.armature
    for j in range(out.shape[1]):
        out[:, j] -= terms.columns[j] @ change[terms.index[j]] + terms.nuisance[j] @ state.nuisance[j]
    return np.asarray(out)


def _fit_nuisance(terms: Terms, state: State) -> None:
    """Friction and offset of every joint for what is left by the rest."""
    rest = unexplained_torque(terms, state)
    for j in range(rest.shape[1]):
        weight, columns = state.weight[:, j], terms.nuisance[j]
        if np.count_nonzero(weight) >= 4:
            weighed = columns * weight[:, None]
            state.nuisance[j] += generalised_inverse(weighed.T @ columns) @ (weighed.T @ rest[:, j])


def reweigh(terms: Terms, state: State) -> None:
    """Noise level of each joint (median absolute residual), Huber weights, and the design effect of clusters."""
    rest = unexplained_torque(terms, state)
    for j in range(rest.shape[1]):
        use = terms.motion.moving[:, j]
        if not use.any():
            continue
        state.sigma[j] = max(robust_sd(rest[use, j]), 1e-4)
        ratio = np.abs(rest[:, j]) / state.sigma[j]
        weight = np.where(use, np.minimum(1.0, HUBER_BOUND / np.maximum(ratio, 1e-9)), 0.0)
        together = terms.by_cluster(np.where(use, weight * rest[:, j], 0.0))
        alone = float(np.sum((weight * rest[:, j])[use] ** 2))
        design = max(1.0, float(np.sum(together**2)) / max(alone, 1e-30))
        state.weight[:, j] = weight / design
        state.slope[:, j] = np.where(use & (ratio <= HUBER_BOUND), 1.0 / design, 0.0)


def jacobian(terms: Terms, state: State, j: int, free: BoolArray, rest: FloatArray) -> tuple[IntArray, FloatArray]:
    """Which unknowns joint j feels, and (n, f_j) derivatives of its torque by them.

    The free ones come first, then friction and offset of each joint (k,), which are the last k of joint j's own.
    """
    p, joints = state.inertials.size, state.armature.size
    parts, unknown = [terms.columns[j]], [terms.index[j]]
    if free[p + j]:
        parts.append(terms.motion.acceleration[:, j, None])
        unknown.append(np.array([p + j]))
    if free[p + joints + j]:
        smooth = terms.motion.effort[:, j] / state.gain[j] - rest
        parts.append((smooth / state.gain[j])[:, None])
        unknown.append(np.array([p + joints + j]))
    place, kinds = (np.cumsum(free) - 1)[np.concatenate(unknown)], terms.nuisance.shape[2]
    friction = np.count_nonzero(free) + kinds * j + np.arange(kinds)
    return np.concatenate([place, friction]), np.concatenate([*parts, terms.nuisance[j]], axis=1)


@dataclass(frozen=True, slots=True, eq=False)
class _Projected:
    """Friction and offset of a joint in a Gauss-Newton step: what they change by.

    That is ``alone`` (k,) where nothing else moves, less ``onto`` (k, f_j) times the step of the unknowns at ``place``.
    """

    joint: int
    place: IntArray
    alone: FloatArray
    onto: FloatArray


def _normal(terms: Terms, state: State, free: BoolArray) -> tuple[FloatArray, FloatArray, list[_Projected]]:
    """Gradient (f,) and data part of the precision matrix (f, f), and friction and offset, which are projected out."""
    rest = unexplained_torque(terms, state)
    size = int(free.sum())
    gradient, data, friction = np.zeros(size), np.zeros((size, size)), list[_Projected]()
    for j in weighted_joints(state):
        root = np.sqrt(state.weight[:, j]) / state.sigma[j]
        place, columns = jacobian(terms, state, j, free, rest[:, j])
        every = np.column_stack([columns, rest[:, j]]) * root[:, None]
        products, count = every.T @ every, place.size - terms.nuisance.shape[2]
        place = place[:count]
        shared, inverse = products[count:-1, :count], generalised_inverse(products[count:-1, count:-1])
        friction.append(_Projected(j, place, inverse @ products[count:-1, -1], inverse @ shared))
        gradient[place] += products[:count, -1] - shared.T @ friction[-1].alone
        data[np.ix_(place, place)] += products[:count, :count] - shared.T @ friction[-1].onto
    return gradient, data, friction
