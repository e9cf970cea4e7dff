"""The rule as it was applied, in a line for a terminal."""

from __future__ import annotations

from collaudit.core.data.audit_result import RuleFacts
from collaudit.reports.values.words import plural


def rule_text(rule: RuleFacts) -> str:
    """Detector, persistence in whole samples, and thresholds; joints that share one are said together."""
    asked = "" if rule.persistence_requested_ms is None else f" (asked: {rule.persistence_requested_ms:g} ms)"
    return (
        f"rule: {rule.detector}, n = {plural(rule.n, 'sample')} = {1e3 * rule.persistence_s:.4g} ms{asked}, "
        f"gamma in N·m: {_thresholds(rule)}"
    )


def _thresholds(rule: RuleFacts) -> str:
    watched = {name: value for name, value in rule.gamma_nm.items() if name in rule.watch}
    if not watched:
        return "no joint is watched"
    if len(watched) > 1 and len(set(watched.values())) == 1:
        return f"all {len(watched)} watched joints {next(iter(watched.values())):g}"
    return ", ".join(f"{name} {value:g}" for name, value in watched.items())
