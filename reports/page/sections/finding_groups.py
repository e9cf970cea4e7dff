"""Findings grouped by kind, over joints, each with what to do."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from collaudit.core.data.audit_result import AuditResult
from collaudit.core.findings import Finding
from collaudit.core.findings.finding_kinds import Severity
from collaudit.reports.values import rows


@dataclass(frozen=True, slots=True)
class FindingLine:
    """One finding: text, joint, where, and when as text (empty where it has none).

    Attributes:
        also: joints of which another finding says the same.
    """

    text: str
    joint: str
    place: str
    also: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class FindingGroup:
    """Findings of one kind and severity; ``count`` of them, ``remedy`` is what to do."""

    code: str
    severity: Severity
    meaning: str
    remedy: str
    joints: tuple[str, ...]
    lines: tuple[FindingLine, ...]
    count: int


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
        lines=tuple(_lines(found, result)),
        count=len(found),
    )


def _lines(found: list[Finding], result: AuditResult) -> Iterator[FindingLine]:
    """Each finding, but what is said alike of several joints is one line."""
    alike: dict[tuple[str, str], list[Finding]] = {}
    for finding in found:
        template = finding.text if finding.joint is None else finding.text.replace(finding.joint, "\0")
        alike.setdefault((template, _place(finding, result)), []).append(finding)
    for (_, place), same in alike.items():
        others = tuple(finding.joint for finding in same[1:] if finding.joint is not None)
        yield FindingLine(same[0].text, same[0].joint or "", place, tuple(dict.fromkeys(others)))


def _place(finding: Finding, result: AuditResult) -> str:
    when = rows.finding_place(finding, result)
    return ", ".join(part for part in (finding.where, when) if part)
