"""Limits of the policy beyond events: residual level, time observable, age of the fit, findings that break it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime

from collaudit.core.config.schema import PolicyConfig
from collaudit.core.data.audit_result import FrictionFile, ResidualStats
from collaudit.core.data.sensitivity_result import Sensitivity
from collaudit.core.findings import Finding, findings_named
from collaudit.core.verdict.coverage import seconds_text
from collaudit.core.verdict.noticed_words import place_text

_DAY_S = 86400.0


@dataclass(frozen=True, slots=True)
class LimitReasons:
    """Why limits are broken, and what about them cannot be told; sentences."""

    broken: tuple[str, ...] = ()
    unknown: tuple[str, ...] = ()


def further_limits(
    policy: PolicyConfig,
    residual: Mapping[str, ResidualStats],
    watch: Sequence[str],
    sensitivity: Sensitivity,
    units: Mapping[str, str],
    findings: Sequence[Finding],
    start: str | None,
    friction: FrictionFile | None,
) -> LimitReasons:
    """What the limits say of one log.

    Args:
        policy: the limits; those that are absent hold nothing.
        residual: level by joint.
        watch: judged joints.
        sensitivity: what would have alarmed, and for how long.
        units: of each joint's torque.
        findings: of the log.
        start: when it was recorded, ISO 8601, or None.
        friction: file that it was judged with; None: friction was fitted on the log itself.
    """
    broken, unknown = list[str](), list[str]()
    for joint in watch:
        limits = policy.max_residual_rms_nm
        limit = limits.get(joint) if isinstance(limits, dict) else limits
        stats = residual.get(joint)
        value = None if stats is None else stats.rms_nm
        if limit is not None and value is None:
            unknown.append(f"Joint '{joint}' has no judged residual to compare with {limit:g} N·m.")
        elif limit is not None and value is not None and value > limit:
            broken.append(f"Residual of joint '{joint}': {value:.3g} N·m RMS (policy: at most {limit:g}).")
    if policy.min_observable_s is not None:
        unknown += _too_short(sensitivity, units, policy.min_observable_s)
    if policy.max_fit_age_days is not None and friction is not None:
        days = _age_days(start, friction)
        text = f"Friction was fitted on logs recorded {days:.3g} days before this one" if days is not None else ""
        if days is None:
            lacking = "The log does" if start is None else "The logs that friction was fitted on do"
            unknown.append(f"Age of the friction fit is not known: {lacking} not say when it was recorded.")
        elif days > policy.max_fit_age_days:
            broken.append(f"{text} (policy: at most {policy.max_fit_age_days:g}).")
    broken += [f"Finding {one.code}: {one.text}" for one in findings_named(findings, policy.findings)]
    return LimitReasons(tuple(broken), tuple(unknown))


def _age_days(start: str | None, friction: FrictionFile) -> float | None:
    """Days from the newest log of a fit to the judged one; None where either has no date."""
    if start is None or friction.recorded is None:
        return None
    return (datetime.fromisoformat(start) - datetime.fromisoformat(friction.recorded[1])).total_seconds() / _DAY_S


def _too_short(sensitivity: Sensitivity, units: Mapping[str, str], limit: float) -> Iterator[str]:
    """What is asked to alarm and would have for too little time."""
    asked = [
        (f"{force.asked.force_n:.3g} N at {place_text(force)}", force.asked.noticed_s)
        for force in sensitivity.forces
        if force.asked is not None
    ]
    asked += [
        (f"{s.asked.torque_nm:.3g} {units.get(joint, 'N·m')} on joint '{joint}'", s.asked.noticed_s)
        for joint, s in sensitivity.joints.items()
        if s.asked is not None
    ]
    if not asked:
        yield "What would have alarmed is not known: neither a force nor a torque is asked for."
    for what, time_s in asked:
        if time_s < limit:
            yield f"{what} would have alarmed for {seconds_text(time_s)} (policy: at least {seconds_text(limit)})."
