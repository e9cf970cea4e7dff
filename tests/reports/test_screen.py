"""One screen an audit: contacts before alarms, what would have been noticed, what the verdict leaves out."""

from __future__ import annotations

from dataclasses import replace
from xml.etree import ElementTree

import samples

from collaudit.core.data.audit_result import AuditResult
from collaudit.core.data.detection_result import Contact, ContactForce, LeastForce, LinkForce
from collaudit.core.data.sensitivity_result import (
    AskedForce,
    AskedTorque,
    ForceLevel,
    ForceTime,
    JointSensitivity,
    NoticedForce,
    Sensitivity,
    TorqueLevel,
)
from collaudit.core.findings import Finding
from collaudit.reports.formats.ci_results import junit_text
from collaudit.reports.formats.night_texts import markdown_text
from collaudit.reports.page.html import html_text
from collaudit.reports.page.index import summarise
from collaudit.reports.sections.judged_sections import judged_section
from collaudit.reports.terminal.command_texts import summary_table
from collaudit.reports.terminal.screen_text import audit_text, important_findings, screen_text
from collaudit.reports.values.entries import entry_of
from collaudit.reports.values.first_words import force_text, link_forces_text, lost_line

JOINT = samples.JOINTS[0]
FORCES = (ForceLevel(0.5, 34.0), ForceLevel(0.9, 61.3), ForceLevel(0.95, None))
ASKED = AskedForce(100.0, "default", 0.94, 94.0, 6.0, 0.5, "elbow")
LEVELS = (TorqueLevel(0.5, 4.7), TorqueLevel(0.95, None))


def with_contacts(count: int) -> AuditResult:
    """An audit of many alarms that are fewer contacts."""
    result = samples.many_events(3 * count).result
    contacts = tuple(
        Contact(float(k), k + 0.1, k + 0.5, samples.JOINTS[:2], "forearm", "", None, "undecided", ("it rose fast",))
        for k in range(count)
    )
    sensitivity = Sensitivity(
        {JOINT: JointSensitivity(LEVELS, 20.004, 50.0, 48.0, AskedTorque(20.0, 0.57, 57.0, 38.0, 12.0))},
        (NoticedForce("tool", "link6", "tool0", samples.JOINTS, FORCES, 0.0, ASKED),),
        ForceTime(0.2, 0.9, True, 100.0),
    )
    return replace(result, contacts=contacts, exclusions=("Gaps in the log: 3 s.",), sensitivity=sensitivity)


def test_a_screen_stays_one_however_many_alarms_there_are() -> None:
    result = with_contacts(200)
    text = screen_text(result, 110, "-v")
    assert len(result.collisions) == 600
    assert len(text.splitlines()) < 50
    assert "Contacts (200, the 3 highest)" in text
    assert "Gaps in the log: 3 s." in text
    assert " 20.004" in text, "not rounded to what was asked"
    assert "Smallest torque that would have alarmed" in text
    assert "Would have noticed a push (200 ms) of 62 N at the tool, in 90 % of the moving time." in text
    assert "from 80 % of the directions, in 90 % of the moving time: tool 62 N" in text
    assert "More: -v" in text
    whole = audit_text(result)
    assert len(whole.splitlines()) > 800
    assert "it rose fast" in whole


def test_every_report_counts_contacts() -> None:
    result = with_contacts(7)
    entry = entry_of(result)
    assert (entry.contacts, entry.collisions, entry.noticed_n, entry.noticed) == (7, 21, 61.3, "62 N at the tool")
    assert summarise([entry, entry]).contacts == 14
    assert summary_table([entry]).splitlines()[2].split("  ")[0] == "FAIL"
    assert " 62 N at the tool " in summary_table([entry])
    page = html_text([replace(samples.many_events(21), result=result)])
    assert "Contacts (7)" in page and "62 N" in page and "Gaps in the log: 3 s." in page
    text = markdown_text([result])
    assert "| 62 N at the tool | 7 |" in text
    assert "| tool | 34 N | 62 N | no force | 100 N (default) | 94.0 % of the time |" in text
    suite = ElementTree.fromstring(junit_text([result])).find("testsuite")
    assert suite is not None
    shown = {
        (p.get("name") or "").partition(": ")[2]: p.get("value") or "" for p in suite.findall("properties/property")
    }
    torques = (
        "alarms 50 % of the time 4.70 N·m; 95 % of the time –; at any judged moment 20.004 N·m; "
        "asked 20 N·m: 57.0 % of its motion"
    )
    assert torques in shown["torque_alarms_shoulder_pan"]
    forces = "in 50 % 34 N; in 90 % 62 N; in 95 % no force; asked 100 N (default)"
    assert shown["force_alarms_tool"].startswith(forces)
    assert {name: value for name, value in shown.items() if "_alarms_" not in name} == {
        "contacts": "7",
        "near_misses": str(len(result.near_misses)),
        "would_have_noticed": "62 N at the tool",
    }


