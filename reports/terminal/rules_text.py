"""Recommended rules for a terminal."""

from __future__ import annotations

from collections.abc import Mapping

from collaudit.core.data.audit_result import RecommendedRule
from collaudit.reports.terminal.text_table import table


def rules_text(rules: Mapping[str, RecommendedRule], width: int | None = None) -> str:
    """One line a joint, below them what evidence is missing; the table is cut to ``width``, None: any."""
    rows = [
        (
            joint,
            "none" if rule.gamma_nm is None else f"{rule.gamma_nm:g}",
            str(rule.n),
            "" if rule.largest_clean_nm is None else f"{rule.largest_clean_nm:.3g}",
            f"{rule.clean_hours:.3g}",
            "" if rule.false_alarms_per_hour is None else f"{rule.false_alarms_per_hour:.3g}",
            "" if rule.false_alarms_per_hour_upper95 is None else f"{rule.false_alarms_per_hour_upper95:.3g}",
        )
        for joint, rule in rules.items()
    ]
    head = (
        "joint",
        "gamma N·m",
        "n",
        "largest clean N·m",
        "clean hours",
        "alarms/h at most (95 %)",
        "from observed time only",
    )
    missing = [f"  {joint}: {text}" for joint, rule in rules.items() for text in rule.missing]
    return "\n".join([table(head, rows, range(1, len(head)), width).rstrip(), *missing]) + "\n"
