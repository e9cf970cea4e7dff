"""Weighted least squares of f(v) = A + B·exp(-C·v) + D·v, separated: C by search, A, B, D linear.

For fixed C the model is linear in A, B, D (and a nuisance offset between the directions), so the sum of
squares is a function of C alone (variable projection: Golub and Pereyra, SIAM J. Numer. Anal. 10, 1973).
Everything uncertain about the fit is read from that one curve: the interval of C by its level set, those
of A, B, D by profiling over C (Bates and Watts, Nonlinear Regression Analysis, 1988, ch. 6).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from collaudit.core.series import FloatArray

_COARSE = 161
_DENSE = 121
_REACH = 5.0  # standard errors of C to either side of the best


@dataclass(frozen=True, slots=True, eq=False)
class Points:
    """Friction points as arrays.

    Attributes:
        speed: (n,) positive speeds.
        friction: (n,) friction.
        sd: (n,) standard deviation of each.
        offset: (n,) column of the nuisance offset (+1/-1 by direction of model points, 0 for pairs), or None.
    """

    speed: FloatArray
    friction: FloatArray
    sd: FloatArray
    offset: FloatArray | None

    @property
    def n(self) -> int:
        """Number of points."""
        return int(self.speed.size)

    def columns(self, *shape: FloatArray) -> FloatArray:
        """(n, k) weighted design matrix of the given columns, with the offset last."""
        parts = [*shape] if self.offset is None else [*shape, self.offset]
        return np.asarray(np.stack(parts, axis=-1) / self.sd[:, None])

    @property
    def target(self) -> FloatArray:
        """(n,) weighted friction."""
        return np.asarray(self.friction / self.sd)


@dataclass(frozen=True, slots=True, eq=False)
class LinearFit:
    """Estimates (k,), unscaled covariance (k, k) and weighted sum of squares of a linear fit."""

    estimate: FloatArray
    covariance: FloatArray
    sum_squares: float


@dataclass(frozen=True, slots=True, eq=False)
class Profile:
    """The separated fit along C.

    Attributes:
        c: (m,) grid of C, ascending, the best one among them.
        sum_squares: (m,) best sum of squares at each C.
        estimate: (m, k) A, B, D (and offset) at each C.
        variance: (m, k) their unscaled variances at each C.
        best: index of the minimum.
    """

    c: FloatArray
    sum_squares: FloatArray
    estimate: FloatArray
    variance: FloatArray
    best: int


def solve(design: FloatArray, target: FloatArray | None = None) -> LinearFit:
    """Least squares through a column-scaled QR decomposition (of zeros, for the covariance alone)."""
    target = np.zeros(design.shape[0]) if target is None else target
    scale = np.linalg.norm(design, axis=0)
    q, r = np.linalg.qr(design / scale)
    inverse = np.linalg.inv(r)
    estimate = inverse @ (q.T @ target) / scale
    covariance = (inverse @ inverse.T) / np.outer(scale, scale)
    rest = target - design @ estimate
    return LinearFit(estimate, covariance, float(rest @ rest))


def fit_coulomb_viscous(points: Points) -> LinearFit:
    """A + D·v (and the offset)."""
    one = np.ones(points.n)
    return solve(points.columns(one, points.speed), points.target)


def fit_at(points: Points, c: float) -> LinearFit:
    """A, B, D (and the offset) at a fixed C."""
    one = np.ones(points.n)
    return solve(points.columns(one, np.exp(-c * points.speed), points.speed), points.target)


def search_range(points: Points) -> tuple[float, float]:
    """C from where the exponential is straight over all speeds to where it is gone at the slowest."""
    return 0.03 / float(points.speed.max()), 12.0 / float(points.speed.min())


def profile(points: Points) -> Profile:
    """Fit A, B, D along a logarithmic grid of C, dense around the best.

    A well determined C has an interval far narrower than one step of the coarse grid, and every interval
    is read off this profile: the dense part spans about four standard errors to either side.
    """
    low, high = search_range(points)
    grid = np.geomspace(low, high, _COARSE)
    sums = np.array([fit_at(points, float(c)).sum_squares for c in grid])
    k = int(np.argmin(sums))
    best = _refine(points, float(grid[max(k - 1, 0)]), float(grid[min(k + 1, _COARSE - 1)]))
    near = _near(points, best, low, high)
    grid = np.unique(np.concatenate([grid, near, [best]]))
    fits = [fit_at(points, float(c)) for c in grid]
    sums = np.array([f.sum_squares for f in fits])
    return Profile(
        grid,
        sums,
        np.array([f.estimate for f in fits]),
        np.array([np.diag(f.covariance) for f in fits]),
        int(np.argmin(sums)),
    )


def _near(points: Points, best: float, low: float, high: float) -> FloatArray:
    """Dense grid about the best C, as wide as its standard error (linearised) asks."""
    fit = fit_at(points, best)
    jac = jacobian(points, fit.estimate, best)
    scale = max(1.0, fit.sum_squares / max(1, points.n - jac.shape[1]))
    try:
        se = float(np.sqrt(scale * solve(jac).covariance[2, 2]))
    except np.linalg.LinAlgError:  # no exponential at all: C has no standard error, the coarse grid is enough
        return np.empty(0)
    if not np.isfinite(se) or se > best:
        return np.empty(0)
    reach = np.linspace(-_REACH, _REACH, _DENSE) * se
    return np.clip(best + reach, low, high)


def _refine(points: Points, low: float, high: float) -> float:
    from scipy.optimize import minimize_scalar

    found = minimize_scalar(
        lambda x: fit_at(points, float(np.exp(x))).sum_squares,
        bounds=(np.log(low), np.log(high)),
        method="bounded",
        options={"xatol": 1e-9},
    )
    return float(np.exp(found.x))


def jacobian(points: Points, a_b_d: FloatArray, c: float) -> FloatArray:
    """(n, 4 or 5) weighted derivatives of the model by A, B, C, D (and the offset)."""
    decay = np.exp(-c * points.speed)
    one = np.ones(points.n)
    return points.columns(one, decay, -a_b_d[1] * points.speed * decay, points.speed)


def interval_of_c(prof: Profile, allowance: float) -> tuple[float | None, float | None]:
    """Where the sum of squares stays within ``allowance`` of its minimum; None on a side that stays open."""
    inside = np.flatnonzero(prof.sum_squares <= prof.sum_squares[prof.best] + allowance)
    first, last = int(inside[0]), int(inside[-1])
    level = prof.sum_squares[prof.best] + allowance
    low = None if first == 0 else _crossing(prof, first - 1, first, level)
    high = None if last == prof.c.size - 1 else _crossing(prof, last, last + 1, level)
    return low, high


def _crossing(prof: Profile, a: int, b: int, level: float) -> float:
    """C at which the sum of squares passes ``level`` between two grid points (log-linear)."""
    sa, sb = prof.sum_squares[a], prof.sum_squares[b]
    share = (level - sa) / (sb - sa) if sb != sa else 0.5
    return float(np.exp(np.log(prof.c[a]) + share * (np.log(prof.c[b]) - np.log(prof.c[a]))))


def interval_of_linear(prof: Profile, column: int, allowance: float) -> tuple[float, float]:
    """Profile interval of A (0), B (1) or D (2): every value some C reaches within ``allowance``.

    At a fixed C the sum of squares rises by (x - x̂(C))² / V(C); the interval is the union over C.
    """
    spare = prof.sum_squares[prof.best] + allowance - prof.sum_squares
    inside = spare >= 0
    half = np.sqrt(spare[inside] * prof.variance[inside, column])
    centre = prof.estimate[inside, column]
    return float(np.min(centre - half)), float(np.max(centre + half))
