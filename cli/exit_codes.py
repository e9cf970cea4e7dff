"""Verdicts as exit codes, and what keeps a log from being judged."""

from __future__ import annotations

from collections.abc import Sequence

from collaudit.core.data.audit_result import Verdict
from collaudit.core.errors import EXIT_FAIL, EXIT_NOT_JUDGED, EXIT_PASS
from collaudit.core.findings import Finding


def exit_code(verdicts: Sequence[Verdict]) -> int:
    """The contracted exit code: a broken policy wins over what could not be judged."""
    if "fail" in verdicts:
        return EXIT_FAIL
    return EXIT_NOT_JUDGED if "not_judged" in verdicts or not verdicts else EXIT_PASS


def forbidding(findings: Sequence[Finding]) -> str | None:
    """Where to look for what forbids judging; None when no finding does."""
    codes = sorted({finding.code for finding in findings if finding.forbids_pass})
    return f"see {', '.join(codes)} above" if codes else None
