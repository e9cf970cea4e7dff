"""Rows of the tables that several report formats share: every value as text with its unit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar, assert_never

from collaudit.core.data.audit_result import AuditResult, Collision, JointCoverage, NearMiss, RecommendedRule, RuleFacts
from collaudit.core.data.friction_result import FrictionFit
from collaudit.core.findings import Finding
from collaudit.core.friction.law_candidates import parameter_symbol
from collaudit.reports.values.numbers import (
    against,
    apart,
    duration,
    fixed,
    interval,
    percent,
    rate,
    significant,
    time_decimals,
)
from collaudit.reports.values.words import parameter_meaning, parameter_unit, reason_text, torque_unit

NONE = "–"
E = TypeVar("E", Collision, NearMiss)

_SEVERITY_ORDER = {"error": 0, "warning": 1, "info": 2}


@dataclass(frozen=True, slots=True)
class CollisionRow:
    """One collision."""

    joint: str
    onset: str
    detected: str
    lasted: str
    peak: str
    gamma: str
    phase: str


@dataclass(frozen=True, slots=True)
class NearMissRow:
    """One near miss; ``closeness`` says how close to a collision it came."""

    joint: str
    kind: str
    onset: str
    lasted: str
    peak: str
    gamma: str
    closeness: str
    phase: str


@dataclass(frozen=True, slots=True)
class ResidualRow:
    """Level of one joint's residual over its judged samples; ``clean`` is the mean away from collisions.

    ``largest`` covers every alarm and near miss of the joint too, those beyond friction's range among them. ``above``
    names the values that exceed γ.
    """

    joint: str
    mean: str
    rms: str
    p99: str
    largest: str
    gamma: str
    judged: str
    clean: str
    clean_time: str
    above: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class CoverageRow:
    """How much of one joint was judged; ``reasons`` are (reason, time) not judged, longest first."""

    joint: str
    watched: bool
    why: str
    moving: str
    judged: str
    share: str
    standing: str
    reasons: tuple[tuple[str, str], ...]
    spans: tuple[tuple[str, str, str], ...]


@dataclass(frozen=True, slots=True)
class RuleRow:
    """Recommended threshold of one joint and its evidence."""

    joint: str
    gamma: str
    used: str
    n: str
    largest_clean: str
    margin: str
    clean: str
    false_alarms: str
    upper: str
    alternatives: str
    missing: tuple[str, ...]

    @property
    def in_force(self) -> str:
        """The threshold that is set, and the clean time behind it."""
        return f"{self.used} (clean time {self.clean})"


@dataclass(frozen=True, slots=True)
class ParameterRow:
    """One friction parameter."""

    symbol: str
    meaning: str
    value: str
    ci95: str
    unit: str


def in_time(events: Sequence[E]) -> list[E]:
    """Events in order of their onset."""
    return sorted(events, key=lambda event: (event.onset_s, event.joint))


def collision_row(event: Collision, result: AuditResult) -> CollisionRow:
    """A collision as text."""
    unit = torque_unit(result, event.joint)
    peak, gamma = against(event.peak_nm, event.gamma_nm)
    onset, detected = _times(result, event.onset_s, event.detected_s)
    return CollisionRow(
        joint=event.joint,
        onset=f"{onset} s",
        detected=f"{detected} s",
        lasted=_beside_persistence(event.duration_s, result.rule.persistence_s),
        peak=f"{peak} {unit}",
        gamma=f"{gamma} {unit}",
        phase=event.phase,
    )


def near_miss_row(event: NearMiss, result: AuditResult) -> NearMissRow:
    """A near miss as text."""
    unit = torque_unit(result, event.joint)
    peak, gamma = against(event.peak_nm, event.gamma_nm)
    return NearMissRow(
        joint=event.joint,
        kind=event.kind,
        onset=f"{_times(result, event.onset_s)[0]} s",
        lasted=_beside_persistence(event.duration_s, result.rule.persistence_s),
        peak=f"{peak} {unit}",
        gamma=f"{gamma} {unit}",
        closeness=_closeness(event, result.rule),
        phase=event.phase,
    )


def _closeness(event: NearMiss, rule: RuleFacts) -> str:
    """How close to an alarm a near miss came, in what its kind is told by."""
    match event.kind:
        case "amplitude":
            return f"{apart([100 * event.ratio, 100 * rule.near_miss_amplitude, 100.0])[0]} % of γ"
        case "persistence":
            return f"{round(event.ratio * rule.n)} of {rule.n} samples above γ"
        case "impulse":
            share, _ = apart([100 * event.ratio, 100 * rule.near_miss_impulse])
            return f"{share} % of the impulse of γ for {rule.n} samples"
        case _:
            assert_never(event.kind)


def residual_row(joint: str, result: AuditResult) -> ResidualRow:
    """A joint's residual level as text."""
    stats = result.residual[joint]
    gamma = result.rule.gamma_nm.get(joint)
    unit = torque_unit(result, joint)
    peaks = [abs(event.peak_nm) for event in result.collisions if event.joint == joint]
    peaks += [abs(event.peak_nm) for event in result.near_misses if event.joint == joint]
    largest_nm = max((x for x in (stats.max_abs_nm, *peaks) if x is not None), default=None)
    values = (stats.mean_abs_nm, stats.rms_nm, stats.p99_nm, largest_nm, gamma, stats.clean_mean_abs_nm)
    beside = [apart([value, gamma]) for value in values]
    limits = sorted((limit for _, limit in beside), key=len)  # the longest holds for every value
    shown = zip(values, (*(text for text, _ in beside[:4]), limits[-1], beside[5][0]), strict=True)
    mean, rms, p99, largest, limit, clean = (NONE if value is None else f"{text} {unit}" for value, text in shown)
    judged, clean_time = duration(stats.judged_s), duration(stats.clean_s)
    named = zip(("mean", "rms", "p99", "largest", "gamma", "clean"), values, strict=True)
    above = tuple(name for name, value in named if gamma is not None and (value or 0.0) > gamma)
    return ResidualRow(joint, mean, rms, p99, largest, limit, judged, clean, clean_time, above)


