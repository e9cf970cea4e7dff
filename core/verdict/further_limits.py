"""Limits of the policy beyond events: age of the fit, findings that break it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime

from collaudit.core.config.schema import PolicyConfig
from collaudit.core.data.audit_result import FrictionFile
from collaudit.core.findings import Finding, findings_named

_DAY_S = 86400.0


@dataclass(frozen=True, slots=True)
class LimitReasons:
    """Why limits are broken, and what about them cannot be told; sentences."""

    broken: tuple[str, ...] = ()
    unknown: tuple[str, ...] = ()


def further_limits(
    policy: PolicyConfig,
    findings: Sequence[Finding],
    start: str | None,
    friction: FrictionFile | None,
) -> LimitReasons:
    """What the limits say of one log.

    Args:
        policy: the limits; those that are absent hold nothing.
        findings: of the log.
        start: when it was recorded, ISO 8601, or None.
        friction: file that it was judged with; None: friction was fitted on the log itself.
    """
    broken, unknown = list[str](), list[str]()
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
