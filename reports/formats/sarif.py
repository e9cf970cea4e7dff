"""SARIF 2.1.0: collisions, near misses, findings and what was not judged, as results about a log."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Sequence
from typing import Any
from urllib.parse import quote

from collaudit.core.data.audit_result import AuditResult
from collaudit.core.findings import CODES, Finding
from collaudit.reports.files.json_writer import Json, json_text, plain
from collaudit.reports.values import rows
from collaudit.reports.values.contact_rows import contact_row, contacts_of
from collaudit.reports.values.entries import IndexEntry
from collaudit.reports.values.visible_text import visible

_VERSION = "2.1.0"
_SCHEMA = "https://docs.oasis-open.org/sarif/sarif/v2.1.0/os/schemas/sarif-schema-2.1.0.json"
_LEVEL = {"error": "error", "warning": "warning", "info": "note"}
_EVENT_RULES = {
    "contact": ("error", "Alarms that belong together: the arm was touched."),
    "collision": ("note", "The residual exceeded its threshold for n samples in a row."),
    "near-miss": ("warning", "The residual came close to its threshold, or exceeded it too briefly."),
    "policy-broken": ("error", "The log breaks the policy it was audited against."),
    "not-judged": ("warning", "The log could not be judged."),
}


def sarif_text(results: Sequence[AuditResult], unread: Sequence[IndexEntry] = ()) -> str:
    """A SARIF log with one run.

    Args:
        results: the audits.
        unread: logs that could not be audited.
    """
    found = [item for result in results for item in _results(result)]
    found += [_result("not-judged", "warning", entry.error or "", entry.name) for entry in unread]
    version = results[0].provenance.collaudit if results else None
    driver: dict[str, Any] = {"name": "collaudit", "rules": _rules()}
    if version is not None:
        driver["version"] = version
    run = {
        "tool": {"driver": driver},
        "artifacts": [_artifact(result) for result in results],
        "results": found,
        "columnKind": "unicodeCodePoints",
    }
    return json_text({"$schema": _SCHEMA, "version": _VERSION, "runs": [run]})


def _rules() -> list[dict[str, Any]]:
    events = [_rule(name, level, text) for name, (level, text) in _EVENT_RULES.items()]
    return events + [_rule(code, "note", text) for code, text in CODES.items()]


def _rule(name: str, level: str, text: str) -> dict[str, Any]:
    return {"id": name, "shortDescription": {"text": text}, "defaultConfiguration": {"level": level}}


def _artifact(result: AuditResult) -> dict[str, Any]:
    return {"location": {"uri": _uri(result.log.name)}, "hashes": {"sha-256": result.log.sha256}}


def _results(result: AuditResult) -> Iterator[dict[str, Any]]:
    """The verdict when it is not a pass, then the events, then the findings."""
    log = result.log.name
    if result.verdict != "pass":
        rule = "policy-broken" if result.verdict == "fail" else "not-judged"
        yield _result(rule, _EVENT_RULES[rule][0], "; ".join(result.reasons), log)
    for contact in contacts_of(result):
        row = contact_row(contact, result)
        text = f"{row.joints}: contact at {row.onset} for {row.lasted}, highest residual {row.worst}"
        yield _result("contact", "error", text, log, properties=plain(contact))
    for hit in rows.in_time(result.collisions):
        r = rows.collision_row(hit, result)
        text = f"{hit.joint}: alarm at {r.onset}, peak {r.peak}, threshold {r.gamma}, above it for {r.lasted}"
        yield _result("collision", "note", text, log, properties=plain(hit))
    for near in rows.in_time(result.near_misses):
        n = rows.near_miss_row(near, result)
        text = f"{near.joint}: near miss at {n.onset}, peak {n.peak}, threshold {n.gamma}, {n.closeness}"
        yield _result("near-miss", "warning", text, log, properties=plain(near))
    for finding in rows.worst_first(result.findings):
        yield _finding(finding, result)


def _finding(finding: Finding, result: AuditResult) -> dict[str, Any]:
    about = f"{finding.joint}: " if finding.joint else ""
    text = about + finding.text
    return _result(finding.code, _LEVEL[finding.severity], text, result.log.name, properties=plain(finding))


def _result(rule: str, level: str, text: str, log: str, properties: Json = None) -> dict[str, Any]:
    message = "\n".join(visible(line) for line in text.splitlines()) or rule
    print_of = hashlib.sha256(f"{rule}\n{log}\n{message}".encode("utf-8", "backslashreplace")).hexdigest()
    made: dict[str, Any] = {
        "ruleId": rule,
        "level": level,
        "message": {"text": message},
        "locations": [{"physicalLocation": {"artifactLocation": {"uri": _uri(log)}}}],
        "partialFingerprints": {"collaudit/v1": print_of},
    }
    if properties is not None:
        made["properties"] = properties
    return made


def _uri(name: str) -> str:
    """The log's name as a relative URI reference."""
    return quote(name.encode("utf-8", "surrogateescape"), safe="+,=@")
