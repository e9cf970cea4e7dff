"""What a planned motion should tell, half widths and clean hours, before and after; and what a fit then delivered."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import inf

import numpy as np

from collaudit.core.data.audit_result import Audit, FrictionFile
from collaudit.core.data.friction_result import FrictionFit
from collaudit.core.data.plan_result import CleanTime, Delivered, Outcome, PlanFile, Prediction
from collaudit.core.errors import ConfigError
from collaudit.core.friction.law_candidates import parameter_symbol
from collaudit.core.plan.excitation import Excitation, Unknowns, half_width, reported_half_widths
from collaudit.core.plan.limits import ArmLimits
from collaudit.core.plan.sweeps import JointSweeps
from collaudit.core.recommend.arm_evidence import gather_evidence
from collaudit.core.recommend.joint_thresholds import REACH, joint_evidence, threshold_with_hours
from collaudit.core.recommend.tail_fit import JointTail

#: Half widths within this factor of the prediction are as predicted.
FACTOR = 1.3
#: Of a joint, but predicted for a fit that estimates inertials too, beside which they are known less well.
_WITH_INERTIALS = ("rotor inertia", "gain")


def sweep_predictions(
    limits: ArmLimits, sweeps: Sequence[JointSweeps], friction: FrictionFile | None
) -> list[Prediction]:
    """Friction parameters of all swept joints, by the law that is asked for."""
    out = []
    for one in sweeps:
        joint = limits.joint_names[one.joint]
        fit = None if friction is None else friction.joints.get(joint)
        known = _half_widths(fit)
        settled = len(one.design.guesses) == 1
        middle = one.design.guesses[len(one.design.guesses) // 2]
        for symbol, half in one.half_widths().items():
            before, after = known.get(symbol) if settled else None, half if one.design.measured else None
            out.append(Prediction(joint, symbol, float(middle[symbol]), before, after, not settled))
    return out


def excitation_predictions(unknowns: Unknowns, found: Excitation, friction: FrictionFile | None) -> list[Prediction]:
    """Base parameters, rotor inertias, gains and load friction."""
    before = reported_half_widths(friction, unknowns.labels)
    after = unknowns.half_widths(found.information)
    measured = all(unknowns.measured)
    return [
        Prediction(None if kind == "base parameter" else name, name if kind == "base parameter" else kind, None, old,
                   float(new) if measured else None, False)
        for (kind, name), old, new in zip(unknowns.labels, before, after, strict=True)
    ]  # fmt: skip


def delivered(plan: PlanFile, friction: FrictionFile) -> tuple[Delivered, ...]:
    """What a fit on logs of the planned motion gave, beside what the plan predicted.

    Args:
        plan: the plan.
        friction: the fit.

    Raises:
        ConfigError: the plan is for another arm.
    """
    if not set(plan.limits) & set(friction.joints):
        raise ConfigError(
            "the plan is for another arm than the logs",
            where="--plan",
            found=", ".join(plan.limits),
            expected=f"some of {', '.join(friction.joints)}",
        )
    own = [p for p in plan.predictions if p.joint is None or p.joint in friction.joints]
    labels = [("base parameter", p.parameter) if p.joint is None else (p.parameter, p.joint) for p in own]
    other = reported_half_widths(friction, labels)
    exact = friction.identified is None or "inertials" not in friction.identified.estimate
    out = []
    for prediction, found in zip(own, other, strict=True):
        fit = friction.joints.get(prediction.joint or "")
        half = _half_widths(fit).get(prediction.parameter, found)
        apart = exact and (prediction.joint is None or prediction.parameter in _WITH_INERTIALS)
        after = _of_the_found(prediction, fit)
        outcome = "not estimated" if apart else _outcome(after, half)
        out.append(Delivered(prediction.joint, prediction.parameter, after, half, outcome))
    return tuple(out)


def _of_the_found(prediction: Prediction, fit: FrictionFit | None) -> float | None:
    """The predicted half width; of a parameter that was guessed the same share of what was found."""
    values = {} if fit is None else {parameter_symbol(key): value for key, value in fit.parameters.items()}
    found = values.get(prediction.parameter)
    if not prediction.guessed or prediction.after is None or not prediction.value or found is None:
        return prediction.after
    return prediction.after * abs(found / prediction.value)


def _outcome(predicted: float | None, found: float | None) -> Outcome:
    if predicted is None:
        return "not predicted"
    if found is None:
        return "not told"
    if found > FACTOR * predicted:
        return "worse"
    return "better" if found < predicted / FACTOR else "as predicted"


def _half_widths(fit: FrictionFit | None) -> dict[str, float]:
    """Half widths of closed intervals, by symbol; none without a fit."""
    halves = {} if fit is None else {parameter_symbol(key): half_width(bounds) for key, bounds in fit.ci95.items()}
    return {symbol: half for symbol, half in halves.items() if half is not None and np.isfinite(half)}


_STEPS = 48  # hours that are looked at, from those at hand to a hundred times those that support the rate


def clean_times(
    names: Sequence[str], audits: Sequence[Audit], friction: FrictionFile | None, per_hour: float, more_h: float,
    gamma_nm: float | None,
) -> dict[str, CleanTime]:  # fmt: skip
    """Clean hours of every joint.

    Args:
        names: joints.
        audits: judged logs, whose clean residuals tell thresholds.
        friction: of earlier logs; its clean time counts where there are no audits.
        per_hour: false alarms of the arm that are accepted.
        more_h: clean hours that the planned motion adds.
        gamma_nm: threshold asked for, N·m.
    """
    enough = 1.0 / (REACH * per_hour)
    tails, hours = _tails(audits) if audits else ({}, _fitted_hours(friction))
    out = {}
    for name in names:
        tail, known = tails.get(name), hours.get(name, 0.0)
        now, after = ((None, None) if tail is None else (
            threshold_with_hours(tail, per_hour, len(tails), tail.hours),
            threshold_with_hours(tail, per_hour, len(tails), tail.hours + more_h),
        ))  # fmt: skip
        needed = None if tail is None or gamma_nm is None else _hours_for(tail, per_hour, len(tails), gamma_nm)
        out[name] = CleanTime(known, enough, now, after, needed)
    return out


def _tails(audits: Sequence[Audit]) -> tuple[dict[str, JointTail], dict[str, float]]:
    evidence = gather_evidence(audits)
    persistence = max(audit.result.rule.persistence_s for audit in audits)
    found = {joint: joint_evidence(evidence, joint, persistence) for joint in evidence.joints}
    tails = {joint: one.tail for joint, one in found.items() if one.tail is not None}
    return tails, {joint: one.peaks.hours for joint, one in found.items()}


def _fitted_hours(friction: FrictionFile | None) -> Mapping[str, float]:
    return {} if friction is None or friction.thresholds is None else {
        name: joint.hours for name, joint in friction.thresholds.joints.items()
    }  # fmt: skip


def _hours_for(tail: JointTail, per_hour: float, joints: int, gamma_nm: float) -> float | None:
    """The fewest hours, at hand or more, whose threshold is no higher; None where none of them is enough."""
    most = max(100.0 / (REACH * per_hour), 2.0 * tail.hours)
    for hours in np.geomspace(tail.hours, most, _STEPS):
        if (threshold_with_hours(tail, per_hour, joints, float(hours)) or inf) <= gamma_nm:
            return float(hours)
    return None
