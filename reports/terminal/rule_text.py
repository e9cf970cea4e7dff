"""The rule as it was applied, in a line for a terminal."""

from __future__ import annotations

from collections.abc import Mapping

from collaudit.core.data.audit_result import AuditResult, RuleFacts
from collaudit.reports.values.words import plural, torque_unit


def rule_text(result: AuditResult) -> str:
    """Detector, persistence in samples, and thresholds in their units; joints that share one are said together."""
    rule = result.rule
    asked = "" if rule.persistence_requested_ms is None else f" (asked: {rule.persistence_requested_ms:g} ms)"
    units = {joint: torque_unit(result, joint) for joint in rule.gamma_nm if joint in rule.watch}
    alike = len(set(units.values())) <= 1
    heading = f"gamma in {next(iter(units.values()), 'N·m')}" if alike else "gamma"
    return (
        f"rule: {rule.detector}, n = {plural(rule.n, 'sample')} = {1e3 * rule.persistence_s:.4g} ms{asked}, "
        f"{heading}: {_thresholds(rule, {} if alike else units)}"
    )


def _thresholds(rule: RuleFacts, units: Mapping[str, str]) -> str:
    """Thresholds by joint, with their units where these differ."""
    watched = {name: value for name, value in rule.gamma_nm.items() if name in rule.watch}
    if not watched:
        return "no joint is watched"
    if len(watched) > 1 and not units and len(set(watched.values())) == 1:
        return f"all {len(watched)} watched joints {next(iter(watched.values())):g}"
    shared: dict[str, list[str]] = {}
    for name, value in watched.items():
        shared.setdefault(f"{value:g} {units.get(name, '')}".rstrip(), []).append(name)
    return "; ".join(f"{', '.join(names)} {value}" for value, names in shared.items())
