"""Markdown for a CI summary or a merge request."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence

from collaudit.core.data.audit_result import AuditResult
from collaudit.reports.sections.event_sections import contact_section
from collaudit.reports.sections.judged_sections import force_section, judged_section
from collaudit.reports.sections.section import Section
from collaudit.reports.values.entries import IndexEntry, brief_reason, entry_of, worst_first
from collaudit.reports.values.first_words import excluded_lines, first_lines, more_reasons, unsaid
from collaudit.reports.values.night import QUIET, NightFacts
from collaudit.reports.values.visible_text import visible
from collaudit.reports.values.words import NONE, STATEMENT

_MARKS = {"pass": "✅", "fail": "❌", "not_judged": "❔"}
_MOST_ROWS = 50
#: Logs that a summary names.
_MOST_LOGS = 12
_CONTACT = (
    "onset",
    "lasted",
    "state",
    "joints",
    "highest residual",
    "γ",
    "link or further out",
    "force (95 %)",
    "kind",
)
_SPECIAL = re.compile(r"([\\`*_{}\[\]|~$])")
_ENTITIES = str.maketrans({"&": "&amp;", "<": "&lt;", ">": "&gt;", "@": "&#64;", "#": "&#35;"})
_LINK = re.compile(r"(?i)(https?|ftp|mailto|www)([:.])")


def markdown_text(results: Sequence[AuditResult], unread: Sequence[IndexEntry] = (), night: NightFacts = QUIET) -> str:
    """What is said of all logs, and a table of those that do not pass, worst first; of a single log what it shows.

    Args:
        results: the audits.
        unread: logs that could not be audited, and files that count as such.
        night: what is said of all of them.
    """
    entries = worst_first([*(entry_of(result) for result in results), *unread])
    lines = ["# Collision audit", "", escaped(night.sentence(entries)), ""]
    lines += [line for text in night.breaches for line in (f"{_MARKS['fail']} {escaped(text)}", "")]
    if len(entries) == 1:
        lines += [line for result in results for line in _first(result)]
        lines += _one_log(entries[0]) + [line for result in results for line in _events(result)]
    else:
        lines += _log_table([entry for entry in entries if entry.verdict != "pass"])
    if night.named:
        names = ", ".join(escaped(file.name) for file in night.named[:_MOST_LOGS])
        more = f" and {len(night.named) - _MOST_LOGS} more" if len(night.named) > _MOST_LOGS else ""
        lines += ["", f"Files that were not judged: {names}{more}."]
    lines += [line for use in night.stale for line in ("", f"Accepted contact, {use.state}: {escaped(use.text)}.")]
    lines += ["", f"> {STATEMENT}"]
    return "\n".join(lines) + "\n"


def escaped(text: str) -> str:
    """Text that Markdown takes for nothing but text, on one line."""
    plain = _SPECIAL.sub(r"\\\1", visible(text)).translate(_ENTITIES)
    return _LINK.sub(lambda match: f"{match[1]}&#{ord(match[2])};", plain)


def _log_table(entries: Sequence[IndexEntry]) -> list[str]:
    """A line a log, as short as a CI server's page wants it."""
    lines = [
        (
            f"{_MARKS[entry.verdict]} {entry.word}",
            escaped(entry.name),
            entry.counted(entry.contacts),
            entry.counted(entry.near_misses),
            escaped(brief_reason(entry)),
        )
        for entry in entries[:_MOST_LOGS]
    ]
    left = len(entries) - len(lines)
    more = ["", f"{left} more that do not pass are in index.html."] if left else []
    return [*_table(("Verdict", "Log", "Contacts", "Near misses", "Why"), lines), *more] if lines else []


def _first(result: AuditResult) -> list[str]:
    """What a reader must know first, and what the verdict does not cover beside it."""
    first = first_lines(result)
    beside = [f"Not part of this verdict: {text}" for text in unsaid(excluded_lines(result), first)]
    return [*(f"- {escaped(line)}" for line in (*first, *more_reasons(result, first), *beside)), ""]


def _one_log(entry: IndexEntry) -> list[str]:
    cells = (
        f"{_MARKS[entry.verdict]} {entry.word}",
        escaped(entry.name),
        escaped(entry.noticed or NONE),
        entry.counted(entry.contacts),
        entry.counted(entry.near_misses),
    )
    return _table(("Verdict", "Log", "Would have noticed", "Contacts", "Near misses"), [cells])


def _events(result: AuditResult) -> Iterator[str]:
    """Contacts, pushes and torques that would have alarmed."""
    name = escaped(result.log.name)
    for found in (contact_section(result).only(*_CONTACT), force_section(result), judged_section(result)):
        if found.rows:
            yield from ("", f"## {name}: {found.title}", "", *section_lines(found))


def section_lines(found: Section) -> list[str]:
    """A section as a table with its notes."""
    shown = [[escaped(cell) for cell in row] for row in found.rows[:_MOST_ROWS]]
    note = [f"\n{len(found.rows) - _MOST_ROWS} more are in the HTML report and in audit.json."]
    notes = [line for text in found.notes for line in ("", escaped(text))]
    return _table(found.columns, shown) + (note if len(found.rows) > _MOST_ROWS else []) + notes


def _table(head: Sequence[str], lines: Sequence[Sequence[str]]) -> list[str]:
    return [
        f"| {' | '.join(head)} |",
        f"| {' | '.join('---' for _ in head)} |",
        *(f"| {' | '.join(line)} |" for line in lines),
    ]
