"""How well a solution of the identification problem is known: standard errors, and fits without a part of the samples.

The covariance is H^-1 (sum of squared scores of one-second clusters + prior) H^-1 (Liang and Zeger, Biometrika 73,
1986). H is the derivative of Huber's estimating equations, so that weighing outliers down does not pass for knowledge
(Huber, Annals of Statistics 1, 1973). A cluster with a share h of what is known of a parameter has its influence raised
by 1/(1 - h), as leaving it out would show (jackknife), and 1/sum(h²) takes the place of the number of clusters in
Student's t: a few fast moves may carry all that a log says.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import stdtrit as student_quantile

from collaudit.core.identification.problem.identification_problem import (
    Solution,
    jacobian,
    solve,
    weighted_joints,
    weighted_state,
)
from collaudit.core.identification.problem.problem_terms import OFFSET, Terms, Unknowns
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray
from collaudit.core.numeric.stats import NORMAL_QUANTILE_975

_MOST = 0.9


@dataclass(frozen=True, slots=True, eq=False)
class StandardErrors:
    """How well a solution is known; standard errors are such that 1.96 of them span the 95 % interval.

    Attributes:
        covariance: (f, f) of the free unknowns, prior included.
        offset_sd: (j,) standard errors of the offsets, the other unknowns' errors included.
        nuisance: (j, k, k) covariance of friction, offset and springs of each joint.
    """

    covariance: FloatArray
    offset_sd: FloatArray
    nuisance: FloatArray


def standard_errors(terms: Terms, solution: Solution, unknowns: Unknowns) -> StandardErrors:
    """Covariance of all unknowns together, friction and offset among them."""
    state = weighted_state(terms, solution)
    scales = unknowns.sd[solution.free]
    joints, kinds = solution.gain.size, terms.nuisance.shape[2]
    size = scales.size + kinds * joints
    precision, data = np.zeros(size), np.zeros((size, size))
    precision[: scales.size] = scales**-2.0
    parts = []
    for j in weighted_joints(state):
        place, columns = jacobian(terms, state, j)
        columns = columns / state.at.sigma[j]
        data[np.ix_(place, place)] += (columns * state.slope[:, j, None]).T @ columns
        parts.append((j, place, columns))
    inverse = scaled_inverse(data + np.diag(precision))
    influence, share = np.zeros((terms.starts.size, size)), np.zeros((terms.starts.size, size))
    for j, place, columns in parts:
        score = columns * (state.weight[:, j] * state.rest[:, j] / state.at.sigma[j])[:, None]
        influence += terms.by_cluster(score) @ inverse[place]
        share += terms.by_cluster((columns @ inverse[place]) ** 2 * state.slope[:, j, None])
    full = clustered_covariance(influence, share) + (inverse * precision) @ inverse
    offset = scales.size + kinds * np.arange(joints) + OFFSET
    known = np.sqrt(np.maximum(np.diag(full)[offset], 0.0))
    own = [scales.size + kinds * j + np.arange(kinds) for j in range(joints)]
    nuisance = np.array([full[np.ix_(place, place)] for place in own])
    return StandardErrors(np.asarray(full[: scales.size, : scales.size]), known, nuisance)


def scaled_inverse(hessian: FloatArray) -> FloatArray:
    """Generalised inverse of (f, f), its rows and columns scaled to a diagonal of one."""
    scale = np.sqrt(np.maximum(np.diag(hessian), 1e-30))
    inverse = np.linalg.pinv(hessian / np.outer(scale, scale), rcond=1e-12, hermitian=True)
    return np.asarray(inverse / np.outer(scale, scale))


def clustered_covariance(influence: FloatArray, share: FloatArray) -> FloatArray:
    """(f, f) from what each cluster moves (c, f), and the information (c, f) that each brings."""
    part = share / np.maximum(share.sum(axis=0), 1e-300)
    clusters = 1.0 / np.maximum(np.sum(part**2, axis=0), 1e-12)
    reach = student_quantile(np.clip(clusters - 1.0, 1.0, 1e6), 0.975) / NORMAL_QUANTILE_975
    raised = influence / (1.0 - np.minimum(part, _MOST)) * reach
    return np.asarray(raised.T @ raised)


#: Gauss-Newton steps of a held-out fit; nearly all of the change is in the first.
HELD_OUT_STEPS = 3


@dataclass(frozen=True, slots=True, eq=False)
class Linearised:
    """The least-squares problem about a solution, friction and offset among its f unknowns.

    Attributes:
        rest_nm: (n, j) torque that the solution leaves.
        joints: of each joint that counts its number, the unknowns that it feels (f_j,), its columns (n, f_j) by them
            and the weights (n,) of its samples.
        hessian: (f, f) of all samples and the prior.
        gradient: (f,) of both, at the solution.
    """

    rest_nm: FloatArray
    joints: tuple[tuple[int, IntArray, FloatArray, FloatArray], ...]
    hessian: FloatArray
    gradient: FloatArray

    def without(self, out: BoolArray) -> FloatArray:
        """(m, j) torque that is left of the samples (n,) given, by a fit to the others, N·m."""
        hessian, gradient, left = self.hessian.copy(), self.gradient.copy(), self.rest_nm[out]
        parts = [(j, place, columns[out], weight[out]) for j, place, columns, weight in self.joints]
        for j, place, columns, weight in parts:
            weighed = columns * weight[:, None]
            hessian[np.ix_(place, place)] -= weighed.T @ columns
            gradient[place] -= weighed.T @ left[:, j]
        step = scaled_inverse(hessian) @ gradient
        for j, place, columns, _ in parts:
            left[:, j] -= columns @ step[place]
        return left


def linearised(terms: Terms, solution: Solution, unknowns: Unknowns) -> Linearised:
    """The problem about its solution, with the weights that its samples have there."""
    state = weighted_state(terms, solution)
    free, kinds = solution.free, terms.nuisance.shape[2]
    known = int(np.count_nonzero(free))
    precision = np.zeros(known + kinds * solution.gain.size)
    precision[:known] = unknowns.sd[free] ** -2.0
    gradient = np.zeros_like(precision)
    gradient[:known] = precision[:known] * (unknowns.values - solution.values)[free]
    hessian, joints = np.zeros((precision.size, precision.size)), []
    for j in weighted_joints(state):
        friction = slice(known + kinds * j, known + kinds * (j + 1))
        precision[friction] = _friction_precision(terms, j)
        gradient[friction] = -precision[friction] * solution.nuisance[j]
        place, columns = jacobian(terms, state, j)
        weight = state.weight[:, j] / state.at.sigma[j] ** 2
        weighed = columns * weight[:, None]
        hessian[np.ix_(place, place)] += weighed.T @ columns
        gradient[place] += weighed.T @ state.rest[:, j]
        joints.append((j, place, columns, weight))
    return Linearised(state.rest, tuple(joints), hessian + np.diag(precision), gradient)


def _friction_precision(terms: Terms, j: int) -> FloatArray:
    """(k,) of the coefficients of friction and offset: no part of them is expected to exceed its joint's whole torque.

    Where a part's speeds were seen in no other part, the other parts leave some combinations of them open.
    """
    use = terms.motion.moving[:, j]
    torque, columns = terms.motion.effort[use, j], terms.nuisance[j][use]
    return np.asarray(np.mean(columns**2, axis=0) / max(float(np.mean(torque**2)), 1e-12))


def held_out(terms: Terms, unknowns: Unknowns, divisions: Sequence[IntArray]) -> FloatArray:
    """(n, j) torque left of each sample by a fit without its part, N·m; root mean square over the divisions.

    The problem is linear but for Huber's weights. Those of the fit to all samples are kept, so what a fit without a
    part finds follows from the normal equations less that part's share of them. Samples at which a joint does not count
    are NaN.
    """
    known = terms.over(replace(terms.motion, moving=terms.motion.moving & np.isfinite(unknowns.gain))).without_drift()
    moving, whole = known.motion.moving, linearised(known, solve(known, unknowns, HELD_OUT_STEPS), unknowns)
    squares = np.zeros_like(known.motion.effort)
    for part in divisions:
        for number in np.unique(part):
            out = np.asarray(part == number)
            squares[out] += whole.without(out) ** 2
    return np.where(moving, np.sqrt(squares / len(divisions)), np.nan)
