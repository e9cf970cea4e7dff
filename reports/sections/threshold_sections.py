"""Thresholds that one log supports, beside those in force."""

from __future__ import annotations

from collaudit.core.data.audit_result import AuditResult, RecommendedRule
from collaudit.reports.sections.section import Section
from collaudit.reports.values.joint_lines import joint_lines
from collaudit.reports.values.numbers import apart, duration, rate, significant
from collaudit.reports.values.words import NONE, torque_unit


def threshold_evidence(result: AuditResult) -> Section:
    """γ in force and recommended of each joint, with the evidence, and what is missing."""
    rows = tuple(_row(joint, rule, result) for joint, rule in result.recommended.items())
    head = (
        "joint",
        "γ in force",
        "recommended γ",
        "largest clean level",
        "margin over it",
        "clean time",
        "false alarms, extrapolated",
        "from observed time",
    )
    missing = [(joint, text) for joint, rule in result.recommended.items() for text in rule.missing]
    lines = (f"Missing: {line}" for line in joint_lines(missing, len(result.recommended)))
    title = f"γ in force and recommended, at n = {result.rule.n}"
    if all(rule.gamma_nm is None for rule in result.recommended.values()):
        in_force = [(row[0], f"γ {row[1]} in force; clean time {row[5]}") for row in rows]
        notes = (*joint_lines(in_force, len(rows)), *lines)
        return Section("None recommended: this log has too little evidence", (), (), notes)
    return Section(title, head, rows, tuple(lines))


def _row(joint: str, rule: RecommendedRule, result: AuditResult) -> tuple[str, ...]:
    unit, used = torque_unit(result, joint), result.rule.gamma_nm.get(joint)
    texts = apart([used, rule.gamma_nm, rule.largest_clean_nm])
    values = zip((used, rule.gamma_nm, rule.largest_clean_nm), texts, strict=True)
    expected, upper = rule.false_alarms_per_hour, rule.false_alarms_per_hour_upper95
    return (
        joint,
        *(NONE if value is None else f"{text} {unit}" for value, text in values),
        NONE if rule.margin is None else f"× {significant(rule.margin)}",
        duration(3600 * rule.clean_hours),
        NONE if expected is None else rate(expected, rule.clean_hours),
        NONE if upper is None else f"≤ {significant(upper)} /h",
    )
