"""One log for a terminal: what is in it, and its audit on a screen or in full."""

from __future__ import annotations

import re
from collections.abc import Sequence
from datetime import UTC, datetime
from itertools import groupby
from textwrap import indent

from collaudit.core.data.audit_result import AuditResult
from collaudit.core.findings import Finding
from collaudit.core.logs.log_summary import ColumnInfo, LogSummary, TopicInfo
from collaudit.reports.sections.event_sections import (
    alarm_section,
    contact_section,
    delay_text,
    detection_sections,
    disturbance_section,
    near_miss_section,
)
from collaudit.reports.sections.finding_sections import finding_lines, worst_first
from collaudit.reports.sections.judged_sections import cycle_section, force_line, judged_section, residual_section
from collaudit.reports.sections.section import Section
from collaudit.reports.terminal.text_table import section_text, sections_text, table
from collaudit.reports.values.first_words import all_told, excluded_lines, first_lines, more_reasons, strongest, unsaid
from collaudit.reports.values.visible_text import visible, wrapped
from collaudit.reports.values.words import (
    BRIEF_STATEMENT,
    NONE,
    STATEMENT,
    cause_lines,
    clock_text,
    follows,
    nothing_judged,
    plural,
    rule_text,
    verdict_word,
)

_LONGEST_LIST = 24
_INDENT = "  "
_MOST_CONTACTS = 3
_MOST_FINDINGS = 3
_MOST_NEAR = 2
_MOST_REASONS = 4
_CONTACT = (
    "onset",
    "lasted",
    "joint",
    "highest residual",
    "γ",
    "link or further out",
    "force (95 %)",
    "kind",
    "state",
    "id",
)
#: Columns that a screen has no room for.
_TOO_WIDE = ("friction as a range",)
_NEAR_MISS = ("onset", "lasted", "joint", "peak", "γ", "how close")
_RESIDUAL = ("joint", "mean |r|", "99 % below", "largest", "γ", "alarms, near misses")


def log_text(summary: LogSummary, width: int | None = None) -> str:
    """What is in a log: its size and length, a table of its topics, the joints of each.

    Args:
        summary: of the log.
        width: columns of the terminal that the table is cut to; None: any.
    """
    title = [summary.name, f"{summary.format}, {_bytes(summary.size_bytes)}"]
    if summary.duration_s is not None:
        title.append(f"{summary.duration_s:.3f} s")
    if summary.start_ns is not None:
        title.append(f"starts {datetime.fromtimestamp(summary.start_ns / 1e9, UTC):%Y-%m-%d %H:%M:%S} UTC")
    lines = ["  ".join(title)]
    room = None if width is None else width - len(_INDENT)
    if summary.columns:
        lines.append(indent(columns_text(summary.columns, room), _INDENT))
    elif summary.csv_columns:
        lines.append(f"  {len(summary.csv_columns)} columns: {_names(summary.csv_columns)}")
    if summary.topics:
        rows = [
            (
                topic.name,
                topic.type,
                topic.role.replace("_", " "),
                str(topic.count),
                "" if topic.rate_hz is None else f"{topic.rate_hz:.1f}",
                "" if topic.largest_gap_s is None else f"{topic.largest_gap_s:.3f}",
                topic.note,
            )
            for topic in summary.topics
        ]
        head = ("topic", "type", "role", "messages", "Hz", "largest gap s", "note")
        lines.append(indent(table(head, rows, (3, 4, 5), room, text_below=True).rstrip(), _INDENT))
        lines += [f"  joints of {topic.name}: {_joints(topic)}" for topic in summary.topics if topic.joints]
    return "\n".join(lines)


def _joints(topic: TopicInfo) -> str:
    present = {"velocity": topic.has_velocity, "effort": topic.has_effort}
    lacking = [f"no {name}" for name, there in present.items() if there is False]
    return _names(topic.joints) + (f" ({', '.join(lacking)})" if lacking else "")


def _names(names: tuple[str, ...]) -> str:
    shown = [name for name in names if name][:_LONGEST_LIST]
    return ", ".join(shown) + (", …" if len(names) > _LONGEST_LIST else "")


