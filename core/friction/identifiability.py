"""Identifiability of a fit: scaled singular values, correlations, open sides, and the motion that would help."""

from __future__ import annotations

from itertools import combinations

import numpy as np

from collaudit.core.data.friction_result import Bounds, Identifiability, OpenSide
from collaudit.core.friction import least_squares as ls
from collaudit.core.friction.law_candidates import Candidate, FrictionUnits
from collaudit.core.numeric.arrays import FloatArray

_ROUNDING = 1e-12


def identifiability(
    data: ls.Points, fitted: Candidate, richer: Candidate | None, units: FrictionUnits
) -> Identifiability:
    """What the points determine.

    Args:
        data: the points.
        fitted: the law that was taken.
        richer: the reference law where that one could not be determined, for the motion that would settle it.
        units: names of the parameters.
    """

    def key(symbol: str) -> str:
        return units.key(fitted.law, symbol)

    values = _singular_values(fitted.jacobian)
    smallest = values[-1] if values else 0.0
    correlations, covariance = {}, fitted.covariance
    for (a, first), (b, second) in combinations(enumerate(fitted.values), 2):
        if covariance is not None and covariance[a, a] > 0 and covariance[b, b] > 0:
            share = covariance[a, b] / np.sqrt(covariance[a, a] * covariance[b, b])
            correlations[f"{key(first)} ~ {key(second)}"] = float(np.clip(share, -1.0, 1.0))
    asked = richer if richer is not None else fitted
    return Identifiability(
        singular_values=values,
        condition=float(values[0] / smallest) if smallest > _ROUNDING else None,
        correlations=correlations,
        at_bounds=tuple(key(s) for s in fitted.at_bounds),
        open_sides={key(s): side for s, b in fitted.ci95.items() if (side := _open(b)) is not None},
        motion_needed=_motion(data, asked, units) if asked.reasons else (),
    )


def _singular_values(jacobian: FloatArray | None) -> tuple[float, ...]:
    if jacobian is None:
        return ()
    scale = np.linalg.norm(jacobian, axis=0)
    scaled = jacobian / np.where(scale > 0, scale, 1.0)
    return tuple(float(x) for x in np.linalg.svd(scaled, compute_uv=False))


def _open(bounds: Bounds | None) -> OpenSide | None:
    low, high = bounds or (None, None)
    if low is None and high is None:
        return "both"
    return "low" if low is None else "high" if high is None else None


def _motion(data: ls.Points, asked: Candidate, units: FrictionUnits) -> tuple[str, ...]:
    """Speeds that would close an open side of the rate, each in both directions."""
    low, high = asked.c_interval
    slowest, fastest = float(data.speed.min()), float(data.speed.max())
    needed = []
    if high is None:
        speed = 0.5 * slowest if low is None else min(0.5 * slowest, 1.0 / low)
        needed.append(f"speeds below {speed:.2g} {units.speed} in both directions")
    if low is None:
        speed = 2.0 * fastest if high is None else max(2.0 * fastest, 1.0 / high)
        needed.append(f"speeds above {speed:.2g} {units.speed} in both directions")
    if not needed:
        needed.append(
            f"more passes in both directions at speeds between {slowest:.2g} and {min(fastest, 4 * slowest):.2g} "
            f"{units.speed}"
        )
    return tuple(needed)
