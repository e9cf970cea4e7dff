"""The identification problem as weighted, robust, prior-regularised least squares.

For joint j:  effort_j / k_j - contact_j = (Y(q, dq, ddq) pi)_j + I_j ddq_j + Fc_j sgn(dq_j) + Fv_j dq_j + o_j + noise,

with drive gain k, inertial parameters pi (prior: the robot's description), rotor inertia I, Coulomb and viscous
friction and a constant offset. Friction and offset have no prior: they are projected out joint by joint. What remains
is solved by Gauss-Newton steps (linear but for the gain) with Huber weights and noise levels from the residual itself.
Neighbouring errors are alike: the data's weight against the prior is divided by how much more the sum of errors over
a second varies than independent errors would (Kish's design effect), and the covariance is cluster-robust (Liang and
Zeger, Biometrika 73, 1986).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from collaudit.core.identification.samples import Motion
from collaudit.core.series import BoolArray, FloatArray

_ITERATIONS = 12
_HUBER = 1.345
_CHANGE = 1e-4


@dataclass(frozen=True, slots=True, eq=False)
class Unknowns:
    """What is known before the data, and how well.

    Attributes:
        inertials: (p,) prior of the inertial parameters.
        inertials_sd: (p,) its standard deviation; 0 holds a parameter.
        armature, armature_sd: (j,) the same for rotor inertia.
        gain: (j,) starting values of the drive gains.
        gain_sd: (j,) prior of the gains about ``gain``; 0 holds one, inf leaves it to the data.
    """

    inertials: FloatArray
    inertials_sd: FloatArray
    armature: FloatArray
    armature_sd: FloatArray
    gain: FloatArray
    gain_sd: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Solution:
    """What the data and the prior say together.

    Attributes:
        inertials: (p,); armature: (j,); gain: (j,).
        nuisance: (j, 3) Coulomb friction, viscous friction, offset; N·m.
        covariance: of the free unknowns (see ``free``), cluster-robust, prior included.
        information: share of each free unknown's precision matrix that the data give.
        free: (p + 2 j,) which unknowns were free: inertials, rotor inertias, gains.
        sigma: (j,) robust noise level, N·m.
        hessian: (f, f) precision matrix of the free unknowns.
        nuisance_sd: (j, 3) standard errors of ``nuisance``, cluster-robust.
    """

    inertials: FloatArray
    armature: FloatArray
    gain: FloatArray
    nuisance: FloatArray
    covariance: FloatArray
    information: FloatArray
    free: BoolArray
    sigma: FloatArray
    hessian: FloatArray
    nuisance_sd: FloatArray


@dataclass(slots=True, eq=False)
class _State:
    inertials: FloatArray
    armature: FloatArray
    gain: FloatArray
    nuisance: FloatArray
    sigma: FloatArray
    weight: FloatArray


def solve(motion: Motion, regressor: FloatArray, unknowns: Unknowns, iterations: int = _ITERATIONS) -> Solution:
    """Estimate all unknowns from samples of motion.

    Args:
        motion: n samples of j joints.
        regressor: (n, j, p).
        unknowns: priors; a zero standard deviation holds a parameter.
        iterations: most Gauss-Newton steps; with gains held only the weights still change after the first.
    """
    joints = motion.effort.shape[1]
    driven = motion.moving.any(axis=0)
    scales = np.concatenate([unknowns.inertials_sd, unknowns.armature_sd, np.where(driven, unknowns.gain_sd, 0.0)])
    free = np.asarray(scales > 0)
    precision = np.zeros(free.size)
    precision[free] = scales[free] ** -2.0
    state = _State(
        unknowns.inertials.copy(),
        unknowns.armature.copy(),
        np.where(np.isfinite(unknowns.gain), unknowns.gain, 1.0),
        np.zeros((joints, 3)),
        np.ones(joints),
        motion.moving.astype(np.float64),
    )
    _fit_nuisance(motion, regressor, state)
    for _ in range(iterations):
        before = np.concatenate([state.inertials, state.armature, state.gain])
        _reweigh(motion, regressor, state)
        gradient, data = _normal(motion, regressor, state, free)
        origin = np.concatenate([unknowns.inertials, unknowns.armature, unknowns.gain])
        gradient -= precision[free] * (before - origin)[free]
        step = np.linalg.solve(data + np.diag(precision[free]) + 1e-12 * np.eye(int(free.sum())), gradient)
        after = before.copy()
        after[free] += step
        p = state.inertials.size
        state.inertials, state.armature = after[:p], after[p : p + joints]
        state.gain = np.where(np.abs(after[p + joints :]) > 1e-9, after[p + joints :], before[p + joints :])
        _fit_nuisance(motion, regressor, state)
        if step.size and np.max(np.abs(step) / (np.abs(before[free]) + 1e-2)) < _CHANGE:
            break
    state.gain = np.where(np.isfinite(unknowns.gain), state.gain, np.nan)
    _reweigh(motion, regressor, state)
    return _finish(motion, regressor, state, free, precision)


def residual(motion: Motion, regressor: FloatArray, solution: Solution) -> FloatArray:
    """(n, j) torque that is left, N·m; meaningful where a joint moves."""
    s = solution
    state = _State(s.inertials, s.armature, s.gain, s.nuisance, s.sigma, motion.moving.astype(np.float64))
    return _left(motion, regressor, state)


def settle(motion: Motion, regressor: FloatArray, solution: Solution) -> Solution:
    """The solution with friction and offset fitted again, after other unknowns were moved."""
    s = solution
    state = _State(s.inertials, s.armature, s.gain, s.nuisance.copy(), s.sigma.copy(), motion.moving.astype(np.float64))
    for _ in range(3):
        _fit_nuisance(motion, regressor, state)
        _reweigh(motion, regressor, state)
    return replace(solution, nuisance=state.nuisance, sigma=state.sigma)


def _columns(motion: Motion, j: int) -> FloatArray:
    v = motion.velocity[:, j]
    return np.column_stack([np.sign(v), v, np.ones_like(v)])


def _left(motion: Motion, regressor: FloatArray, state: _State) -> FloatArray:
    model = regressor @ state.inertials + motion.acceleration * state.armature
    friction = np.stack([_columns(motion, j) @ state.nuisance[j] for j in range(motion.effort.shape[1])], axis=1)
    return np.asarray(motion.effort / state.gain - motion.contact - model - friction)


def _fit_nuisance(motion: Motion, regressor: FloatArray, state: _State) -> None:
    """Friction and offset of every joint for what is left by the rest."""
    rest = _left(motion, regressor, state)
    for j in range(rest.shape[1]):
        root = np.sqrt(state.weight[:, j])
        if np.count_nonzero(root) < 4:
            continue
        columns = _columns(motion, j)
        found = np.linalg.lstsq(columns * root[:, None], rest[:, j] * root, rcond=None)[0]
        state.nuisance[j] += found


def _reweigh(motion: Motion, regressor: FloatArray, state: _State) -> None:
    """Noise level of each joint (median absolute residual), Huber weights, and the design effect of clusters."""
    rest = _left(motion, regressor, state)
    for j in range(rest.shape[1]):
        use = motion.moving[:, j]
        if not use.any():
            continue
        state.sigma[j] = max(1.4826 * float(np.median(np.abs(rest[use, j]))), 1e-4)
        ratio = np.abs(rest[:, j]) / state.sigma[j]
        weight = np.where(use, np.minimum(1.0, _HUBER / np.maximum(ratio, 1e-9)), 0.0)
        together = np.bincount(motion.cluster, weights=weight * rest[:, j])
        alone = float(np.sum((weight * rest[:, j]) ** 2))
        state.weight[:, j] = weight / max(1.0, float(np.sum(together**2)) / max(alone, 1e-30))


def _jacobian(
    motion: Motion, regressor: FloatArray, state: _State, j: int, free: BoolArray, rest: FloatArray
) -> FloatArray:
    """(n, f) derivatives of joint j's torque by the free unknowns, friction and offset projected out, weighted."""
    joints = motion.effort.shape[1]
    p = state.inertials.size
    torque = motion.effort[:, j] / state.gain[j]
    smooth = torque - rest[:, j]
    extra = np.zeros((motion.count, 2 * joints))
    extra[:, j] = motion.acceleration[:, j]
    extra[:, joints + j] = smooth / state.gain[j]
    full = np.concatenate([regressor[:, j], extra], axis=1)[:, free]
    assert full.shape[1] == int(free.sum()) and free.size == p + 2 * joints
    root = np.sqrt(state.weight[:, j]) / state.sigma[j]
    basis, _ = np.linalg.qr(_columns(motion, j) * root[:, None])
    weighted = full * root[:, None]
    return np.asarray(weighted - basis @ (basis.T @ weighted))


