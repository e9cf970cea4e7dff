"""GitHub annotations: one workflow command a line, which a runner shows beside the job.

The form is ``::LEVEL title=…::message`` with ``%``, line ends, and in properties ``:`` and ``,`` percent-encoded, as
GitHub's documentation of workflow commands states it.
"""

from __future__ import annotations

from collections.abc import Sequence

from collaudit.core.data.audit_result import AuditResult
from collaudit.reports.sections.event_sections import contact_section
from collaudit.reports.values.entries import IndexEntry, entry_of, worst_first
from collaudit.reports.values.night import QUIET, NightFacts
from collaudit.reports.values.visible_text import visible

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
            lines += _contacts(audited[id(entry)])
    lines += [_command("notice", f"Not judged: {file.name}", file.text) for file in night.named]
    return "".join(f"{line}\n" for line in lines)


def _contacts(result: AuditResult) -> list[str]:
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
    return f"::{level} title={_escaped(title, prop=True)}::{_escaped(message)}"


def _escaped(text: str, *, prop: bool = False) -> str:
    out = visible(text).replace("%", "%25").replace("\r", "%0D").replace("\n", "%0A")
    return out.replace(":", "%3A").replace(",", "%2C") if prop else out
