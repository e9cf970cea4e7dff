"""Physical consistency of inertial parameters: positive mass and an inertia some body can have.

Ten parameters are those of a body with positive density exactly when its 4 x 4 pseudo-inertia matrix is positive
definite (Wensing, Kim and Slotine, IEEE Robot. Autom. Lett. 3, 2018), a convex condition.
"""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module
from typing import Any

import numpy as np

from collaudit.core.numeric.arrays import BoolArray, FloatArray

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


def make_consistent(best: FloatArray, hessian: FloatArray, free: BoolArray, bodies: int) -> Consistent:
    """The possible parameters closest to the best ones, in the metric of what the data and the prior know.

    A semidefinite programme, with the extra ``collaudit[identify]``. Without it impossible bodies stay as the data
    put them, which is said: any cheaper repair would move masses away from the data and out of their intervals.

    Args:
        best: (m,) the unconstrained solution: inertials (10 a body), then others that need no check.
        hessian: (f, f) precision of the free unknowns.
        free: (m,) which are free.
        bodies: number of bodies.
    """
    checked = [k for k in range(bodies) if free[10 * k : 10 * k + 10].any()]
    wrong = [k for k in checked if not is_consistent(best[10 * k : 10 * k + 10])]
    if not wrong:
        return Consistent(best[free], True, "the solution is physically consistent by itself")
    count = f"{len(wrong)} {'body' if len(wrong) == 1 else 'bodies'}"
    try:
        found = _programme(best, hessian, free, checked)
    except ModuleNotFoundError:
        how = f'{count} of the solution cannot exist; pip install "collaudit[identify]" for the closest that can'
        return Consistent(best[free], False, how)
    if found is None:
        return Consistent(best[free], False, f"{count} of the solution cannot exist; the convex solver found no other")
    return Consistent(found, True, f"{count} held to what is possible by a semidefinite programme")


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
