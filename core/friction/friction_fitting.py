"""Fitting a joint's friction model, and deciding how much of it the data determine."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import cast

import numpy as np

from collaudit.core.data.friction_result import (
    Bounds,
    FrictionFit,
    FrictionModelName,
    FrictionPoint,
    KnownCombination,
    ModelComparison,
)
from collaudit.core.friction import least_squares as ls
from collaudit.core.friction.fit_quality import point_arrays, robust_weights, with_scatter
from collaudit.core.friction.friction_laws import LAWS, RBF
from collaudit.core.friction.identifiability import identifiability
from collaudit.core.friction.law_candidates import Candidate, fit_linear_law, fit_rate_law, line_fit
from collaudit.core.friction.law_comparison import choose, compare
from collaudit.core.friction.parameter_units import FrictionUnits
from collaudit.core.friction.rbf_law import fit_rbf
from collaudit.core.numeric.arrays import FloatArray

_MIN_SPEED_RATIO = 1.5
_MIN_RBF_POINTS = 8
_MIN_A_SIDE = 5
#: Not compared: it is static LuGre under other names.
_SAME_CURVE = ("stribeck-tustin",)


@dataclass(frozen=True, slots=True, eq=False)
class _Job:
    """Points of one joint on their way to a fit."""

    empty: FrictionFit
    data: ls.Points
    units: FrictionUnits


def fit_friction(
    points: Sequence[FrictionPoint],
    units: FrictionUnits,
    model: str = "auto",
    robust: str = "none",
) -> FrictionFit:
    """Fit a friction law to points.

    Args:
        points: (speed, friction) points of one joint.
        units: names and units of the parameters.
        model: a law of :mod:`laws`, or ``auto``: the simplest that predicts speeds left out within one standard
            error of the best, and whose parameters the data determine.
        robust: ``none``, ``huber`` or ``bisquare``: what is done about outlying points.

    Returns:
        Parameters with 95 % intervals, or a fit without a model and the reason.
    """
    empty = replace(_empty(points, units), robust=robust)
    reason = _too_little(points, units) or _not_directional(points, model)
    if reason is not None:
        return replace(empty, reason=reason)
    raw = point_arrays(tuple(points))
    weight = robust_weights(raw, robust)
    kept = tuple(replace(p, weight=float(w)) for p, w in zip(points, weight, strict=True))
    data = with_scatter(raw, weight)
    job = _Job(replace(empty, points=kept), data, units)
    fit = _automatic(job) if model == "auto" else _insisted(job, model)
    return replace(fit, r_squared=_r_squared(fit, data))


def _insisted(job: _Job, model: str) -> FrictionFit:
    """The law that was asked for, whatever the data say of it."""
    if model == "coulomb-viscous":
        line = fit_linear_law(job.data, LAWS[model])
        return _line(job, line, ("The model was chosen in the configuration.",), None)
    found = _candidate(job, model)
    if isinstance(found, str):
        line = fit_linear_law(job.data, LAWS["coulomb-viscous"])
        return _line(job, line, (found,), None)
    return _law_fit(job, found)


def _automatic(job: _Job) -> FrictionFit:
    """Compare all laws; fall back to the straight line where nothing richer is determined."""
    line = fit_linear_law(job.data, LAWS["coulomb-viscous"])
    fitted: list[Candidate] = []
    refused: list[ModelComparison] = []
    for name in (*LAWS, RBF):
        if name in _SAME_CURVE:
            continue
        found = line if name == line.model else _candidate(job, name)
        if isinstance(found, Candidate):
            fitted.append(found)
        else:
            refused.append(ModelComparison(name, None, None, None, None, None, None, False, found))
    ridge = fit_rbf(job.data)[1] if any(c.model == RBF for c in fitted) else None
    taken, rows = choose(compare(job.data, fitted, ridge), [_eligible(c) for c in fitted])
    lugre = next((c for c in fitted if c.model == "static-lugre"), None)
    if taken is not None:
        chosen = fitted[taken]
    else:  # nothing could be held out: the exponential where the F test proves it, else the line
        chosen = lugre if lugre is not None and not lugre.reasons else line
        why = "taken by the F test against Coulomb + viscous; too few speeds to leave any out"
        rows = [replace(r, chosen=True, note=why) if r.model == chosen.model else r for r in rows]
    is_line = chosen.model == line.model
    fit = _line(job, line, _why_a_line(job, lugre), lugre) if is_line else _law_fit(job, chosen)
    return replace(fit, comparison=(*rows, *refused))


def _eligible(candidate: Candidate) -> bool:
    """Whether a law may be chosen: its parameters are determined, and it is not the plain line over again."""
    same_line = candidate.model == "damping-coulomb" and not candidate.at_bounds
    return not candidate.reasons and not same_line


def _why_a_line(job: _Job, lugre: Candidate | None) -> tuple[str, ...]:
    if lugre is None:
        free = 5 + (job.data.offset is not None)
        return (
            f"{job.data.n} points are too few to tell an exponential from a straight line "
            f"(at least {free} are needed).",
        )
    if lugre.reasons:
        return lugre.reasons
    return (
        "Coulomb + viscous friction predicts the speeds left out of the fit within one standard error of the best "
        "law: B and C are not needed.",
    )


def _candidate(job: _Job, name: str) -> Candidate | str:
    """A fitted law, or why it cannot be fitted."""
    data = job.data
    if name == RBF:
        if data.n < _MIN_RBF_POINTS:
            return f"{data.n} points are too few (at least {_MIN_RBF_POINTS} are needed)"
        return fit_rbf(data)[0]
    law = LAWS[name]
    if law.directional and (min(_sides(data.direction)) < _MIN_A_SIDE or np.any(data.direction == 0)):
        return f"pairs of directions average both; it needs {_MIN_A_SIDE} points of each direction and no pairs"
    free = len(law.symbols) + (data.offset is not None and not law.directional)
    if data.n < free + 1:
        return f"{data.n} points are too few (at least {free + 1} are needed)"
    return fit_rate_law(data, law, line_fit(data), job.units) if law.has_rate else fit_linear_law(data, law)


def _sides(direction: FloatArray) -> tuple[int, int]:
    return int(np.count_nonzero(direction > 0)), int(np.count_nonzero(direction < 0))


def _empty(points: Sequence[FrictionPoint], units: FrictionUnits) -> FrictionFit:
    speeds = [p.speed_rad_s for p in points]
    return FrictionFit(
        model=None,
        parameters={},
        ci95={},
        covariance=None,
        identifiable=False,
        not_identifiable=(),
        known=(),
        n_points=len(points),
        n_pairs=sum(p.source == "pair" for p in points),
        speed_range_rad_s=(min(speeds), max(speeds)) if speeds else None,
        rmse_nm=None,
        effort_unit=units.effort,
        points=tuple(points),
    )


def _too_little(points: Sequence[FrictionPoint], units: FrictionUnits) -> str | None:
    """Why these points cannot carry even Coulomb-viscous friction, or None."""
    if not points:
        return "no constant-velocity section of this joint gave a friction point"
    speeds = sorted(p.speed_rad_s for p in points)
    if len(points) < 3 or speeds[-1] < _MIN_SPEED_RATIO * speeds[0]:
        mean = float(np.mean([p.friction_nm for p in points]))
        return (
            f"{len(points)} point(s) between {speeds[0]:.3g} and {speeds[-1]:.3g} {units.speed} (friction about "
            f"{mean:.3g} {units.effort}): at least 3 points over speeds a factor {_MIN_SPEED_RATIO} apart are needed"
        )
    return None


def _not_directional(points: Sequence[FrictionPoint], model: str) -> str | None:
    """Why a law with parameters of its own for each direction cannot be fitted, or None."""
    if model not in LAWS or not LAWS[model].directional:
        return None
    ahead, back = _sides(np.array([p.direction for p in points]))
    if min(ahead, back) >= _MIN_A_SIDE and ahead + back == len(points):
        return None
    return (
        f"{model} needs at least {_MIN_A_SIDE} points of each direction that rest on a model's torque; there are "
        f"{ahead} forward and {back} backward"
    )


def _line(job: _Job, line: Candidate, reasons: tuple[str, ...], lugre: Candidate | None) -> FrictionFit:
    """Coulomb + viscous parameters, and what they mean for eq. (11)."""
    names = _combinations(lugre.c_interval if lugre is not None else (None, None))
    units = (job.units.effort, job.units.viscous)
    known = tuple(
        KnownCombination(name, line.values[symbol], line.ci95[symbol] or (None, None), unit)
        for name, symbol, unit in zip(names, ("A", "D"), units, strict=True)
    )
    open_lugre = lugre if lugre is not None and lugre.reasons else None
    return replace(_assembled(job, line, open_lugre), not_identifiable=reasons, known=known)


def _combinations(c_interval: Bounds) -> tuple[str, str]:
    """What the level and the slope of a straight line mean for eq. (11), by which side of C is open.

    A slowly falling exponential is part of the line (A + B, D - B·C); one that is gone is not (A, D).
    """
    if c_interval[0] is None and c_interval[1] is not None:
        return "A + B", "D - B·C"
    if c_interval[0] is not None and c_interval[1] is None:
        return "A (A + B if C is small)", "D (D - B·C if C is small)"
    return "A + B (A alone if C is large)", "D - B·C (D alone if C is large)"


def _law_fit(job: _Job, found: Candidate) -> FrictionFit:
    """Any other law, with the reservations that go with it."""
    notes = list(found.reasons)
    identifiable = not found.reasons and found.model not in (RBF, "damping-coulomb")
    if found.model == "static-lugre" and identifiable:
        bounds = found.ci95["B"]
        if bounds is not None and (bounds[1] or 0.0) < 0:
            notes.append(
                "B is negative: friction rises towards a level instead of falling from breakaway; "
                "A is not a Coulomb level."
            )
    if found.model == "asymmetric-coulomb-viscous":
        notes.append(
            "A constant error of the model's torque or of the effort's zero raises Ap and lowers Am by as much: "
            "only their mean is free of it."
        )
    if found.model == RBF:
        notes.append("The weights of a data-driven law are held small on purpose: only the curve means anything.")
    if found.at_bounds and found.model == "damping-coulomb":
        notes.append(f"{' and '.join(found.at_bounds)} would be negative; held at zero.")
    return replace(_assembled(job, found, None), identifiable=identifiable, not_identifiable=tuple(notes))


def _assembled(job: _Job, found: Candidate, richer: Candidate | None) -> FrictionFit:
    key = job.units.key
    covariance = None
    if found.covariance is not None:
        covariance = tuple(tuple(float(x) for x in row) for row in found.covariance)
    return replace(
        job.empty,
        model=cast("FrictionModelName", found.model),
        parameters={key(s): v for s, v in found.values.items()},
        ci95={key(s): b for s, b in found.ci95.items()},
        covariance=covariance,
        rmse_nm=float(np.sqrt(np.mean((job.data.friction - found.predicted) ** 2))),
        identifiability=identifiability(job.data, found, richer, job.units),
    )


def _r_squared(fit: FrictionFit, data: ls.Points) -> float | None:
    spread = float(np.mean((data.friction - data.friction.mean()) ** 2))
    if fit.rmse_nm is None or spread <= 0:
        return None
    return 1.0 - fit.rmse_nm**2 / spread