def _bytes(size: int) -> str:
    """A size in the unit a reader thinks in."""
    value, units = float(size), ["B", "kB", "MB", "GB"]
    while value >= 1000 and len(units) > 1:
        value, units = value / 1000, units[1:]
    return f"{value:.0f} {units[0]}" if units[0] == "B" else f"{value:.1f} {units[0]}"


def columns_text(columns: Sequence[ColumnInfo], width: int | None = None) -> str:
    """Name, unit, range, changes, role and its reason of each column.

    Args:
        columns: of one log.
        width: that lines are cut to; None: any.
    """
    several = len({column.file for column in columns}) > 1
    rows = [_row(list(group), several=several) for _, group in groupby(columns, _family)]
    return table(("column", "unit", "min", "max", "changes", "role", "why"), rows, (2, 3, 4), width).rstrip()


def _family(column: ColumnInfo) -> tuple[str, ...]:
    return re.sub(r"\d+", "#", column.name), column.unit, column.role, column.why, column.file


def _row(group: Sequence[ColumnInfo], *, several: bool) -> tuple[str, ...]:
    first, last = group[0], group[-1]
    name = first.name if len(group) == 1 else f"{first.name} … {last.name}"
    changes = sorted({column.changes for column in group if column.changes is not None})
    lows = [column.min for column in group if column.min is not None]
    highs = [column.max for column in group if column.max is not None]
    return (
        f"{name} ({first.file})" if several else name,
        first.unit,
        f"{min(lows):.6g}" if lows else "",
        f"{max(highs):.6g}" if highs else "",
        "" if not changes else str(changes[0]) if len(changes) == 1 else f"{changes[0]}–{changes[-1]}",
        first.role + (f" ({len(group)})" if len(group) > 1 else ""),
        first.why,
    )


def screen_text(result: AuditResult, width: int | None = None, more: str | None = None) -> str:
    """What fits a screen.

    Args:
        result: the audit.
        width: columns of the terminal that tables are cut to; None: any.
        more: where the rest is.
    """
    contacts = contact_section(result, strongest(result, _MOST_CONTACTS)).only(*_CONTACT)
    near_misses, which = near_miss_section(result).only(*_NEAR_MISS), f"the {_MOST_CONTACTS} highest"
    sections = [
        *([] if all_told(result) else [_counted(contacts, "Contacts", len(result.contacts), which)]),
        _counted(near_misses.part(0, _MOST_NEAR), "Near misses", len(near_misses.rows), f"the {_MOST_NEAR} closest"),
        *(() if nothing_judged(result) else (_noticed(result, _TOO_WIDE),)),
    ]
    rule = rule_text(result) if more is None else f"{rule_text(result)}. More: {more}."
    return "".join(
        (
            verdict_text(result, _MOST_REASONS, width),
            sections_text(sections, width),
            *_important(result, width),
            f"\n{wrapped(rule, width, '  ')}\n",
            f"{wrapped(BRIEF_STATEMENT, width)}\n",
        )
    )


def audit_text(result: AuditResult, width: int | None = None) -> str:
    """One audit in full: verdict, and a line per joint, contact, alarm, near miss and finding.

    Tables are cut to ``width``, None: any.
    """
    sections = (
        residual_section(result).only(*_RESIDUAL),
        cycle_section(result),
        _noticed(result),
        alarm_section(result),
        near_miss_section(result).only("#", *_NEAR_MISS, "kind", "phase"),
        disturbance_section(result),
    )
    contacts = contact_section(result).only(*_CONTACT, "joints", "after it", "evidence")
    findings = [finding for finding in worst_first(result.findings) if finding.severity != "info"]
    lines = [_finding(severity, line, width) for severity, line in finding_lines(findings, brief=True)]
    return "".join(
        (
            verdict_text(result, None, width),
            f"\n{section_text(contacts, width, 'evidence' in contacts.columns)}" if contacts.rows else "",
            sections_text(sections, width),
            *(("\nFindings\n", *lines) if lines else ()),
            causes_text(result, width),
            f"\n{wrapped(rule_text(result), width, '  ')}\n{wrapped(STATEMENT, width)}\n",
        )
    )