def test_a_pass_with_exclusions_says_so_everywhere() -> None:
    passed = samples.passed()
    excluded = replace(passed.result, exclusions=("Gaps in the log: 3 s.",))
    for text in (
        screen_text(excluded),
        audit_text(excluded),
        summary_table([entry_of(excluded)]),
        markdown_text([excluded]),
        html_text([replace(passed, result=excluded)]),
        junit_text([excluded]),
    ):
        assert "PASS, WITH EXCLUSIONS" in text
        assert "Gaps in the log: 3 s." in text
    assert "WITH EXCLUSIONS" not in screen_text(passed.result)


def test_what_matters_comes_first_and_each_kind_once() -> None:
    found = (
        Finding("friction-level", "info", "not worth a line"),
        Finding("coverage-low", "warning", "said in the reasons"),
        Finding("residual-level", "warning", "one", joint="a"),
        Finding("residual-level", "warning", "two", joint="b"),
        Finding("event-cut", "warning", "a contact may have been cut off"),
        Finding("time-gap", "warning", "gaps"),
    )
    result = replace(samples.passed().result, findings=found, reasons=("said in the reasons",))
    assert [(f.code, count) for f, count in important_findings(result)] == [
        ("event-cut", 1),
        ("residual-level", 2),
        ("time-gap", 1),
    ]


def test_where_nothing_was_judged_the_cause_comes_before_what_follows_from_it() -> None:
    found = (
        Finding("fit-doubtful", "warning", "a has no friction", joint="a"),
        Finding("model-approximate", "warning", "no robot"),
    )
    result = replace(samples.passed().result, findings=found)
    assert [f.code for f, _ in important_findings(result)] == ["fit-doubtful", "model-approximate"]
    idle = {j: replace(c, judged_s=0.0, standing_s=0.0) for j, c in result.coverage.joints.items()}
    result = replace(result, coverage=replace(result.coverage, joints=idle))
    assert [f.code for f, _ in important_findings(result)] == ["model-approximate", "fit-doubtful"]


def test_shares_and_levels_of_a_joint() -> None:
    row = next(record for record in judged_section(with_contacts(1)).records if record["joint"] == JOINT)
    assert row["asked"] == "20 N·m: 57.0 % of its motion"
    told = tuple(row[name] for name in ("alarms 50 % of the time", "95 % of the time", "at any judged moment"))
    assert told == ("4.70 N·m", "–", "20.004 N·m")
    assert "asked" not in judged_section(samples.passed().result).columns


def test_time_without_watch_is_time_not_judged() -> None:
    result = with_contacts(1)
    cover = replace(result.coverage.joints[JOINT], watched=True, not_judged_s={"not-watched": 100.0})
    coverage = replace(result.coverage, joints={**result.coverage.joints, JOINT: cover})
    assert lost_line(replace(result, coverage=coverage)).startswith(f"Not judged, of the log: {JOINT} ")
    assert not lost_line(result).startswith(f"Not judged, of the log: {JOINT} "), "force control is not judged"


def test_a_force_without_a_lower_bound_has_no_size() -> None:
    one = ContactForce("link", None, (2.0, None, None), None, (0.0, None), ((0.0, 1.0, 0.0),), 0.1)
    assert force_text(one) == "not determinable"
    assert force_text(one, LeastForce(33.7, "a", 0.5)) == "at least 33 N"
    assert force_text(replace(one, size_ci95_n=(30.0, None))) == "at least 30 N", "the rest is in blind directions"
    assert force_text(replace(one, size_ci95_n=(30.0, 143.0), blind=())) == "30 to 143 N"
    links = (LinkForce("a", "joint1", 30.4, None), LinkForce("b", "joint2", 45.0, 80.2), LinkForce("c", "j", 0.2, None))
    by_link = link_forces_text(replace(one, links=links))
    assert by_link == "if on a: at least 30 N; if on b: 45 to 80 N; if on c: not determinable"
    assert force_text(None) == "unknown"


def test_the_page_calls_alarms_alarms() -> None:
    audit = samples.many_events(6)
    text = html_text([audit])
    assert "<dt>Alarms</dt>" in text
    assert "Collision 1" not in text
    assert "away from collisions" not in text


def test_shares_of_a_joint_have_one_denominator() -> None:
    """What the table gives of a joint in per cent its reasons give in seconds, and the first screen says it too."""
    result = with_contacts(1)
    cover = replace(
        result.coverage.joints[JOINT],
        watched=True,
        judged_s=60.0,
        standing_s=20.0,
        not_judged_s={"not-watched": 15.0, "edge": 5.0},
    )
    result = replace(result, coverage=replace(result.coverage, joints={JOINT: cover}))
    found = judged_section(result)
    (row,) = found.records
    assert (row["judged"], row["friction as a range"], row["not judged"]) == ("60.0 %", "20.0 %", "20.0 %")
    assert lost_line(result) == f"Not judged, of the log: {JOINT} 20.0 %."
    assert "not judged, of 100 s, 15.0 s" in " ".join(found.notes)
