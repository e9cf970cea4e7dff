"""Markdown for a CI summary or a merge request."""

from __future__ import annotations

import re
from collections.abc import Sequence

from collaudit.core.data.audit_result import AuditResult
from collaudit.reports.values import rows
from collaudit.reports.values.contact_rows import contact_rows
from collaudit.reports.values.entries import IndexEntry, brief_reason, entry_of, worst_first
from collaudit.reports.values.night import night_sentence
from collaudit.reports.values.sensitivity_rows import force_rows, force_shares, sensitivity_rows
from collaudit.reports.values.visible_text import visible
from collaudit.reports.values.words import STATEMENT

_MARKS = {"pass": "✅", "fail": "❌", "not_judged": "❔"}
_MOST_ROWS = 50
#: Logs that a summary names.
_MOST_LOGS = 12
_SPECIAL = re.compile(r"([\\`*_{}\[\]|~$])")
_ENTITIES = str.maketrans({"&": "&amp;", "<": "&lt;", ">": "&gt;", "@": "&#64;", "#": "&#35;"})
_LINK = re.compile(r"(?i)(https?|ftp|mailto|www)([:.])")


def markdown_text(results: Sequence[AuditResult], unread: Sequence[IndexEntry] = (), sentence: str = "") -> str:
    """What is said of all logs, and a table of those that do not pass, worst first; of a single log what it shows.

    Args:
        results: the audits.
        unread: logs that could not be audited.
        sentence: what is said of all logs; empty: made of these.
    """
    entries = worst_first([*(entry_of(result) for result in results), *unread])
    lines = ["# Collision audit", "", escaped(sentence or night_sentence(entries)), ""]
    if len(entries) == 1:
        lines += _one_log(entries[0]) + [line for result in results for line in _events(result)]
    else:
        lines += _log_table([entry for entry in entries if entry.verdict != "pass"])
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


def _one_log(entry: IndexEntry) -> list[str]:
    cells = (
        f"{_MARKS[entry.verdict]} {entry.word}",
        escaped(entry.name),
        escaped(entry.noticed or rows.NONE),
        entry.counted(entry.contacts),
        entry.counted(entry.near_misses),
        "; ".join(escaped(text) for text in (*entry.reasons, *entry.exclusions)),
    )
    return _table(("Verdict", "Log", "Would have noticed", "Contacts", "Near misses", "Reasons"), [cells])


def _events(result: AuditResult) -> list[str]:
    name = escaped(result.log.name)
    return _table_of_contacts(result, name) + _tables_of_sensitivity(result, name)


def _table_of_contacts(result: AuditResult, name: str) -> list[str]:
    cells = [(r.onset, r.lasted, r.joints, r.worst, r.link, r.force, r.kind) for r in contact_rows(result)]
    head = ("Onset", "Lasted", "Joints", "Highest residual", "Link or further out", "Force (95 %)", "Kind")
    return ["", f"## Contacts in {name}", "", *_escaped_table(head, cells)] if cells else []


def _tables_of_sensitivity(result: AuditResult, name: str) -> list[str]:
    lines: list[str] = []
    forces = force_rows(result)
    if forces:
        felt = [(r.place, *r.forces, r.asked, r.met) for r in forces]
        head = ("Place", *(f"In {100 * share:.3g} %" for share in force_shares(result)), "Asked", "Met in")
        lines += ["", f"## Smallest push that would have alarmed in {name}", "", *_escaped_table(head, felt)]
    joints = sensitivity_rows(result)
    if joints:
        cells = [(r.joint, r.judged, r.as_range, r.not_judged, r.half, r.most, r.always, r.asked) for r in joints]
        shares = ("Judged", "Friction a range", "Not judged")
        head = ("Joint", *shares, "Alarms in 50 %", "In 95 %", "Whenever judged", "Asked")
        lines += ["", f"## Smallest torque that would have alarmed in {name}", "", *_escaped_table(head, cells)]
    return lines


def _escaped_table(head: Sequence[str], cells: Sequence[Sequence[str]]) -> list[str]:
    shown = [[escaped(cell) for cell in line] for line in cells[:_MOST_ROWS]]
    note = [f"\n{len(cells) - _MOST_ROWS} more are in the HTML report and in audit.json."]
    return _table(head, shown) + (note if len(cells) > _MOST_ROWS else [])


def _table(head: Sequence[str], lines: Sequence[Sequence[str]]) -> list[str]:
    return [
        f"| {' | '.join(head)} |",
        f"| {' | '.join('---' for _ in head)} |",
        *(f"| {' | '.join(line)} |" for line in lines),
    ]
