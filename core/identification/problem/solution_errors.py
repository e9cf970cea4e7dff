"""How well a solution of the identification problem is known: standard errors, and fits without a part of the samples.

The covariance is H^-1 (sum of squared scores of one-second clusters + prior) H^-1 (Liang and Zeger, Biometrika 73,
1986). H is the derivative of Huber's estimating equations, so that weighing outliers down does not pass for knowledge
(Huber, Annals of Statistics 1, 1973). A cluster that has a large share of what is known of a parameter counts as
:func:`clustered_covariance` says.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from collaudit.core.identification.problem.identification_problem import (
    Solution,
    State,
    jacobian,
    solve,
    weighted_joints,
    weighted_state,
)
from collaudit.core.identification.problem.problem_terms import OFFSET, Terms, Unknowns
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray
from collaudit.core.torque_table.block_sums import clustered_covariance, generalised_inverse

#: Share of the largest singular value below which combinations of unknowns are not told.
RANK = 1e-12


@dataclass(frozen=True, slots=True, eq=False)
class StandardErrors:
    """How well a solution is known; standard errors are such that 1.96 of them span the 95 % interval.

    Attributes:
        covariance: (f, f) of the free unknowns, prior included.
        offset_sd: (j,) standard errors of the offsets, the other unknowns' errors included.
        nuisance: (j, k, k) covariance of friction, offset and springs of each joint.
        products, every: (f + j k, f + j k) of all of these: weighted products of their columns, and covariance.
    """

    covariance: FloatArray
    offset_sd: FloatArray
    nuisance: FloatArray
    products: FloatArray
    every: FloatArray

    def moved(self, some: IntArray) -> FloatArray:
        """(k, k) covariance by which some unknowns, by number, are off where like motion tells them, friction beside.

        They take up what is wrong of all others, which are held as found: of the products H and the covariance C of all
        unknowns that is K C Kᵀ with K = H_ss⁻¹ H_s.
        """
        told = np.concatenate([some, np.arange(len(self.covariance), len(self.products))])
        taken = generalised_inverse(self.products[np.ix_(told, told)]) @ self.products[told]
        return np.asarray((taken @ self.every @ taken.T)[: some.size, : some.size])


def standard_errors(terms: Terms, solution: Solution, unknowns: Unknowns) -> StandardErrors:
    """Covariance of all unknowns together, friction and offset among them."""
    state = weighted_state(terms, solution)
    data, parts = _assembled(terms, state, state.slope)
    scales = unknowns.sd[solution.free]
    precision = np.zeros(len(data))
    precision[: scales.size] = scales**-2.0
    inverse = generalised_inverse(data + np.diag(precision), RANK)
    influence, share = np.zeros((terms.starts.size, len(data))), np.zeros((terms.starts.size, len(data)))
    for j, place, columns, slope in parts:
        score = columns * (state.weight[:, j] * state.rest[:, j] / state.at.sigma[j] ** 2)[:, None]
        influence += terms.by_cluster(score) @ inverse[place]
        share += terms.by_cluster((columns @ inverse[place]) ** 2 * slope[:, None])
    full = clustered_covariance(influence, share) + (inverse * precision) @ inverse
    joints, kinds = solution.gain.size, terms.nuisance.shape[2]
    offset = scales.size + kinds * np.arange(joints) + OFFSET
    known = np.sqrt(np.maximum(np.diag(full)[offset], 0.0))
    own = [scales.size + kinds * j + np.arange(kinds) for j in range(joints)]
    nuisance = np.array([full[np.ix_(place, place)] for place in own])
    return StandardErrors(np.asarray(full[: scales.size, : scales.size]), known, nuisance, data, np.asarray(full))


#: Of a joint: its number, the unknowns that it feels (f_j,), its columns (n, f_j) by them, weights (n,) of its samples.
_Part = tuple[int, IntArray, FloatArray, FloatArray]


def _assembled(terms: Terms, state: State, weight: FloatArray) -> tuple[FloatArray, list[_Part]]:
    """(f, f) products of the columns of all joints that count, friction and offset among the unknowns, and their parts.

    Args:
        terms, state: the problem about its solution.
        weight: (n, j) of the samples, in units of each joint's noise.
    """
    size = np.count_nonzero(state.at.free) + terms.nuisance.shape[2] * state.at.gain.size
    hessian, parts = np.zeros((size, size)), list[_Part]()
    for j in weighted_joints(state):
        place, columns = jacobian(terms, state, j)
        own = weight[:, j] / state.at.sigma[j] ** 2
        hessian[np.ix_(place, place)] += (columns * own[:, None]).T @ columns
        parts.append((j, place, columns, own))
    return hessian, parts


#: Gauss-Newton steps of a held-out fit; nearly all of the change is in the first.
HELD_OUT_STEPS = 3


def _left_without(terms: Terms, solution: Solution, unknowns: Unknowns) -> Callable[[BoolArray], FloatArray]:
    """What is left (m, j) of samples (n,) given, by a fit to the others, N·m.

    The problem is taken as linear about its solution, friction and offset among the unknowns, with the weights that its
    samples have there; a part's share is subtracted from the normal equations.
    """
    state = weighted_state(terms, solution)
    products, parts = _assembled(terms, state, state.weight)
    free, kinds = solution.free, terms.nuisance.shape[2]
    known = int(np.count_nonzero(free))
    precision = np.zeros(len(products))
    precision[:known] = unknowns.sd[free] ** -2.0
    slope = np.zeros_like(precision)
    slope[:known] = precision[:known] * (unknowns.values - solution.values)[free]
    for j, place, columns, weight in parts:
        friction = slice(known + kinds * j, known + kinds * (j + 1))
        precision[friction] = _friction_precision(terms, j)
        slope[friction] = -precision[friction] * solution.nuisance[j]
        slope[place] += (columns * weight[:, None]).T @ state.rest[:, j]
    products += np.diag(precision)

    def without(out: BoolArray) -> FloatArray:
        hessian, gradient, left = products.copy(), slope.copy(), state.rest[out]
        own = [(j, place, columns[out], weight[out]) for j, place, columns, weight in parts]
        for j, place, columns, weight in own:
            weighed = columns * weight[:, None]
            hessian[np.ix_(place, place)] -= weighed.T @ columns
            gradient[place] -= weighed.T @ left[:, j]
        step = generalised_inverse(hessian, RANK) @ gradient
        for j, place, columns, _ in own:
            left[:, j] -= columns @ step[place]
        return left

    return without


def _friction_precision(terms: Terms, j: int) -> FloatArray:
    """(k,) of the coefficients of friction and offset: no part of them is expected to exceed its joint's whole torque.

    Where a part's speeds were seen in no other part, the other parts leave some combinations of them open.
    """
    use = terms.motion.moving[:, j]
    torque, columns = terms.motion.effort[use, j], terms.nuisance[j][use]
    return np.asarray(np.mean(columns**2, axis=0) / max(float(np.mean(torque**2)), 1e-12))


def held_out(terms: Terms, unknowns: Unknowns, divisions: Sequence[IntArray]) -> FloatArray:
    """(n, j) torque left of each sample by a fit without its part, N·m; root mean square over the divisions.

    Those of Huber's weights are kept that the fit to all samples has. Samples at which a joint does not count are NaN.
    """
    motion = replace(terms.motion, moving=terms.motion.moving & np.isfinite(unknowns.gain))
    known = replace(terms, motion=motion).without_drift()
    left_without = _left_without(known, solve(known, unknowns, HELD_OUT_STEPS), unknowns)
    squares = np.zeros_like(known.motion.effort)
    for part in divisions:
        for number in np.unique(part):
            out = np.asarray(part == number)
            squares[out] += left_without(out) ** 2
    return np.where(known.motion.moving, np.sqrt(squares / len(divisions)), np.nan)
