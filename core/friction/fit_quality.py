"""How far the scatter of friction points widens their errors, and how a level turns into an interval."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import scipy
from scipy.special import stdtrit as student_quantile

from collaudit.core.data.friction_result import Bounds, FrictionPoint
from collaudit.core.friction import least_squares as ls
from collaudit.core.friction_laws.friction_law import SeparableLaw
from collaudit.core.friction_laws.law_registry import LAWS, LINE

_LEVEL = 0.975


@dataclass(frozen=True, slots=True)
class Quality:
    """Error scale and t quantile that turn unscaled variances into intervals."""

    scale: float
    t: float

    @classmethod
    def of(cls, sum_squares: float, freedom: int, data: ls.Points) -> Quality:
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


def point_arrays(points: list[FrictionPoint] | tuple[FrictionPoint, ...]) -> ls.Points:
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
    return ls.Points(speed, friction, np.maximum(se, floor), offset, direction, timing)


def with_scatter(points: ls.Points) -> ls.Points:
    """Add a common variance to all points where they scatter more than their standard errors say.

    The variance is the one that brings chi-square down to its degrees of freedom (Paule and Mandel, J. Res.
    Natl. Bur. Stand. 87, 1982), so that a point with a lucky small error cannot pull the curve to itself. Points that
    rely on the robot model have a variance of their own beside pairs: an error of the model, or a drift of the
    effort's zero, is in them and not in pairs.
    """
    pair = np.asarray(points.direction == 0)
    variance = np.zeros(points.n)
    pairs = points.take(np.asarray(np.flatnonzero(pair), dtype=np.int64))
    if pairs.n < points.n and _flexible(pairs):
        variance[pair], law = _common_variance(pairs)
        rest = points.take(np.asarray(np.flatnonzero(~pair), dtype=np.int64))
        settled = replace(pairs, sd=np.sqrt(pairs.sd**2 + variance[pair]))
        variance[~pair] = _variance_needed_beyond(settled, rest, law)
    else:
        variance[:], _ = _common_variance(points)
    return replace(points, sd=np.sqrt(points.sd**2 + variance))


def _common_variance(data: ls.Points) -> tuple[float, SeparableLaw]:
    """The variance that the points need about the law that needs least, and that law."""
    laws = _flexible(data) or [LINE]
    most = float(np.var(data.friction)) + float(np.max(data.sd)) ** 2
    needed = [_variance_needed(_excess(data, law), most) for law in laws]
    return min(needed), laws[int(np.argmin(needed))]


def _variance_needed_beyond(pairs: ls.Points, rest: ls.Points, law: SeparableLaw) -> float:
    """Variance that points resting on the model need about the curve of the pairs, an offset aside where they show one.

    They are not weighed together with the pairs: many good pairs would leave room for a model point far off the curve.
    """
    c = ls.best_rate(pairs, law) if law.rate is not None else 0.0
    k = len(law.symbols) - (law.rate is not None)
    columns = np.stack(law.shape(rest.speed, c), axis=-1)
    left = rest.friction - columns @ ls.fit_at(pairs, law, c).estimate[:k]
    freedom = rest.n - (rest.offset is not None)

    def excess(variance: float) -> float:
        weight = 1.0 / (rest.sd**2 + variance)
        mean = 0.0 if rest.offset is None else float(np.sum(weight * left * rest.offset) / np.sum(weight))
        return float(np.sum(weight * (left - mean * rest.direction) ** 2)) - freedom

    return _variance_needed(excess, rest.n * float(np.max(left**2)) + 1e-12)


def _flexible(data: ls.Points) -> list[SeparableLaw]:
    """The laws that the points could carry, as yardsticks of their scatter: the one that fits best counts.

    All that can bend more than the line, the freest first (of equal ones the first listed counts).
    """
    freer = [law for law in LAWS.values() if isinstance(law, SeparableLaw) and len(law.symbols) > len(LINE.symbols)]
    return [law for law in sorted(freer, key=lambda law: -len(law.symbols)) if data.n > _free(data, law)]


def _free(data: ls.Points, law: SeparableLaw) -> int:
    return len(law.symbols) + (data.offset is not None)


def _excess(data: ls.Points, law: SeparableLaw) -> Callable[[float], float]:
    """By what share of itself chi-square of a law exceeds its degrees of freedom, by the common variance.

    It falls, and along a straight line where all points have one standard deviation.
    """
    c = ls.best_rate(data, law) if law.rate is not None else 0.0
    columns, freedom = data.raw(law, c), max(1, data.n - _free(data, law))

    def excess(variance: float) -> float:
        weighed = replace(data, sd=np.sqrt(data.sd**2 + variance))
        return 1.0 - freedom / max(float(ls.solve(weighed.weighted(columns), weighed.target).sum_squares), 1e-300)

    return excess


def _variance_needed(excess: Callable[[float], float], top: float) -> float:
    """Common variance that brings chi-square down to its degrees of freedom; 0 where it is there already."""
    if excess(0.0) <= 0:
        return 0.0
    if excess(top) >= 0:
        return top
    return float(scipy.optimize.brentq(excess, 0.0, top, xtol=1e-12 * top, rtol=1e-6))