def causes_text(result: AuditResult, width: int | None = None) -> str:
    """Causes that were tried on a residual that is off, in lines of ``width``; empty without any."""
    lines = [f"{wrapped(f'  {line}', width, ' ' * 9)}\n" for line in cause_lines(result)]
    return "".join(
        ("\nCauses tried: share of the residual beyond the usual that each explains\n", *lines) if lines else ()
    )


def detection_text(result: AuditResult, width: int | None = None) -> str:
    """Lines about the detection; empty for results without it. Tables are cut to ``width``, None: any."""
    facts = result.detection
    if facts is None:
        return ""
    mode = "causal" if facts.causal else "offline, zero phase"
    head = f"Detector: {result.rule.detector} ({mode}); delay {delay_text(facts.delay)}."
    return f"{wrapped(head, width, '  ')}\n" + sections_text(detection_sections(result), width)


def verdict_text(result: AuditResult, most: int | None = None, width: int | None = None) -> str:
    """The verdict, what comes first, and ``most`` other reasons and exclusions each, in lines of ``width``."""
    recorded = clock_text(result.log.start, 0.0)
    when = "recording time not known" if recorded == NONE else f"recorded {recorded}"
    head = f"{verdict_word(result.verdict, result.exclusions)}  {visible(result.log.name)}, {when}\n"
    first = first_lines(result)
    reasons, excluded = more_reasons(result, first), unsaid(excluded_lines(result), first)
    text = "".join((head, *_listed(first, None, width), *_listed(reasons, most, width)))
    if not excluded:
        return text
    return f"{text}  excluded:\n" + "".join(_listed(excluded, most, width))


def _counted(found: Section, title: str, count: int, which: str) -> Section:
    """A section without notes, whose title says how many there are, and which are listed."""
    some = f", {which}" if len(found.rows) < count else ""
    return Section(f"{title} ({count}{some})", found.columns, found.rows)


def _noticed(result: AuditResult, left_out: Sequence[str] = ()) -> Section:
    """The smallest torque by joint, and push by place, that would have alarmed; without some columns."""
    found = judged_section(result)
    found = found.only(*(column for column in found.columns if column not in left_out))
    line = force_line(result)
    return Section(found.title, found.columns, found.rows, (visible(line),) if line else ())


def important_findings(result: AuditResult) -> list[tuple[Finding, int]]:
    """Warnings and errors that matter most first, and how many of a kind there are; without what the verdict says.

    Where nothing was judged, what is wrong with the whole log comes first: findings on joints follow from it.
    """
    idle = nothing_judged(result)
    said = {*result.reasons, *result.exclusions}
    left = [f for f in result.findings if f.severity != "info" and f.text not in said and not follows(result, f)]
    order = sorted(
        left,
        key=lambda f: (
            idle and f.joint is not None,
            not f.forbids_pass,
            f.severity != "error",
            f.effect == "none",
            f.code,
        ),
    )
    return [(group[0], len(group)) for _, found in groupby(order, key=lambda f: f.code) if (group := list(found))]


def _important(result: AuditResult, width: int | None) -> list[str]:
    found = important_findings(result)
    if not found:
        return []
    total = sum(count for _, count in found)
    shown = found[:_MOST_FINDINGS]
    parts = [f"\nFindings ({sum(count for _, count in shown)} of {total} warnings and errors)\n"]
    for finding, count in shown:
        others = f" (and {count - 1} more of this kind)" if count > 1 else ""
        parts.append(_finding(finding.severity, f"{finding.code}: {visible(finding.text)}{others}", width))
    return parts


def _finding(severity: str, line: str, width: int | None) -> str:
    return f"{wrapped(f'  {severity:<8}{line}', width, ' ' * 10)}\n"


def _listed(texts: Sequence[str], most: int | None, width: int | None) -> list[str]:
    shown = texts[:most]
    left = len(texts) - len(shown)
    more = [f"  - {plural(left, 'more line')}: -v lists all\n"] if left else []
    return [f"{wrapped(f'  - {visible(text)}', width, '    ')}\n" for text in shown] + more
