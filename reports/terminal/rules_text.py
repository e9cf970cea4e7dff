"""Recommended rules for a terminal."""

from __future__ import annotations

from collections.abc import Mapping

from collaudit.core.data.audit_result import RecommendedRule
from collaudit.reports.terminal.text_table import table, wrapped
from collaudit.reports.values.joint_lines import joint_lines
from collaudit.reports.values.numbers import duration, rate


def rules_text(rules: Mapping[str, RecommendedRule], width: int | None = None) -> str:
    """One line a joint, below them what evidence is missing; the table is cut to ``width``, None: any."""
    rows = [
        (
            joint,
            "none" if rule.gamma_nm is None else f"{rule.gamma_nm:g}",
            str(rule.n),
            "" if rule.largest_clean_nm is None else f"{rule.largest_clean_nm:.3g}",
            duration(3600 * rule.clean_hours),
            "" if rule.false_alarms_per_hour is None else rate(rule.false_alarms_per_hour, rule.clean_hours),
            "" if rule.false_alarms_per_hour_upper95 is None else f"{rule.false_alarms_per_hour_upper95:.3g} /h",
        )
        for joint, rule in rules.items()
    ]
    head = (
        "joint",
        "gamma N·m",
        "n",
        "largest clean N·m",
        "clean time",
        "false alarms at most (95 %)",
        "from observed time only",
    )
    said = [(joint, text) for joint, rule in rules.items() for text in rule.missing]
    missing = [wrapped(f"  {line}", width, "    ") for line in joint_lines(said, len(rules))]
    return "\n".join([table(head, rows, range(1, len(head)), width).rstrip(), *missing]) + "\n"
