"""Weighted least squares of friction laws such as A + B·exp(-C·v) + D·v, separated: C by search, the rest linear.

For fixed C a law is linear in A, B, D (and a nuisance offset between the directions), so the sum of
squares is a function of C alone (variable projection: Golub and Pereyra, SIAM J. Numer. Anal. 10, 1973).
Everything uncertain about the fit is read from that one curve: the interval of C by its level set, those
of A, B, D by profiling over C (Bates and Watts, Nonlinear Regression Analysis, 1988, ch. 6).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import stdtrit as student_quantile

from collaudit.core.data.friction_result import Bounds, FrictionPoint
from collaudit.core.friction_laws.friction_law import SeparableLaw
from collaudit.core.numeric.arrays import FloatArray, IntArray
from collaudit.core.numeric.stats import parabola_minimum

_COARSE = 161
_DENSE = 121
_FINE = 33  # of a search: over two steps of the coarse grid
_UNBOUNDED = 1e300  # a variance without bound, still finite: a weight of 0 takes it out, where 0 times infinity is none
_FLAT = 1e-13  # diagonal element of a triangle of columns of length one: the column is gone in rounding
_REACH = 5.0  # standard errors of C to either side of the best
_LEVEL = 0.975  # of Student's t at the upper end of an interval


@dataclass(frozen=True, slots=True, eq=False)
class Points:
    """Friction points as arrays.

    Attributes:
        speed: (n,) positive speeds.
        friction: (n,) friction.
        sd: (n,) standard deviation of each.
        offset: (n,) column of the nuisance offset (+1/-1 by direction of model points, 0 for pairs), or None.
        direction: (n,) +1 or -1 of model points, 0 for pairs.
        timing: (n,) error that all points share: what one standard deviation of the effort's stamp does to each.
    """

    speed: FloatArray
    friction: FloatArray
    sd: FloatArray
    offset: FloatArray | None
    direction: FloatArray
    timing: FloatArray

    @property
    def n(self) -> int:
        """Number of points."""
        return int(self.speed.size)

    def columns(self, *shape: FloatArray) -> FloatArray:
        """(n, k) weighted design matrix of the given columns, with the offset last."""
        parts = [*shape] if self.offset is None else [*shape, self.offset]
        return self.weighted(np.stack(parts, axis=-1))

    def raw(self, law: SeparableLaw, c: float | FloatArray = 0.0) -> FloatArray:
        """(…, n, k) columns of a law at a rate, or at (m, 1) rates; not weighted."""
        shape = law.shape(self.speed, c)
        parts = [*shape] if self.offset is None else [*shape, self.offset]
        return np.ascontiguousarray(np.stack(np.broadcast_arrays(*parts), axis=-1))

    def design(self, law: SeparableLaw, c: float | FloatArray = 0.0) -> FloatArray:
        """(…, n, k) weighted design matrix of a law at a rate, or at (m, 1) rates."""
        return self.weighted(self.raw(law, c))

    def weighted(self, x: FloatArray) -> FloatArray:
        """Rows of (n,) or (…, n, k) in units of their errors: the inverse root of diag(sd²) + timing timingᵀ."""
        shared = self.timing / self.sd
        size = float(shared @ shared)
        x = x / (self.sd if x.ndim == 1 else self.sd[:, None])
        if size == 0.0:
            return np.asarray(x)
        share = (1.0 - 1.0 / np.sqrt(1.0 + size)) / size
        along = shared @ x
        return np.asarray(x - share * (shared * along if x.ndim == 1 else shared[:, None] * along[..., None, :]))

    def take(self, rows: IntArray) -> Points:
        """Only these rows."""
        offset = None if self.offset is None else self.offset[rows]
        direction, timing = self.direction[rows], self.timing[rows]
        return Points(self.speed[rows], self.friction[rows], self.sd[rows], offset, direction, timing)

    @property
    def target(self) -> FloatArray:
        """(n,) weighted friction."""
        return self.weighted(self.friction)


def point_arrays(points: Sequence[FrictionPoint]) -> Points:
    """Points as arrays, their standard errors drawn towards the median of their kind: pairs, or points of the model.

    An error from a dozen blocks is itself known to a fifth, and weights from such errors favour points with lucky ones.
    Half the median's variance takes most of that away (moderation of variances: Smyth, Stat. Appl. Genet. Mol. Biol. 3,
    2004). Points of the model hold its changes along a stroke: their median says nothing of pairs.
    """
    own = np.array([p.se_nm for p in points])
    friction = np.array([p.friction_nm for p in points])
    floor = max(1e-6 * float(np.max(np.abs(friction))), 1e-12)
    direction = np.array([p.direction for p in points], dtype=float)
    pair = direction == 0
    middle = np.where(pair, *(np.median(own[kind]) if kind.any() else 0.0 for kind in (pair, ~pair)))
    se = np.sqrt(0.5 * own**2 + 0.5 * middle**2)
    both = np.count_nonzero(direction > 0) >= 2 and np.count_nonzero(direction < 0) >= 2
    offset = direction if both and len(points) >= 6 else None
    speed = np.array([p.speed_rad_s for p in points])
    timing = np.array([p.timing_nm for p in points])
    return Points(speed, friction, np.maximum(se, floor), offset, direction, timing)


@dataclass(frozen=True, slots=True)
class Quality:
    """Error scale and t quantile that turn unscaled variances into interva"""

    scale: float
    t: float

    @classmethod
    def of(cls, sum_squares: float, freedom: int, data: Points) -> Quality:
        """Errors are scaled up where the points scatter more than their standard errors say (Birge ratio).

        A few precise pairs are no better known for many rough points beside them: of the degrees of freedom, the
        quantile counts the share that Kish's effective number, (sum of weights)² / sum of squared weights, is of all.
        """
        weight = np.min(data.sd) ** 2 / data.sd**2
        effective = float(np.sum(weight) ** 2 / np.sum(weight**2)) / data.n
        return cls(max(1.0, sum_squares / freedom), float(student_quantile(max(1.0, effective * freedom), _LEVEL)))

    @property
    def allowance(self) -> float:
        """Rise of the sum of squares at the ends of an interval."""
        return self.scale * self.t**2

    def bounds(self, value: float, variance: float) -> Bounds:
        """Interval of a linear coefficient."""
        half = self.t * float(np.sqrt(self.scale * variance))
        return value - half, value + half


@dataclass(frozen=True, slots=True, eq=False)
class LinearFit:
    """Estimates (…, k), unscaled covariance (…, k, k) and weighted sum of squares (…,) of linear fits."""

    estimate: FloatArray
    covariance: FloatArray
    sum_squares: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Profile:
    """The separated fit along C.

    Attributes:
        c: (m,) grid of C, ascending, the best one among them.
        sum_squares: (m,) best sum of squares at each C.
        estimate: (m, k) A, B, D (and offset) at each C.
        covariance: (m, k, k) their unscaled covariance at each C.
        best: index of the minimum.
    """

    c: FloatArray
    sum_squares: FloatArray
    estimate: FloatArray
    covariance: FloatArray
    best: int


def solve(design: FloatArray, target: FloatArray | None = None) -> LinearFit:
    """Least squares by column-scaled QR decompositions of (…, n, k), of zeros for the covariance alone."""
    target = np.zeros(design.shape[-2]) if target is None else target
    scale = np.linalg.norm(design, axis=-2)
    scale[scale == 0] = 1.0
    q, r = np.linalg.qr(design / scale[..., None, :])
    inverse = np.asarray(np.linalg.inv(_solvable(r)), dtype=np.float64)
    projected = np.einsum("...nk,n->...k", q, target)
    estimate = np.einsum("...ij,...j->...i", inverse, projected) / scale
    rest = target - np.einsum("...nk,...k->...n", design, estimate)
    with np.errstate(over="ignore"):  # of a column that is all but gone, the coefficient may be anything
        covariance = inverse @ np.swapaxes(inverse, -1, -2) / (scale[..., :, None] * scale[..., None, :])
    return LinearFit(estimate, np.clip(covariance, -_UNBOUNDED, _UNBOUNDED), np.asarray(np.sum(rest**2, axis=-1)))


def fit_at(points: Points, law: SeparableLaw, c: float) -> LinearFit:
    """The linear coefficients of a law (and the offset) at a fixed C."""
    return solve(points.design(law, c), points.target)


def search_range(points: Points) -> tuple[float, float]:
    """C from where the exponential is straight over all speeds to where it is gone at the slowest."""
    return 0.03 / float(points.speed.max()), 12.0 / float(points.speed.min())


def profile(points: Points, law: SeparableLaw) -> Profile:
    """Fit the linear coefficients along a logarithmic grid of C, dense around the best.

    A well determined C has an interval far narrower than one step of the coarse grid, and every interval
    is taken from this profile: the dense part spans about four standard errors to either side.
    """
    low, high = search_range(points)
    best = best_rate(points, law)
    near = _near(points, law, best, low, high)
    grid = np.unique(np.concatenate([np.geomspace(low, high, _COARSE), near, [best]]))
    along = solve(points.design(law, grid[:, None]), points.target)
    return Profile(grid, along.sum_squares, along.estimate, along.covariance, int(np.argmin(along.sum_squares)))


def best_rate(points: Points, law: SeparableLaw) -> float:
    """The C of least squares, to 1e-5 of itself: a grid, a finer one about its minimum, and there a parabola."""
    coarse = np.geomspace(*search_range(points), _COARSE)
    k = int(np.argmin(sums_along(points, law, coarse)))
    fine = np.geomspace(coarse[max(k - 1, 0)], coarse[min(k + 1, _COARSE - 1)], _FINE)
    sums = sums_along(points, law, fine)
    k = int(np.argmin(sums))
    if not 0 < k < _FINE - 1:
        return float(fine[k])
    beyond = float(parabola_minimum(*(sums[k - 1 : k + 2] - sums[k])))
    return float(fine[k] * (fine[1] / fine[0]) ** beyond)


def sums_along(points: Points, law: SeparableLaw, rates: FloatArray) -> FloatArray:
    """(m,) sums of squares at (m,) rates: what the target adds to a triangle of the columns and itself."""
    design = points.design(law, rates[:, None])
    target = np.broadcast_to(points.target[:, None], (*design.shape[:2], 1))
    triangle = np.asarray(np.linalg.qr(np.concatenate([design, target], axis=2), mode="r"))
    return np.asarray(triangle[:, -1, -1] ** 2)


def _near(points: Points, law: SeparableLaw, best: float, low: float, high: float) -> FloatArray:
    """Dense grid about the best C, as wide as its standard error (linearised) asks."""
    fit = fit_at(points, law, best)
    jac = jacobian(points, law, fit.estimate, best)
    scale = max(1.0, float(fit.sum_squares) / max(1, points.n - jac.shape[1]))
    se = float(np.sqrt(scale * solve(jac).covariance[-1, -1]))
    if not np.isfinite(se) or se > best:
        return np.empty(0)
    reach = np.linspace(-_REACH, _REACH, _DENSE) * se
    return np.clip(best + reach, low, high)


def jacobian(points: Points, law: SeparableLaw, estimate: FloatArray, c: float) -> FloatArray:
    """(n, k + 1) weighted derivatives of the model by its linear coefficients (offset included), then by C."""
    step = 1e-5 * c
    up, down = points.design(law, c + step) @ estimate, points.design(law, c - step) @ estimate
    by_rate = (up - down) / (2.0 * step)
    return np.column_stack([points.design(law, c), by_rate])


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


def interval_of_linear(prof: Profile, weights: FloatArray, allowance: float) -> tuple[float, float]:
    """Profile interval of a combination of linear coefficients: every value some C reaches within ``allowance``.

    At a fixed C the sum of squares rises by (x - x̂(C))² / V(C); the interval is the union over C.

    Args:
        prof: the profile.
        weights: (k,) of the combination; one 1 and zeros for a single coefficient.
        allowance: rise of the sum of squares that is allowed.
    """
    spare = prof.sum_squares[prof.best] + allowance - prof.sum_squares
    inside = spare >= 0
    variance = np.einsum("i,mij,j->m", weights, prof.covariance[inside], weights)
    half = np.sqrt(spare[inside] * variance)
    centre = prof.estimate[inside] @ weights
    return float(np.min(centre - half)), float(np.max(centre + half))


def _solvable(r: FloatArray) -> FloatArray:
    """(…, k, k) triangles in which a column gone in rounding is kept, its variance then beyond all bounds."""
    index = np.arange(r.shape[-1])
    diagonal = r[..., index, index]
    r[..., index, index] = np.where(np.abs(diagonal) < _FLAT, _FLAT, diagonal)
    return r
