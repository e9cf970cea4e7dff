"""Findings grouped by kind, over joints, each with what to do."""

from __future__ import annotations

from dataclasses import dataclass

from collaudit.core.data.audit_result import AuditResult
from collaudit.core.findings import Finding
from collaudit.core.findings.finding_kinds import Severity
from collaudit.reports.values import rows


@dataclass(frozen=True, slots=True)
class FindingLine:
    """One finding: text, joint, where, and when as text (empty where it has none)."""

    text: str
    joint: str
    place: str


@dataclass(frozen=True, slots=True)
class FindingGroup:
    """Findings of one kind and severity; ``remedy`` is what to do."""

    code: str
    severity: Severity
    meaning: str
    remedy: str
    joints: tuple[str, ...]
    lines: tuple[FindingLine, ...]


def finding_groups(result: AuditResult) -> tuple[FindingGroup, ...]:
    """Every finding once, worst first, in the order the kinds were first stated."""
    groups: dict[tuple[str, str], list[Finding]] = {}
    for finding in rows.worst_first(result.findings):
        groups.setdefault((finding.severity, finding.code), []).append(finding)
    return tuple(_group(found, result) for found in groups.values())


def _group(found: list[Finding], result: AuditResult) -> FindingGroup:
    first = found[0]
    return FindingGroup(
        code=first.code,
        severity=first.severity,
        meaning=first.kind.meaning,
        remedy=first.kind.remedy,
        joints=tuple(dict.fromkeys(finding.joint for finding in found if finding.joint is not None)),
        lines=tuple(FindingLine(f.text, f.joint or "", _place(f, result)) for f in found),
    )


def _place(finding: Finding, result: AuditResult) -> str:
    when = rows.finding_place(finding, result)
    return ", ".join(part for part in (finding.where, when) if part)
