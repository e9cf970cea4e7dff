"""Plain-text tables for a terminal: aligned, readable without colour."""

from __future__ import annotations

import unicodedata
from collections.abc import Sequence

from collaudit.core.data.audit_result import AuditResult
from collaudit.reports.values import rows
from collaudit.reports.values.entries import IndexEntry, verdict_counts, worst_first
from collaudit.reports.values.numbers import duration
from collaudit.reports.values.words import STATEMENT, VERDICT_WORD, counted, plural, visible


def summary_table(entries: Sequence[IndexEntry]) -> str:
    """One line per log, worst first, then the counts.

    Args:
        entries: one per log.

    Returns:
        Text that ends in a line feed.
    """
    head = ("verdict", "log", "judged", "collisions", "near misses", "reasons")
    lines = [
        (
            VERDICT_WORD[entry.verdict],
            entry.name,
            duration(3600 * entry.judged_h),
            str(entry.collisions) if entry.counts_mean_something else rows.NONE,
            str(entry.near_misses) if entry.counts_mean_something else rows.NONE,
            "; ".join(entry.reasons),
        )
        for entry in worst_first(entries)
    ]
    counts = verdict_counts(entries)
    total = ", ".join(f"{counts[verdict]} {word.lower()}" for verdict, word in VERDICT_WORD.items())
    return table(head, lines, numeric=(2, 3, 4)) + f"\n{plural(len(entries), 'log')}: {total}\n"


def audit_text(result: AuditResult) -> str:
    """One audit: verdict, reasons, and a line per joint and per event."""
    parts = [
        f"{VERDICT_WORD[result.verdict]}  {visible(result.log.name)}\n",
        *(f"  - {visible(reason)}\n" for reason in result.reasons),
        "\n",
        _joint_table(result),
    ]
    if result.collisions:
        parts += ["\nCollisions\n", _collision_table(result)]
    if result.near_misses:
        parts += ["\nNear misses\n", _near_miss_table(result)]
    findings = [finding for finding in rows.worst_first(result.findings) if finding.severity != "info"]
    if findings:
        parts.append("\nFindings\n")
        parts += [f"  {finding.severity:<8}{finding.code}: {visible(finding.text)}\n" for finding in findings]
    parts.append(f"\n{STATEMENT}\n")
    return "".join(parts)


def table(head: Sequence[str], lines: Sequence[Sequence[str]], numeric: Sequence[int] = ()) -> str:
    """Aligned columns with a header line and a rule under it.

    Args:
        head: column titles.
        lines: cells; control characters are spelt out.
        numeric: columns that are flush right.
    """
    cells = [[visible(cell) for cell in line] for line in (head, *lines)]
    widths = [max(_width(line[k]) for line in cells) for k in range(len(head))]
    text = []
    for at, line in enumerate(cells):
        padded = [_pad(cell, widths[k], right=k in numeric) for k, cell in enumerate(line)]
        text.append("  ".join(padded).rstrip())
        if at == 0:
            text.append("  ".join("-" * width for width in widths))
    return "\n".join(text) + "\n"


def _joint_table(result: AuditResult) -> str:
    head = ("joint", "watched", "moving judged", "mean |r|", "99 % below", "largest", "gamma", "events")
    lines = []
    for joint, coverage in result.coverage.joints.items():
        cover = rows.coverage_row(joint, coverage, result)
        level = rows.residual_row(joint, result) if joint in result.residual else None
        count = sum(c.joint == joint for c in result.collisions) + sum(m.joint == joint for m in result.near_misses)
        values = (level.mean, level.p99, level.largest, level.gamma) if level else (rows.NONE,) * 4
        lines.append((joint, "yes" if cover.watched else "no", cover.share, *values, counted(count, result)))
    return table(head, lines, numeric=(2, 3, 4, 5, 6, 7))


def _collision_table(result: AuditResult) -> str:
    listed = [rows.collision_row(event, result) for event in rows.in_time(result.collisions)]
    head = ("joint", "onset", "detected", "above gamma", "peak", "gamma", "phase")
    lines = [(r.joint, r.onset, r.detected, r.lasted, r.peak, r.gamma, r.phase) for r in listed]
    return table(head, lines, numeric=(1, 2, 3, 4, 5))


def _near_miss_table(result: AuditResult) -> str:
    listed = [rows.near_miss_row(event, result) for event in rows.in_time(result.near_misses)]
    head = ("joint", "kind", "onset", "lasted", "peak", "gamma", "how close", "phase")
    lines = [(r.joint, r.kind, r.onset, r.lasted, r.peak, r.gamma, r.closeness, r.phase) for r in listed]
    return table(head, lines, numeric=(2, 3, 4, 5, 6))


def _pad(cell: str, width: int, *, right: bool) -> str:
    space = " " * (width - _width(cell))
    return space + cell if right else cell + space


def _width(text: str) -> int:
    """Columns a terminal gives the text: wide East Asian letters take two, combining marks none."""
    return sum(
        0 if unicodedata.combining(char) else 2 if unicodedata.east_asian_width(char) in "WF" else 1 for char in text
    )
