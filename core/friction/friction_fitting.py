"""Fitting a joint's friction model, and deciding how much of it the data determine."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from collaudit.core.data.friction_result import (
    FrictionFit,
    FrictionPoint,
    KnownCombination,
    ModelComparison,
)
from collaudit.core.friction import least_squares as ls
from collaudit.core.friction.law_candidates import Candidate, FrictionUnits, fit_linear_law, fit_rate_law, fit_ridge_law
from collaudit.core.friction.law_comparison import choose, compare, with_scatter
from collaudit.core.friction.physical_law import drives, identifiability, physical, vanishes_unseen
from collaudit.core.friction_laws.friction_law import FrictionLaw, RidgeLaw, SeparableLaw
from collaudit.core.friction_laws.law_registry import LAWS, LINE, REFERENCE, law_named

_MIN_SPEED_RATIO = 1.5
_ONLY_A_CURVE = "The law is data-driven: only its curve means anything, which the page draws."


@dataclass(frozen=True, slots=True, eq=False)
class _Job:
    """Points of one joint on their way to a fit."""

    empty: FrictionFit
    data: ls.Points
    units: FrictionUnits
    bounded: bool


def fit_friction(
    points: Sequence[FrictionPoint],
    units: FrictionUnits,
    model: str = "auto",
) -> FrictionFit:
    """Fit a friction law to points.

    Args:
        points: (speed, friction) points of one joint.
        units: names and units of the parameters.
        model: name of a law, or ``auto``: the simplest that predicts speeds left out within one standard
            error of the best, and whose parameters the data determine.

    Returns:
        Parameters with 95 % intervals, or a fit without a model and the reason.

    Raises:
        CollauditError: there is no law of this name.
    """
    law = None if model == "auto" else law_named(model)
    empty = _empty(points, units)
    reason = _too_little(points, units)
    if reason is not None:
        return replace(empty, reason=reason)
    data = with_scatter(ls.point_arrays(points))
    inverted = drives(points)
    job = _Job(replace(empty, dissipates=not inverted), data, units, bounded=not inverted)
    fit = _automatic(job) if law is None else _insisted(job, law)
    return replace(fit, r_squared=_r_squared(fit, data))


def _insisted(job: _Job, law: FrictionLaw) -> FrictionFit:
    """The law that was asked for, whatever the data say of it."""
    found = "The model was chosen in the configuration." if law is LINE else _candidate(job, law)
    if isinstance(found, Candidate) and not found.refusal:
        return _law_fit(job, found)
    reason = found if isinstance(found, str) else f"{law.name}: {found.refusal}."
    return _line(job, _fitted(job, LINE), (reason,), None)


def _automatic(job: _Job) -> FrictionFit:
    """Compare all laws; fall back to the straight line where nothing richer is determined."""
    line = _fitted(job, LINE)
    fitted: list[Candidate] = []
    refused: list[ModelComparison] = []
    for law in LAWS.values():
        found = line if law is LINE else _candidate(job, law)
        if isinstance(found, Candidate):
            fitted.append(replace(found, refusal=found.refusal or vanishes_unseen(found, job.data.speed)))
        else:
            refused.append(ModelComparison(law.name, None, None, None, None, None, None, False, found))
    taken, rows = choose(compare(job.data, fitted), [_eligible(c) for c in fitted])
    reference = next((c for c in fitted if c.law is REFERENCE), None)
    if taken is not None:
        chosen = fitted[taken]
    else:  # nothing could be held out: the reference where the F test proves it, else the line
        chosen = reference if reference is not None and _eligible(reference) else line
        why = "taken by the F test against Coulomb + viscous; too few speeds to leave any out"
        rows = [replace(r, chosen=True, note=why) if r.model == chosen.law.name else r for r in rows]
    if chosen.law is LINE:
        fit = _line(job, _with_shape(line, fitted, rows, job.data), _why_a_line(job, reference), reference)
    else:
        fit = _law_fit(job, chosen)
    return replace(fit, comparison=(*rows, *refused))


def _with_shape(
    line: Candidate, fitted: Sequence[Candidate], rows: Sequence[ModelComparison], data: ls.Points
) -> Candidate:
    """The straight line, its errors as large as what sets it apart from the laws that the points do not exclude.

    Each law counts by its Akaike weight (unconditional variance: Burnham and Anderson, Model Selection, 2002, 4.3).
    """
    known = [(c, row.aicc) for c, row in zip(fitted, rows, strict=True) if row.aicc is not None and not c.refusal]
    if line.covariance is None or not known:
        return line
    least = min(aicc for _, aicc in known)
    weight = np.array([np.exp(0.5 * (least - aicc)) for _, aicc in known])
    apart = weight @ [np.mean((c.predicted - line.predicted) ** 2) for c, _ in known] / weight.sum()
    columns = np.column_stack([np.ones(data.n), data.speed])
    own = np.mean(np.sum((columns @ line.covariance) * columns, axis=1))
    wider = float(np.sqrt(1.0 + apart / own)) if own > 0.0 else 1.0

    def widened(value: float, end: float | None) -> float | None:
        return None if end is None else value + wider * (end - value)

    ci95 = {
        symbol: None if ends is None else (widened(value, ends[0]), widened(value, ends[1]))
        for (symbol, ends), value in zip(line.ci95.items(), line.values.values(), strict=True)
    }
    return replace(line, ci95=ci95, covariance=wider**2 * line.covariance)


def _eligible(candidate: Candidate) -> bool:
    """Whether a law may be chosen: its parameters are determined."""
    return not candidate.reasons and not candidate.refusal


def _why_a_line(job: _Job, reference: Candidate | None) -> tuple[str, ...]:
    term = REFERENCE.rate
    assert term is not None
    if reference is None:
        free = len(REFERENCE.symbols) + 1 + (job.data.offset is not None)
        return (
            f"{job.data.n} points are too few to tell {term.noun} from a straight line (at least {free} are needed).",
        )
    if reference.reasons:
        return reference.reasons
    if reference.refusal:
        return (f"{reference.law.name}: {reference.refusal}; {' and '.join(term.unknown)} are not used.",)
    return (
        "Coulomb + viscous friction predicts the speeds left out of the fit within one standard error of the best "
        f"law: {' and '.join(term.unknown)} are not needed.",
    )


def _candidate(job: _Job, law: FrictionLaw) -> Candidate | str:
    """A fitted law, or why it cannot be fitted: one of parameters and offset needs a point more than it has of them."""
    data = job.data
    least = law.least_points if isinstance(law, RidgeLaw) else len(law.parameters) + (data.offset is not None) + 1
    if data.n < least:
        return f"{data.n} points are too few (at least {least} are needed)"
    return _fitted(job, law)


def _fitted(job: _Job, law: FrictionLaw) -> Candidate:
    """A law fitted to the job's points, within physical bounds unless what the points show is no friction."""

    def separable(law: SeparableLaw) -> Candidate:
        return fit_linear_law(job.data, law) if law.rate is None else fit_rate_law(job.data, law, law.rate, job.units)

    if isinstance(law, SeparableLaw):
        found = separable(law)
    else:
        assert isinstance(law, RidgeLaw)
        found = fit_ridge_law(job.data, law)
    return physical(found, job.data.speed, separable) if job.bounded else found


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
        return "it moves too little: no stretch of constant velocity, nor any other motion, gave a friction point"
    speeds = sorted(p.speed_rad_s for p in points)
    if len(points) < 3 or speeds[-1] < _MIN_SPEED_RATIO * speeds[0]:
        mean = float(np.mean([p.friction_nm for p in points]))
        return (
            f"{len(points)} point(s) between {speeds[0]:.3g} and {speeds[-1]:.3g} {units.speed} (friction about "
            f"{mean:.3g} {units.effort}): at least 3 points over speeds a factor {_MIN_SPEED_RATIO} apart are needed"
        )
    return None


