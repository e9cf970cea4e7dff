"""JUnit XML: a suite a robot, a test case a log.

A case's class is robot and folders; its time is that of the recording, so that the same audit gives the same bytes and
a case that becomes short shows. What would have been noticed stands in the properties of the suite, since the schema of
Jenkins has none in a case: ``LOG: torque_alarms_JOINT`` and ``LOG: force_alarms_PLACE``, with the unit in the value.
"""

from __future__ import annotations

from collections import Counter
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