def coverage_row(joint: str, coverage: JointCoverage, result: AuditResult) -> CoverageRow:
    """A joint's coverage as text."""
    reasons = sorted(coverage.not_judged_s.items(), key=lambda item: (-item[1], item[0]))
    spans = sorted(coverage.spans, key=lambda span: (span.start_s, span.end_s))
    return CoverageRow(
        joint=joint,
        watched=coverage.watched,
        why=coverage.why,
        moving=duration(coverage.moving_s),
        judged=duration(coverage.judged_s),
        share=percent(coverage.judged_s / coverage.moving_s) if coverage.moving_s > 0 else NONE,
        standing=duration(coverage.standing_s),
        reasons=tuple((reason_text(code), duration(seconds)) for code, seconds in reasons if seconds > 0),
        spans=tuple(
            (_times(result, span.start_s)[0], _times(result, span.end_s)[0], reason_text(span.reason)) for span in spans
        ),
    )


def rule_row(joint: str, rule: RecommendedRule, result: AuditResult) -> RuleRow:
    """A recommendation as text."""
    unit = torque_unit(result, joint)
    used = result.rule.gamma_nm.get(joint)
    gamma_text, used_text, clean_text = apart([rule.gamma_nm, used, rule.largest_clean_nm])
    expected, upper = rule.false_alarms_per_hour, rule.false_alarms_per_hour_upper95
    others = [f"{significant(gamma)} (n = {n})" for n, gamma in falling(rule)]
    return RuleRow(
        joint=joint,
        gamma=NONE if rule.gamma_nm is None else f"{gamma_text} {unit}",
        used=NONE if used is None else f"{used_text} {unit}",
        n=str(rule.n),
        largest_clean=NONE if rule.largest_clean_nm is None else f"{clean_text} {unit}",
        margin=NONE if rule.margin is None else f"× {significant(rule.margin)}",
        clean=duration(3600 * rule.clean_hours),
        false_alarms=NONE if expected is None else rate(expected, rule.clean_hours),
        upper=NONE if upper is None else f"≤ {significant(upper)} /h",
        alternatives=", ".join(others) or NONE,
        missing=rule.missing,
    )


def falling(rule: RecommendedRule) -> list[tuple[int, float]]:
    """γ at other persistences, never rising with n.

    A run of more samples above γ holds one of fewer: what is high enough at some n is so at every larger n. Estimates
    of each n on its own may say otherwise by chance; the smaller γ is then valid at both.
    """
    known = [*rule.alternatives, *([(rule.n, rule.gamma_nm)] if rule.gamma_nm is not None else [])]
    return [(n, min(gamma for other, gamma in known if other <= n)) for n, _ in rule.alternatives]


def parameter_rows(fit: FrictionFit) -> list[ParameterRow]:
    """Parameters of a fit as text."""
    return [
        ParameterRow(
            symbol=parameter_symbol(name),
            meaning=parameter_meaning(fit.model, name),
            value=significant(value),
            ci95="none" if (bounds := fit.ci95.get(name)) is None else interval(*bounds),
            unit=parameter_unit(name),
        )
        for name, value in fit.parameters.items()
    ]


def worst_first(findings: Sequence[Finding]) -> list[Finding]:
    """Findings by severity, then in the order they were made."""
    return sorted(findings, key=lambda finding: _SEVERITY_ORDER[finding.severity])


def finding_place(finding: Finding, result: AuditResult) -> str:
    """When a finding holds, as text; empty when it has no time."""
    if finding.start_s is None:
        return ""
    if finding.end_s is None:
        return f"at {_times(result, finding.start_s)[0]} s"
    start, end = _times(result, finding.start_s, finding.end_s)
    return f"{start} to {end} s"


def _times(result: AuditResult, *seconds: float) -> tuple[str, ...]:
    decimals = time_decimals(result.log.sample_period_s)
    return tuple(fixed(value, decimals) for value in seconds)


def _beside_persistence(seconds: float, persistence_s: float) -> str:
    if seconds >= 1:
        return duration(seconds)
    return f"{apart([1e3 * seconds, 1e3 * persistence_s])[0]} ms"
