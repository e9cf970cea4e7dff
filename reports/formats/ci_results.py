"""What CI servers read: JUnit XML, a suite a robot and a test case a log; SARIF 2.1.0, results about logs.

A case's class is robot and folders; its time is that of the recording, so that the same audit gives the same bytes and
a case that becomes short shows. What would have been noticed stands in the properties of the suite, since the schema of
Jenkins has none in a case: ``LOG: torque_alarms_JOINT`` and ``LOG: force_alarms_PLACE``, with the unit in the value.
A result of SARIF is what breaks the policy or lets one doubt it.
"""

from __future__ import annotations

import hashlib
from collections import Counter
from collections.abc import Iterator, Sequence
from typing import Any, assert_never
from urllib.parse import quote
from xml.etree import ElementTree

from collaudit.core.data.audit_result import AuditResult
from collaudit.core.findings import CODES
from collaudit.reports.files.written_files import Json, json_text, plain
from collaudit.reports.sections.event_sections import contact_section
from collaudit.reports.sections.finding_sections import worst_first
from collaudit.reports.sections.judged_sections import force_section, judged_section
from collaudit.reports.sections.section import Section
from collaudit.reports.terminal.screen_text import audit_text
from collaudit.reports.values.entries import IndexEntry, entry_of
from collaudit.reports.values.night import QUIET, NightFacts
from collaudit.reports.values.visible_text import visible

#: Suite, and class, of logs that no robot or folder is known of.
_NO_ROBOT = "collaudit"
#: A log: its line, what is told of it, what would have been noticed, and how long it is, s.
_Log = tuple[IndexEntry, str, Sequence[tuple[str, str]], float]


def junit_text(results: Sequence[AuditResult], unread: Sequence[IndexEntry] = (), night: NightFacts = QUIET) -> str:
    """JUnit XML of audits.

    A broken policy is a failure. What was not judged is an error, with its reasons, and so is a log that could not be
    read: CI servers show a skipped test as harmless, and a log that nobody could judge is not.

    Args:
        results: the audits.
        unread: logs that could not be audited, and files that count as such.
        night: a limit that is broken over all logs is a failure; a file that is only named is skipped.
    """
    suites = ElementTree.Element("testsuites", name="collaudit")
    every = [(entry_of(one), audit_text(one), _sensitivity(one), one.log.duration_s) for one in results]
    every += [(entry, entry.error or "", [], 0.0) for entry in unread]
    robots = [entry.robot or night.robots.get(entry.name) for entry, *_ in every]
    for robot in sorted(set(robots), key=lambda name: name or ""):
        _suite(suites, robot or _NO_ROBOT, [log for log, own in zip(every, robots, strict=True) if own == robot])
    _night(suites, night)
    for name in ("tests", "failures", "errors"):
        suites.set(name, str(sum(int(suite.get(name, "0")) for suite in suites)))
    ElementTree.indent(suites)
    return '<?xml version="1.0" encoding="utf-8"?>\n' + ElementTree.tostring(suites, encoding="unicode") + "\n"


def _night(suites: ElementTree.Element, night: NightFacts) -> None:
    """What is no log's own: a suite where there is anything to say."""
    if not (night.breaches or night.named):
        return
    suite = ElementTree.SubElement(suites, "testsuite", name="night", tests=str(len(night.breaches) + len(night.named)))
    for name, count in (("failures", len(night.breaches)), ("errors", 0), ("skipped", len(night.named))):
        suite.set(name, str(count))
    for text in night.breaches:
        case = ElementTree.SubElement(suite, "testcase", classname="collaudit.night", name=visible(text))
        ElementTree.SubElement(case, "failure", type="policy", message=visible(text))
    for file in night.named:
        case = ElementTree.SubElement(suite, "testcase", classname="collaudit.left-out", name=visible(file.name))
        ElementTree.SubElement(case, "skipped", message=visible(f"not judged: {file.text}"))


def _suite(suites: ElementTree.Element, robot: str, logs: Sequence[_Log]) -> None:
    """The logs of one robot."""
    verdicts = Counter(entry.verdict for entry, *_ in logs)
    suite = ElementTree.SubElement(suites, "testsuite", name=visible(robot), tests=str(len(logs)))
    for name, count in (("failures", verdicts["fail"]), ("errors", verdicts["not_judged"]), ("skipped", 0)):
        suite.set(name, str(count))
    suite.set("time", _time(sum(duration_s for *_, duration_s in logs)))
    stated = [
        (f"{visible(entry.name)}: {name}", value)
        for entry, _, sensitivity, _ in logs
        for name, value in (*_properties(entry), *sensitivity)
    ]
    if stated:
        properties = ElementTree.SubElement(suite, "properties")
        for name, value in stated:
            ElementTree.SubElement(properties, "property", name=name, value=value)
    for entry, details, _, duration_s in logs:
        _case(suite, entry, details, duration_s)


def _case(suite: ElementTree.Element, entry: IndexEntry, details: str, duration_s: float) -> None:
    folders = visible(entry.name).rpartition("/")[0].replace("/", ".") or _NO_ROBOT
    case = ElementTree.SubElement(
        suite, "testcase", classname=folders, name=visible(entry.name), time=_time(duration_s)
    )
    reasons = visible("; ".join(entry.reasons)) or "no reason was recorded"
    body = "\n".join(visible(line) for line in details.splitlines())
    match entry.verdict:
        case "fail":
            ElementTree.SubElement(case, "failure", type="policy", message=reasons).text = body
        case "not_judged":
            problem = ElementTree.SubElement(case, "error", type="not-judged", message=f"not judged: {reasons}")
            problem.text = body
        case "pass":
            head = "".join(f"excluded: {visible(text)}\n" for text in entry.exclusions)
            ElementTree.SubElement(case, "system-out").text = head + body
        case _:
            assert_never(entry.verdict)


def _time(duration_s: float) -> str:
    return f"{duration_s:.3f}"


def _properties(entry: IndexEntry) -> list[tuple[str, str]]:
    """Counts of a log, and what would have been noticed in it."""
    shown = [("contacts", entry.counted(entry.contacts)), ("near_misses", entry.counted(entry.near_misses))]
    if entry.noticed:
        shown.append(("would_have_noticed", visible(entry.noticed)))
    return shown if entry.counts_mean_something else []


def _sensitivity(result: AuditResult) -> list[tuple[str, str]]:
    """Per joint the torque, per place the force that would have alarmed, and for how much of the time."""
    if result.sensitivity is None:
        return []
    return [*_named("torque_alarms", judged_section(result)), *_named("force_alarms", force_section(result))]


def _named(name: str, found: Section) -> Iterator[tuple[str, str]]:
    """A property a row."""
    for place, *values in found.rows:
        text = "; ".join(f"{term} {value}" for term, value in zip(found.columns[1:], values, strict=True) if value)
        yield f"{name}_{visible(place).removesuffix(' (forearm)').replace(' ', '_')}", text


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