def _line(job: _Job, line: Candidate, reasons: tuple[str, ...], reference: Candidate | None) -> FrictionFit:
    """Coulomb + viscous parameters, and what they mean for the reference law, eq. (11)."""
    assert REFERENCE.as_line is not None
    names = REFERENCE.as_line(reference.c_interval if reference is not None else (None, None))
    units = (job.units.effort, f"{job.units.effort}·s/{job.units.length}")
    known = tuple(
        KnownCombination(name, line.values[symbol], line.ci95[symbol] or (None, None), unit)
        for name, symbol, unit in zip(names, LINE.symbols, units, strict=True)
    )
    undetermined = reference if reference is not None and reference.reasons else None
    return replace(_assembled(job, line, undetermined), not_identifiable=reasons, known=known)


def _law_fit(job: _Job, found: Candidate) -> FrictionFit:
    """Any other law, with the reservations that go with it."""
    law = found.law
    notes = [*found.reasons, *([_ONLY_A_CURVE] if law.data_driven else [])]
    identifiable = not found.reasons and not law.data_driven
    return replace(_assembled(job, found, None), identifiable=identifiable, not_identifiable=tuple(notes))


def _assembled(job: _Job, found: Candidate, richer: Candidate | None) -> FrictionFit:
    covariance = None
    if found.covariance is not None:
        covariance = tuple(tuple(float(x) for x in row) for row in found.covariance)
    return replace(
        job.empty,
        model=found.law.name,
        parameters={job.units.key(found.law, s): v for s, v in found.values.items()},
        ci95={job.units.key(found.law, s): b for s, b in found.ci95.items()},
        covariance=covariance,
        rmse_nm=float(np.sqrt(np.mean((job.data.friction - found.predicted) ** 2))),
        identifiability=identifiability(job.data, found, richer, job.units),
        unphysical=found.beyond,
    )


def _r_squared(fit: FrictionFit, data: ls.Points) -> float | None:
    spread = float(np.mean((data.friction - data.friction.mean()) ** 2))
    if fit.rmse_nm is None or spread <= 0:
        return None
    return 1.0 - fit.rmse_nm**2 / spread
