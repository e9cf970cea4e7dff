"""How well a solution of the identification problem is known: cluster-robust, with few clusters allowed for.

The covariance is H^-1 (sum of squared scores of one-second clusters + prior) H^-1 (Liang and Zeger, Biometrika 73,
1986). H is the derivative of Huber's estimating equations, so that weighing outliers down does not pass for knowledge
(Huber, Annals of Statistics 1, 1973). A cluster with a share h of what is known of a parameter has its influence raised
by 1/(1 - h), as leaving it out would show (jackknife), and 1/sum(h²) takes the place of the number of clusters in
Student's t: a few fast moves may carry all that a log says.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import stdtrit as student_quantile

from collaudit.core.identification.problem.identification_problem import (
    Solution,
    jacobian,
    weighted_joints,
    weighted_state,
)
from collaudit.core.identification.problem.nuisance import OFFSET
from collaudit.core.identification.problem.problem_terms import Terms, Unknowns
from collaudit.core.numeric.arrays import FloatArray
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
