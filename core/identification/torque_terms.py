"""What a joint's torque is linear in: inertials, and friction, coupled axes, angles and offsets beside the rigid body.

A law of friction that is too poor biases what it stands beside: what sliding friction does at low speed has the
sign of the motion, as the torque of a ramp has, and friction that follows the speed late (frictional lag: Rabinowicz,
Proc. Phys. Soc. 71, 1958; LuGre: Canudas de Wit et al., IEEE Trans. Automatic Control 40, 1995) has the shape of
inertia. So the columns are sgn v, v and 1; |v|, which tells the directions apart; sgn v·exp(-|v|/w) for two widths;
and a·exp(-|v|/w) for the lag. A spring or counterbalance is a polynomial in one joint's angle. The offset may wander:
hat functions over each log.

No single body's inertials are told: combinations that torques depend on, base parameters, come from a rank-revealing
QR decomposition (Gautier, J. Robotic Systems 8, 1991). Ten parameters are those of a body with positive density
exactly when its 4 x 4 pseudo-inertia matrix is positive definite (Wensing, Kim and Slotine, IEEE Robot. Autom. Lett.
3, 2018), a convex condition.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag, qr
from scipy.sparse import csc_matrix

from collaudit.core.data.identification_result import DEGREE, AngleTorque, scaled_angle
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray
from collaudit.core.numeric.stats import interval_95
from collaudit.core.robot.robot_model import RobotModel

#: Columns of friction and offset of a joint, and which of them is the offset.
FRICTION_COLUMNS, OFFSET = 7, 2
_LOW_SPEEDS = (0.03, 0.1)  # rad/s: Stribeck velocities of gears lie between
#: rad (or m) that a joint must cover for its angle to tell anything.
_LEAST_RANGE = 0.2
_KNOT_S, _MOST_KNOTS = 30.0, 12  # of an offset that wanders
_SYMBOLS = ("m", "mx", "my", "mz", "Ixx", "Ixy", "Iyy", "Ixz", "Iyz", "Izz")
_RANK = 1e-9
_NEGLIGIBLE = 1e-8
_SHOWN_TERMS = 6
_MARGIN = 1e-6


def friction_columns(velocity: FloatArray, acceleration: FloatArray) -> FloatArray:
    """(n, 7) sgn v, v, 1, |v|, two that fade with speed, and the lag, for one joint.

    Args:
        velocity: (n,) rad/s; acceleration: (n,) rad/s².
    """
    sign, speed = np.sign(velocity), np.abs(velocity)
    fading = [sign * np.exp(-speed / width) for width in _LOW_SPEEDS]
    lag = acceleration * np.exp(-speed / _LOW_SPEEDS[-1])
    return np.column_stack([sign, velocity, np.ones_like(speed), speed, *fading, lag])


def axis_columns(velocity: FloatArray, acceleration: FloatArray, weights: FloatArray) -> FloatArray:
    """(n, 3) sign, speed and acceleration of an axis that turns with several joints (n, j) by their weights (j,)."""
    speed = velocity @ weights
    return np.column_stack([np.sign(speed), speed, acceleration @ weights])


def drift_columns(times_s: Sequence[FloatArray]) -> FloatArray:
    """(n, d) hats about every half minute of each log, less their mean, so that the offset is the mean over time.

    Args:
        times_s: of each log, (n_k,) times of its samples, ascending.
    """
    parts, most = [], max(1, _MOST_KNOTS // len(times_s))
    for k, time in enumerate(times_s):
        # a log of less than half a minute has no drift: a trend would take what gravity does in the few poses it has
        count = min(int(float(time[-1] - time[0]) / _KNOT_S), most) if time.size else 0
        knots = np.linspace(time[0], time[-1], count + 1) if time.size else np.array([0.0])
        # the first log lacks one hat: all hats together are the offset itself
        hats = [np.interp(time, knots, row) for row in np.eye(count + 1)[int(k == 0) :]]
        parts.append(np.array(hats).reshape(len(hats), time.size).T)
    out = block_diag(*parts)
    return np.asarray(out - out.mean(axis=0))


def angle_columns(position: FloatArray, moving: BoolArray) -> FloatArray:
    """(n, 4) Legendre polynomials of the angle over the range seen, less their means; zero where it is too small.

    Args:
        position: (n,) of one joint; moving: (n,) where it counts.
    """
    found = angles_seen(position, moving)
    out = np.zeros((position.size, DEGREE))
    if found is None:
        return out
    low, high, *mean = found
    return _polynomials(position, low, high) - mean


def angles_seen(position: FloatArray, moving: BoolArray) -> tuple[float, ...] | None:
    """Least and largest angle, and the means of the four polynomials; None where the range is too small."""
    if not moving.any():
        return None
    low, high = float(position[moving].min()), float(position[moving].max())
    return (low, high, *_polynomials(position[moving], low, high).mean(axis=0)) if high - low >= _LEAST_RANGE else None


def angle_torque(
    seen: tuple[float, ...] | None, coefficients: FloatArray, covariance: FloatArray | None
) -> AngleTorque | None:
    """The torque that coefficients stand for; None where the motion tells none.

    Args:
        seen: of :func:`angles_seen`.
        coefficients: (4,) of its columns; covariance: (4, 4) of them, None without intervals.
    """
    if seen is None:
        return None
    low, high, *mean = seen
    nodes = np.linspace(low, high, DEGREE + 1)
    columns = _polynomials(nodes, low, high) - mean
    torque = columns @ coefficients
    angles = tuple(nodes.tolist())
    if covariance is None:
        return AngleTorque(angles, tuple(torque.tolist()))
    sd = np.sqrt(np.maximum(np.einsum("ij,jk,ik->i", columns, covariance, columns), 0.0))
    return AngleTorque(angles, tuple(torque.tolist()), tuple(map(interval_95, torque, sd)))


def _polynomials(position: FloatArray, low: float, high: float) -> FloatArray:
    every = np.polynomial.legendre.legvander(np.clip(scaled_angle(position, low, high), -1.0, 1.0), DEGREE)
    return np.asarray(every[:, 1:])


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
