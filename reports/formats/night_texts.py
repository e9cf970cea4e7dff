"""A night in text for people: Markdown, one message as text or for Slack, annotations of a GitHub job.

The form for Slack is its Block Kit: sections of mrkdwn, in which ``&``, ``<`` and ``>`` are escaped and a link is
``<URL|text>``; a section holds at most 3000 characters. A runner of GitHub
shows ``::LEVEL title=…::message`` with ``%``, line ends, and in properties ``:`` and ``,`` percent-encoded, as its
documentation of workflow commands states it.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence

from collaudit.core.data.audit_result import AuditResult
from collaudit.reports.files.written_files import json_text
from collaudit.reports.sections.event_sections import contact_section
from collaudit.reports.sections.judged_sections import force_section, judged_section
from collaudit.reports.sections.section import Section
from collaudit.reports.values.entries import IndexEntry, brief_reason, entry_of, night_dates, worst_first
from collaudit.reports.values.first_words import excluded_lines, first_lines, more_reasons, unsaid
from collaudit.reports.values.night import QUIET, NightFacts, group_words
from collaudit.reports.values.visible_text import visible
from collaudit.reports.values.words import NONE, STATEMENT, VERDICT_WORD, plural

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


#: Logs and groups that a message names; characters of a section.
_MOST = 10
_SECTION = 2900


def message_text(results: Sequence[AuditResult], unread: Sequence[IndexEntry] = (), night: NightFacts = QUIET) -> str:
    """Verdict and sentence, a line a group, a line and a link for each log that does not pass.

    Args:
        results: the audits.
        unread: logs that could not be audited, and files that count as such.
        night: what is said of all of them, and where its reports are.
    """
    head, groups, logs = _parts(results, unread, night)
    lines = [*head, *(f"- {group}" for group in groups)]
    lines += [f"- {said}{f'  {link}' if link else ''}" for said, link in logs]
    return "".join(f"{visible(line)}\n" for line in lines)


def slack_text(results: Sequence[AuditResult], unread: Sequence[IndexEntry] = (), night: NightFacts = QUIET) -> str:
    """The same as JSON for a webhook of Slack; logs are links where the base of links is a URL."""
    head, groups, logs = _parts(results, unread, night)
    lines = [f"• <{link}|{_mrkdwn(said)}>" if "://" in link else f"• {_mrkdwn(said)}" for said, link in logs]
    sections = ["\n".join(map(_mrkdwn, head)), "\n".join(f"• {_mrkdwn(one)}" for one in groups), *_cut(lines)]
    blocks = [{"type": "section", "text": {"type": "mrkdwn", "text": text[:_SECTION]}} for text in sections if text]
    return json_text({"text": visible(" ".join(head)), "blocks": blocks})


def _parts(
    results: Sequence[AuditResult], unread: Sequence[IndexEntry], night: NightFacts
) -> tuple[list[str], list[str], list[tuple[str, str]]]:
    """What is said of the night, of its groups, and of logs that do not pass, each with its link."""
    entries = worst_first([*(entry_of(result) for result in results), *unread])
    said = night.sentence(entries)
    head = [f"{VERDICT_WORD[night.verdict(entries)]}, {night_dates(entries)}: {said}"]
    head += night.breaches
    groups = [f"{f'{group.robot}: ' if group.robot else ''}{group_words(group)}" for group in night.groups[:_MOST]]
    failing = [entry for entry in entries if entry.verdict != "pass"]
    logs = [(f"{entry.word} {entry.name}: {brief_reason(entry)}", night.link_of(entry.name)) for entry in failing]
    left = len(logs) - _MOST
    return head, groups, [*logs[:_MOST], *([(f"{plural(left, 'more log')}", night.link_of(""))] if left > 0 else [])]


def _cut(lines: Sequence[str]) -> list[str]:
    """Lines in as many sections as they need; none is cut inside its link."""
    sections: list[str] = []
    for line in lines:
        if sections and len(sections[-1]) + len(line) < _SECTION:
            sections[-1] += f"\n{line}"
        else:
            sections.append(line)
    return sections


def _mrkdwn(text: str) -> str:
    return visible(text).replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")


#: A runner shows ten annotations of a kind and step.
_MOST_CONTACTS = 5
_LEVEL = {"fail": "error", "not_judged": "warning", "pass": "notice"}


def github_text(results: Sequence[AuditResult], unread: Sequence[IndexEntry] = (), night: NightFacts = QUIET) -> str:
    """A line a log, worst first, and one for each of its first contacts.

    Args:
        results: the audits.
        unread: logs that could not be audited, and files that count as such.
        night: limits that are broken over all logs, and files that are only named.
    """
    pairs = [(entry_of(result), result) for result in results]
    audited = {id(entry): result for entry, result in pairs}
    lines = [_command("error", "FAIL: night", text) for text in night.breaches]
    for entry in worst_first([*(entry for entry, _ in pairs), *unread]):
        reasons = "; ".join((*entry.reasons, *entry.exclusions)) or "no reason was recorded"
        lines.append(_command(_LEVEL[entry.verdict], f"{entry.word}: {entry.name}", reasons))
        if id(entry) in audited:
            lines += _annotated(audited[id(entry)])
    lines += [_command("notice", f"Not judged: {file.name}", file.text) for file in night.named]
    return "".join(f"{line}\n" for line in lines)


def _annotated(result: AuditResult) -> list[str]:
    found = contact_section(result).records
    lines = []
    for record in found[:_MOST_CONTACTS]:
        said = "{state}, {joints}, for {lasted}, highest residual {highest residual} (γ {γ}) on {joint}, {kind}"
        text = said.format_map(record)
        lines.append(_command("notice", f"Contact at {record['onset']}: {result.log.name}", text))
    if len(found) > _MOST_CONTACTS:
        title = f"{len(found) - _MOST_CONTACTS} more contacts: {result.log.name}"
        lines.append(_command("notice", title, "audit.json lists all of them"))
    return lines


def _command(level: str, title: str, message: str) -> str:
    return f"::{level} title={_encoded(title, prop=True)}::{_encoded(message)}"


def _encoded(text: str, *, prop: bool = False) -> str:
    out = visible(text).replace("%", "%25").replace("\r", "%0D").replace("\n", "%0A")
    return out.replace(":", "%3A").replace(",", "%2C") if prop else out
