"""Audits for a terminal: one in full, many in a line each."""

from __future__ import annotations

from collections.abc import Sequence

from collaudit.core.data.audit_result import AuditResult
from collaudit.reports.terminal.finding_text import finding_lines
from collaudit.reports.terminal.rule_text import rule_text
from collaudit.reports.terminal.screen_text import contact_table, sensitivity_text, verdict_text
from collaudit.reports.terminal.text_table import table, table_with_text, without_unit, wrapped
from collaudit.reports.values import rows
from collaudit.reports.values.contact_rows import contacts_of
from collaudit.reports.values.entries import IndexEntry, brief_reason, verdict_counts, worst_first
from collaudit.reports.values.sensitivity_rows import sensitivity_row
from collaudit.reports.values.words import STATEMENT, VERDICT_WORD, counted, plural

#: Characters of the one reason beside a log among many.
_REASON = 120


def summary_table(entries: Sequence[IndexEntry], width: int | None = None, most: int | None = None) -> str:
    """One line per log, worst first, then the counts.

    Args:
        entries: one per log.
        width: columns of the terminal that the table is cut to; None: any.
        most: lines at most, each with its first reason and how many follow; None: any, with every reason.

    Returns:
        Text that ends in a line feed.
    """
    head = ("verdict", "log", "would have noticed", "contacts", "near misses", "reasons")
    listed = worst_first(entries)[:most]
    lines = [
        (
            entry.word,
            entry.name,
            entry.noticed or rows.NONE,
            entry.counted(entry.contacts),
            entry.counted(entry.near_misses),
            _reasons(entry, brief=most is not None),
        )
        for entry in listed
    ]
    left = len(entries) - len(listed)
    more = f"… and {plural(left, 'more log')}; -v lists all\n" if left else ""
    return table_with_text(head, lines, (2, 3, 4), width) + more + "\n" + total_text(entries)


def _reasons(entry: IndexEntry, brief: bool) -> str:
    """Why, then what the verdict leaves out; in brief the first of it, which a line of a file can hold."""
    every = (*entry.reasons, *entry.exclusions)
    if not brief or not every:
        return "; ".join(every)
    first = brief_reason(entry, _REASON)
    return f"{first} (and {len(every) - 1} more)" if len(every) > 1 else first


def total_text(entries: Sequence[IndexEntry]) -> str:
    """How many logs have which verdict, in one line."""
    counts = verdict_counts(entries)
    total = ", ".join(f"{counts[verdict]} {word.lower()}" for verdict, word in VERDICT_WORD.items())
    return f"{plural(len(entries), 'log')}: {total}\n"


def audit_text(result: AuditResult, width: int | None = None) -> str:
    """One audit in full: verdict, and a line per joint, contact, alarm, near miss and finding.

    Tables are cut to ``width``, None: any.
    """
    contacts = contacts_of(result)
    parts = [verdict_text(result, None, width), "\n", _joint_table(result, width), *sensitivity_text(result, width)]
    if contacts:
        parts += ["\nContacts\n", contact_table(result, contacts, width)]
    if result.collisions:
        parts += ["\nAlarms of single joints\n", _collision_table(result, width)]
    if result.near_misses:
        parts += ["\nNear misses\n", _near_miss_table(result, width)]
    findings = [finding for finding in rows.worst_first(result.findings) if finding.severity != "info"]
    if findings:
        parts.append("\nFindings\n")
        parts += [
            f"{wrapped(f'  {severity:<8}{line}', width, ' ' * 10)}\n"
            for severity, line in finding_lines(findings, brief=True)
        ]
    parts.append(f"\n{wrapped(rule_text(result), width, '  ')}\n{wrapped(STATEMENT, width)}\n")
    return "".join(parts)


def _joint_table(result: AuditResult, width: int | None) -> str:
    lines = []
    for joint, coverage in result.coverage.joints.items():
        found = sensitivity_row(joint, result)
        level = rows.residual_row(joint, result) if joint in result.residual else None
        count = sum(c.joint == joint for c in result.collisions) + sum(m.joint == joint for m in result.near_misses)
        values = (level.mean, level.p99, level.largest, level.gamma) if level else (rows.NONE,) * 4
        lines.append(
            (
                joint,
                "yes" if coverage.watched else "no",
                found.judged if found else rows.NONE,
                *values,
                counted(count, result),
            )
        )
    plain, unit = without_unit(lines, (3, 4, 5, 6))
    title = f"mean |r|{unit}"
    head = ("joint", "watched", "judged", title, "99 % below", "largest", "gamma", "alarms, near misses")
    return table(head, plain, (2, 3, 4, 5, 6, 7), width, fold=True)


def _collision_table(result: AuditResult, width: int | None) -> str:
    listed = [rows.collision_row(event, result) for event in rows.in_time(result.collisions)]
    lines = [(r.joint, r.onset, r.detected, r.lasted, r.peak, r.gamma, r.phase) for r in listed]
    plain, unit = without_unit(lines, (4, 5))
    head = ("joint", "onset", "detected", "above gamma", f"peak{unit}", "gamma", "phase")
    return table(head, plain, (1, 2, 3, 4, 5), width, fold=True)


def _near_miss_table(result: AuditResult, width: int | None) -> str:
    listed = [rows.near_miss_row(event, result) for event in rows.in_time(result.near_misses)]
    lines = [(r.joint, r.kind, r.onset, r.lasted, r.peak, r.gamma, r.closeness, r.phase) for r in listed]
    plain, unit = without_unit(lines, (4, 5))
    head = ("joint", "kind", "onset", "lasted", f"peak{unit}", "gamma", "how close", "phase")
    return table(head, plain, (2, 3, 4, 5, 6), width, fold=True)
