"""Inertial parameters that no single body tells: combinations that torques depend on, and what bodies can have at all.

Base parameters come from a rank-revealing QR decomposition (Gautier, J. Robotic Systems 8, 1991). Ten parameters are
those of a body with positive density exactly when its 4 x 4 pseudo-inertia matrix is positive definite (Wensing, Kim
and Slotine, IEEE Robot. Autom. Lett. 3, 2018), a convex condition.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csc_matrix

from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray
from collaudit.core.robot.robot_model import RobotModel

_SYMBOLS = ("m", "mx", "my", "mz", "Ixx", "Ixy", "Iyy", "Ixz", "Iyz", "Izz")
_RANK = 1e-9
_NEGLIGIBLE = 1e-8
_SHOWN_TERMS = 6
_MARGIN = 1e-6


@dataclass(frozen=True, slots=True, eq=False)
class BaseMap:
    """base = matrix @ parameters; ``names`` say which combinations these are.

    Attributes:
        matrix: (b, p).
        names: b texts.
        first: (b,) the parameter of each by which torques change as by the combination.
    """

    matrix: FloatArray
    names: tuple[str, ...]
    first: IntArray


def base_map(robot: RobotModel, labels: tuple[str, ...]) -> BaseMap:
    """Base parameters of an arm, from its regressor at random motions.

    Args:
        robot: the arm.
        labels: names of its moving bodies, ten parameters each.
    """
    from scipy.linalg import qr

    rng = np.random.default_rng(0)  # the combinations do not depend on the motions
    joints = len(robot.joint_names)
    motion = [rng.uniform(-np.pi, np.pi, (60, joints)) for _ in range(3)]
    stacked = robot.torque_regressor(*motion).reshape(60 * joints, -1)
    _, r, order = qr(stacked, mode="economic", pivoting=True)
    diagonal = np.abs(np.diag(r))
    rank = int(np.count_nonzero(diagonal > _RANK * diagonal[0]))
    dependent = np.linalg.solve(r[:rank, :rank], r[:rank, rank:])
    matrix = np.zeros((rank, stacked.shape[1]))
    matrix[np.arange(rank), order[:rank]] = 1.0
    dependent[np.abs(dependent) < _NEGLIGIBLE] = 0.0
    matrix[:, order[rank:]] = dependent
    symbols = [f"{s}({label})" for label in labels for s in _SYMBOLS]
    names = tuple(_name(row, int(k), symbols) for row, k in zip(matrix, order[:rank], strict=True))
    return BaseMap(matrix, names, np.asarray(order[:rank], dtype=np.int64))


def _name(row: FloatArray, first: int, symbols: list[str]) -> str:
    terms = [symbols[first]]
    others = [int(k) for k in np.flatnonzero(row) if k != first]
    for k in others[:_SHOWN_TERMS]:
        sign, size = ("+", row[k]) if row[k] > 0 else ("-", -row[k])
        factor = "" if abs(size - 1.0) < 1e-6 else f"{size:.3g}·"
        terms.append(f"{sign} {factor}{symbols[k]}")
    if len(others) > _SHOWN_TERMS:
        terms.append(f"+ {len(others) - _SHOWN_TERMS} more")
    return " ".join(terms)


def prior_directions(base: FloatArray, sd: FloatArray) -> FloatArray:
    """(p, r) directions of the inertial parameters that torques depend on, each a standard deviation of the prior.

    Args:
        base: (b, p) combinations that torques depend on; sd: (p,) of the prior.
    """
    _, size, directions = np.linalg.svd(base * sd, full_matrices=False)
    return np.asarray(sd[:, None] * directions[size > _RANK * size.max(initial=0.0)].T)


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
    found = _programme(best, hessian, free, checked)
    if found is None:
        return Consistent(best[free], False, f"{count} of the solution cannot exist; the convex solver found no other")
    return Consistent(found, True, f"{count} held to what is possible by a semidefinite programme")


def _programme(best: FloatArray, hessian: FloatArray, free: BoolArray, checked: list[int]) -> FloatArray | None:
    """Closest possible parameters; None when the solver gives up.

    With x = best + W z and W Wᵀ = H⁻¹, minimise |z|² such that each body's pseudo-inertia less a margin is positive
    semidefinite, in Clarabel's form: A z + s = b, s a stack of triangles of positive semidefinite matrices.
    """
    import clarabel

    values, vectors = np.linalg.eigh(hessian)
    root = vectors / np.sqrt(np.maximum(values, 1e-12))
    to_pseudo = np.stack([_triangle(pseudo_inertia(unit)) for unit in np.eye(10)], axis=1)
    moved = np.zeros((best.size, root.shape[1]))
    moved[free] = root
    parts, bounds = [], []
    for k in checked:
        own = slice(10 * k, 10 * k + 10)
        pseudo = pseudo_inertia(best[own])
        size = max(float(np.trace(pseudo)), 1e-3)
        parts.append(-to_pseudo @ moved[own] / size)
        bounds.append(_triangle(pseudo / size - _MARGIN * np.eye(4)))
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    unknowns, cones = root.shape[1], [clarabel.PSDTriangleConeT(4)] * len(checked)
    matrix, bound = csc_matrix(np.vstack(parts)), np.concatenate(bounds)
    solver = clarabel.DefaultSolver(csc_matrix(np.eye(unknowns)), np.zeros(unknowns), matrix, bound, cones, settings)
    solution = solver.solve()
    if solution.status not in (clarabel.SolverStatus.Solved, clarabel.SolverStatus.AlmostSolved):
        return None
    return np.asarray(best[free] + root @ np.array(solution.x))


def _triangle(matrix: FloatArray) -> FloatArray:
    """(10,) upper triangle of a symmetric (4, 4) matrix, column by column, off its diagonal times √2: an isometry."""
    column, row = np.tril_indices(4)
    return np.asarray(matrix[row, column] * np.where(row == column, 1.0, np.sqrt(2.0)))
