"""SARIF 2.1.0: what breaks the policy or lets one doubt it, as results about a log."""

from __future__ import annotations

import hashlib
from collections import Counter
from collections.abc import Iterator, Sequence
from typing import Any
from urllib.parse import quote

from collaudit.core.data.audit_result import AuditResult
from collaudit.core.findings import CODES
from collaudit.reports.files.json_files import Json, json_text, plain
from collaudit.reports.sections.event_sections import contact_section
from collaudit.reports.sections.finding_sections import worst_first
from collaudit.reports.values.entries import IndexEntry
from collaudit.reports.values.night import QUIET, NightFacts
from collaudit.reports.values.visible_text import visible

_VERSION = "2.1.0"
_SCHEMA = "https://docs.oasis-open.org/sarif/sarif/v2.1.0/os/schemas/sarif-schema-2.1.0.json"
_FINGERPRINT = "primaryLocationLineHash"
_LEVEL = {"error": "error", "warning": "warning", "info": "note"}
_EVENT_RULES = {
    "policy-broken": ("error", "The log breaks the policy it was audited against."),
    "not-judged": ("warning", "The log could not be judged."),
    "left-out": ("note", "A file beside the logs was not judged."),
    "contact": ("error", "Alarms that belong together: the arm was touched."),
}


def sarif_text(results: Sequence[AuditResult], unread: Sequence[IndexEntry] = (), night: NightFacts = QUIET) -> str:
    """A SARIF log with one run: what breaks the policy, or lets one doubt whether it is kept; a pass is no result.

    Whoever keeps results from night to night knows one again by its fingerprint: of rule, log, joints, and how many
    such came before it in the log, but of no measured value. Its name is the one that GitHub looks at.

    Args:
        results: the audits.
        unread: logs that could not be audited, and files that count as such.
        night: limits that are broken over all logs, and files that are only named.
    """
    found = [item for result in results if result.verdict != "pass" for item in _results(result)]
    found += [_result("not-judged", "warning", entry.error or "", entry.name) for entry in unread]
    found += [_result("policy-broken", "error", text, "night") for text in night.breaches]
    found += [_result("left-out", "note", file.text, file.name) for file in night.named]
    _count_fingerprints(found)
    version = results[0].provenance.collaudit if results else None
    driver: dict[str, Any] = {"name": "collaudit", "rules": _rules({one["ruleId"] for one in found})}
    if version is not None:
        driver["version"] = version
    logs = [result.log for result in results]
    run = {
        "tool": {"driver": driver},
        "artifacts": [{"location": {"uri": _uri(log.name)}, "hashes": {"sha-256": log.sha256}} for log in logs],
        "results": found,
        "columnKind": "unicodeCodePoints",
    }
    return json_text({"$schema": _SCHEMA, "version": _VERSION, "runs": [run]})


def _rules(used: set[str]) -> list[dict[str, Any]]:
    events = [_rule(name, level, text) for name, (level, text) in _EVENT_RULES.items()]
    return events + [_rule(code, "note", text) for code, text in CODES.items() if code in used]


def _rule(name: str, level: str, text: str) -> dict[str, Any]:
    return {"id": name, "shortDescription": {"text": text}, "defaultConfiguration": {"level": level}}


def _results(result: AuditResult) -> Iterator[dict[str, Any]]:
    """The verdict, the contacts of a failed log, and the findings that forbid a pass or doubt alarms."""
    log = result.log.name
    rule = "policy-broken" if result.verdict == "fail" else "not-judged"
    yield _result(rule, _EVENT_RULES[rule][0], "; ".join(result.reasons), log)
    said = "{joints}: {state} contact at {onset} for {lasted}, highest residual {highest residual} (γ {γ}) on {joint}"
    contacts = result.contacts if result.verdict == "fail" else ()
    for contact, record in zip(contacts, contact_section(result).records, strict=False):
        yield _result("contact", "error", said.format_map(record), log, contact.joints, plain(contact))
    for finding in worst_first(result.findings):
        if finding.forbids_pass or finding.doubts_alarms:
            about = () if finding.joint is None else (finding.joint,)
            text = "".join(f"{joint}: " for joint in about) + finding.text
            yield _result(finding.code, _LEVEL[finding.severity], text, log, about, plain(finding))


def _result(
    rule: str, level: str, text: str, log: str, joints: Sequence[str] = (), properties: Json = None
) -> dict[str, Any]:
    message = "\n".join(visible(line) for line in text.splitlines()) or rule
    about = "\n".join((rule, log, *joints)).encode("utf-8", "backslashreplace")
    made: dict[str, Any] = {
        "ruleId": rule,
        "level": level,
        "message": {"text": message},
        "locations": [{"physicalLocation": {"artifactLocation": {"uri": _uri(log)}}}],
        "partialFingerprints": {_FINGERPRINT: hashlib.sha256(about).hexdigest()[:32]},
    }
    if properties is not None:
        made["properties"] = properties
    return made


def _count_fingerprints(found: Sequence[dict[str, Any]]) -> None:
    """Tell apart what is alike but for its place in the log."""
    seen: Counter[str] = Counter()
    for one in found:
        own = one["partialFingerprints"][_FINGERPRINT]
        seen[own] += 1
        one["partialFingerprints"][_FINGERPRINT] = f"{own}:{seen[own]}"


def _uri(name: str) -> str:
    """The log's name as a relative URI reference that leads nowhere else."""
    parts = [part for part in name.split("/") if part not in ("", ".", "..")]
    return "/".join(quote(part.encode("utf-8", "surrogateescape"), safe="+,=@") for part in parts)
