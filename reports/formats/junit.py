"""JUnit XML: one test case per log.

What would have been noticed stands in the properties of a case: the verdict's body is for people, and some CI servers
cut it. Names are ``torque_alarms_JOINT`` and ``force_alarms_PLACE``, each with its unit in the value.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import assert_never
from xml.etree import ElementTree

from collaudit.core.data.audit_result import AuditResult
from collaudit.reports.sections.judged_sections import force_section, judged_section
from collaudit.reports.sections.section import Section
from collaudit.reports.terminal.screen_text import audit_text
from collaudit.reports.values.entries import IndexEntry, entry_of
from collaudit.reports.values.night import QUIET, NightFacts
from collaudit.reports.values.visible_text import visible


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
    for result in results:
        _suite(suites, entry_of(result), audit_text(result), _sensitivity(result))
    for entry in unread:
        _suite(suites, entry, entry.error or "")
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


def _suite(
    suites: ElementTree.Element, entry: IndexEntry, details: str, sensitivity: Sequence[tuple[str, str]] = ()
) -> None:
    """One log: a suite with its properties, for that is where the schema of Jenkins has them, and one test case."""
    suite = ElementTree.SubElement(suites, "testsuite", name=visible(entry.name), tests="1")
    suite.set("failures", str(int(entry.verdict == "fail")))
    suite.set("errors", str(int(entry.verdict == "not_judged")))
    suite.set("skipped", "0")
    stated = (*_properties(entry), *sensitivity)
    if stated:
        properties = ElementTree.SubElement(suite, "properties")
        for name, value in stated:
            ElementTree.SubElement(properties, "property", name=name, value=value)
    case = ElementTree.SubElement(suite, "testcase", classname="collaudit", name=visible(entry.name))
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
