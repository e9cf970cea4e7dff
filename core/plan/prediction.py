"""What a planned motion should tell, half widths and clean hours, before and after; and what a fit then delivered."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import log

import numpy as np

from collaudit.core.data.audit_result import Audit, FrictionFile
from collaudit.core.data.friction_result import FrictionFit
from collaudit.core.data.plan_result import CleanTime, Delivered, Outcome, PlanFile, Prediction
from collaudit.core.data.recommendation_result import ThresholdLevel
from collaudit.core.detection.fitted_rule import typed
from collaudit.core.errors import ConfigError
from collaudit.core.friction.law_candidates import parameter_symbol
from collaudit.core.numeric.null_tail import ZERO_DOUBT_NM, margin_after
from collaudit.core.plan.excitation import Excitation, Unknowns, half_width, reported_half_widths
from collaudit.core.plan.moves import ArmLimits
from collaudit.core.plan.sweeps import JointSweeps
from collaudit.core.recommend.arm_evidence import gather_evidence
from collaudit.core.recommend.joint_thresholds import recommend_joints

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
    enough = -log(0.05) / per_hour
    known = _told(audits) if audits else {}
    hours = {name: one.hours for name, one in known.items()} if audits else _fitted_hours(friction)
    out = {}
    for name in names:
        one, there = known.get(name), hours.get(name, 0.0)
        if one is None or one.level is None:
            out[name] = CleanTime(there, enough, None, None, None)
            continue
        needed = None if gamma_nm is None else one.hours_for(gamma_nm)
        out[name] = CleanTime(there, enough, one.gamma(there), one.gamma(there + more_h), needed)
    return out


_STEPS, _MOST_H = 48, 1000.0  # hours that are looked at, from those at hand on


@dataclass(frozen=True, slots=True)
class _Told:
    """What the runs tell of one joint: clean hours, its motion's level, and how many times that gamma is."""

    hours: float
    level: ThresholdLevel | None
    times: float

    def gamma(self, hours: float) -> float:
        """The threshold if so many hours had shown the same, N·m: the margin shrinks."""
        assert self.level is not None
        bare = (self.level.gamma_nm - ZERO_DOUBT_NM) / self.level.margin
        margin = self.level.margin if hours <= self.hours else margin_after(3600.0 * hours)
        return typed(self.times * typed(ZERO_DOUBT_NM + bare * min(margin, self.level.margin)))

    def hours_for(self, gamma_nm: float) -> float | None:
        """The fewest hours, at hand or more, whose threshold is no higher; None where none of them is enough."""
        every = np.geomspace(max(self.hours, 1e-3), _MOST_H, _STEPS)
        return next((float(hours) for hours in every if self.gamma(float(hours)) <= gamma_nm), None)


def _told(audits: Sequence[Audit]) -> dict[str, _Told]:
    evidence = gather_evidence(audits)
    persistence = max(audit.result.rule.persistence_s for audit in audits)
    judged = [(audit.result.rule, audit.result.sensitivity) for audit in audits]
    rules, found = recommend_joints(evidence, persistence, judged)
    return {
        joint: _Told(one.peaks.hours, one.level, (rules[joint].gamma_nm or 0.0) / (rules[joint].motion_nm or 1.0))
        for joint, one in found.items()
    }


def _fitted_hours(friction: FrictionFile | None) -> Mapping[str, float]:
    return {} if friction is None or friction.thresholds is None else {
        name: joint.hours for name, joint in friction.thresholds.joints.items()
    }  # fmt: skip
