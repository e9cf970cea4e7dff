"""Physical consistency of inertial parameters: positive mass and an inertia some body can have.

Ten parameters are those of a body with positive density exactly when its 4 x 4 pseudo-inertia matrix is positive
definite (Wensing, Kim and Slotine, IEEE Robot. Autom. Lett. 3, 2018), a convex condition.
"""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module
from typing import Any

import numpy as np

from collaudit.core.series import BoolArray, FloatArray

_MARGIN = 1e-6


@dataclass(frozen=True, slots=True, eq=False)
class Consistent:
    """Parameters (free part), whether all bodies are possible, and how that was reached, in words."""

    free: FloatArray
    consistent: bool
    how: str


def pseudo_inertia(ten: FloatArray) -> FloatArray:
    """(4, 4) pseudo-inertia of m, m·c (3), inertia about the origin xx, xy, yy, xz, yz, zz."""
    mass, x, y, z, xx, xy, yy, xz, yz, zz = (float(v) for v in ten)
    half = 0.5 * (xx + yy + zz)
    return np.array([[half - xx, -xy, -xz, x], [-xy, half - yy, -yz, y], [-xz, -yz, half - zz, z], [x, y, z, mass]])


def is_consistent(ten: FloatArray) -> bool:
    """Whether a body can have these parameters (to rounding); a body without mass and inertia can."""
    matrix = pseudo_inertia(ten)
    scale = max(float(np.trace(matrix)), 1e-12)
    return bool(np.linalg.eigvalsh(matrix)[0] >= -1e-6 * scale)


def make_consistent(
    prior: FloatArray, best: FloatArray, hessian: FloatArray, free: BoolArray, bodies: int
) -> Consistent:
    """The possible parameters closest to the best ones, in the metric of what the data and the prior know.

    A semidefinite programme where the extra ``collaudit[identify]`` is installed; else a step back from the best
    parameters towards the prior until every body is possible.

    Args:
        prior: (m,) all unknowns before the data: inertials (10 a body), then others that need no check.
        best: (m,) the unconstrained solution.
        hessian: (f, f) precision of the free unknowns.
        free: (m,) which are free.
        bodies: number of bodies.
    """
    checked = [k for k in range(bodies) if free[10 * k : 10 * k + 10].any()]
    wrong = [k for k in checked if not is_consistent(best[10 * k : 10 * k + 10])]
    if not wrong:
        return Consistent(best[free], True, "the solution is physically consistent by itself")
    impossible = [k for k in checked if not is_consistent(prior[10 * k : 10 * k + 10])]
    try:
        found = _programme(best, hessian, free, checked)
    except ModuleNotFoundError:
        found = None
    if found is not None:
        return Consistent(found, True, f"{len(wrong)} bodies held to what is possible by a semidefinite programme")
    if impossible:
        how = "the robot's description itself has an impossible body, and collaudit[identify] is not installed"
        return Consistent(best[free], False, how)
    share = _step_back(prior, best, checked)
    how = (
        f"stepped back {100 * (1 - share):.0f} % of the way to the robot's description, until every body is possible; "
        "collaudit[identify] finds closer parameters"
    )
    return Consistent((prior + share * (best - prior))[free], True, how)


def _step_back(prior: FloatArray, best: FloatArray, checked: list[int]) -> float:
    """Largest share of the way from the prior at which every body is possible: the set is convex."""
    low, high = 0.0, 1.0
    for _ in range(40):
        middle = 0.5 * (low + high)
        at = prior + middle * (best - prior)
        if all(is_consistent(at[10 * k : 10 * k + 10]) for k in checked):
            low = middle
        else:
            high = middle
    return low


def _programme(best: FloatArray, hessian: FloatArray, free: BoolArray, checked: list[int]) -> FloatArray | None:
    """Closest possible parameters; None when the solver gives up."""
    solver: Any = import_module("cvxpy")

    index = np.flatnonzero(free)
    values, vectors = np.linalg.eigh(hessian)
    root = np.sqrt(np.maximum(values, 1e-12))[:, None] * vectors.T
    scale = float(np.linalg.norm(root, 2))
    unknown = solver.Variable(index.size)
    place = {int(i): n for n, i in enumerate(index)}
    constraints = []
    for k in checked:
        ten = [unknown[place[i]] if i in place else float(best[i]) for i in range(10 * k, 10 * k + 10)]
        mass, x, y, z, xx, xy, yy, xz, yz, zz = ten
        half = 0.5 * (xx + yy + zz)
        rows = [[half - xx, -xy, -xz, x], [-xy, half - yy, -yz, y], [-xz, -yz, half - zz, z], [x, y, z, mass]]
        size = max(float(np.trace(pseudo_inertia(best[10 * k : 10 * k + 10]))), 1e-3)
        constraints.append(solver.bmat(rows) >> _MARGIN * size * np.eye(4))
    objective = solver.Minimize(solver.sum_squares((root / scale) @ (unknown - best[free])))
    problem = solver.Problem(objective, constraints)
    problem.solve(solver="CLARABEL")
    if problem.status not in ("optimal", "optimal_inaccurate") or unknown.value is None:
        return None
    return np.asarray(unknown.value)
