"""What fits without a part of the samples leave of that part, from the normal equations of the fit to all of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from collaudit.core.identification.problem.identification_problem import (
    Solution,
    jacobian,
    solve,
    weighted_joints,
    weighted_state,
)
from collaudit.core.identification.problem.problem_terms import Terms, Unknowns
from collaudit.core.identification.problem.standard_errors import scaled_inverse
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray

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
