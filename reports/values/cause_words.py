"""Causes of a residual that is off, in words: one sentence, and which findings follow from the cause."""

from __future__ import annotations

from collaudit.core.data.audit_result import AuditResult
from collaudit.core.data.cause import Cause
from collaudit.core.findings import Finding


def speaking(result: AuditResult) -> Cause | None:
    """The cause that explains most, where it explains enough."""
    return next((cause for cause in result.causes if cause.speaks), None)


def cause_sentence(result: AuditResult) -> str | None:
    """The cause, its share and the runner-up of another kind; None where no residual is off."""
    if not result.causes:
        return None
    first = speaking(result)
    best = result.causes[0]
    if first is None:
        return f"No single cause explains the residual: at best {_share(best)} of it, by {best.text}."
    best_of: dict[str, Cause] = {}
    for cause in result.causes:
        best_of.setdefault(cause.code, cause)
    other = next(iter([*best_of.values()][1:]), None)
    beside = "" if other is None else f", next best: {other.code}, {_share(other)}"
    return f"Cause: {first.text} (explains {_share(first)}{beside})."


def cause_lines(result: AuditResult) -> list[str]:
    """Every cause that takes away a tenth of what is beyond the usual, the best first."""
    return [f"{_share(cause):>5}  {cause.text}{f' -> {cause.line}' if cause.line else ''}" for cause in result.causes]


def _share(cause: Cause) -> str:
    return f"{100.0 * cause.share:.0f} %"


def follows(result: AuditResult, finding: Finding) -> bool:
    """Whether a finding follows from the cause: alarms may be errors of the model. Those that forbid a pass stay."""
    return speaking(result) is not None and finding.doubts_alarms and not finding.forbids_pass