def _normal(motion: Motion, regressor: FloatArray, state: _State, free: BoolArray) -> tuple[FloatArray, FloatArray]:
    """Gradient (f,) and data part of the precision matrix (f, f)."""
    rest = _left(motion, regressor, state)
    size = int(free.sum())
    gradient, data = np.zeros(size), np.zeros((size, size))
    for j in range(rest.shape[1]):
        if state.weight[:, j].any():
            jac = _jacobian(motion, regressor, state, j, free, rest)
            gradient += jac.T @ (rest[:, j] * np.sqrt(state.weight[:, j]) / state.sigma[j])
            data += jac.T @ jac
    return gradient, data


def _finish(motion: Motion, regressor: FloatArray, state: _State, free: BoolArray, precision: FloatArray) -> Solution:
    """Covariance: H^-1 (sum of cluster scores squared + prior) H^-1, and the share that the data give."""
    rest = _left(motion, regressor, state)
    size, clusters = int(free.sum()), int(motion.cluster.max()) + 1
    data, scores = np.zeros((size, size)), np.zeros((clusters, size))
    nuisance_sd = np.zeros_like(state.nuisance)
    for j in range(rest.shape[1]):
        if not state.weight[:, j].any():
            continue
        root = np.sqrt(state.weight[:, j]) / state.sigma[j]
        jac = _jacobian(motion, regressor, state, j, free, rest)
        data += jac.T @ jac
        np.add.at(scores, motion.cluster, jac * (rest[:, j] * root)[:, None])
        nuisance_sd[j] = _clustered_sd(_columns(motion, j) * root[:, None], rest[:, j] * root, motion)
    hessian = data + np.diag(precision[free])
    inverse = np.linalg.pinv(hessian, hermitian=True)
    small = clusters / max(1, clusters - 1)
    covariance = inverse @ (small * scores.T @ scores + np.diag(precision[free])) @ inverse
    information = np.diag(inverse @ data) if size else np.zeros(0)
    return Solution(
        state.inertials,
        state.armature,
        state.gain,
        state.nuisance,
        covariance,
        np.asarray(information),
        free,
        state.sigma,
        hessian,
        nuisance_sd,
    )


def _clustered_sd(columns: FloatArray, rest: FloatArray, motion: Motion) -> FloatArray:
    inverse = np.linalg.pinv(columns.T @ columns, hermitian=True)
    scores = np.zeros((int(motion.cluster.max()) + 1, columns.shape[1]))
    np.add.at(scores, motion.cluster, columns * rest[:, None])
    out: FloatArray = np.sqrt(np.diag(inverse @ scores.T @ scores @ inverse))
    return out
