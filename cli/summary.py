"""Verdicts as exit codes, and the rule as it was applied."""

from __future__ import annotations

from typing import TYPE_CHECKING

from collaudit.core.errors import EXIT_FAIL, EXIT_NOT_JUDGED, EXIT_PASS

if TYPE_CHECKING:
    from collections.abc import Sequence

    from collaudit.core.data.audit_result import RuleFacts, Verdict


def exit_code(verdicts: Sequence[Verdict]) -> int:
    """The contracted exit code: a broken policy wins over what could not be judged."""
    if "fail" in verdicts:
        return EXIT_FAIL
    return EXIT_NOT_JUDGED if "not_judged" in verdicts or not verdicts else EXIT_PASS


def rule_text(rule: RuleFacts) -> str:
    """Rule (6) as applied, its persistence in whole samples."""
    gamma = ", ".join(f"{name} {value:g}" for name, value in rule.gamma_nm.items() if name in rule.watch)
    asked = "" if rule.persistence_requested_ms is None else f" (asked: {rule.persistence_requested_ms:g} ms)"
    return (
        f"rule: {rule.detector}, n = {rule.n} samples = {1e3 * rule.persistence_s:g} ms{asked}, "
        f"gamma in N·m: {gamma or 'no joint is watched'}"
    )
