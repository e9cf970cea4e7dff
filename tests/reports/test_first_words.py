"""What a reader must know first: contacts on a fail, the noticed push on a pass, what is missing where not judged."""

from __future__ import annotations

from dataclasses import replace

import pytest
import samples

from collaudit.core.data.audit_result import AuditResult
from collaudit.core.data.detection_result import AfterContact
from collaudit.core.data.sensitivity_result import ForceLevel, ForceTime, NoticedForce, Sensitivity
from collaudit.core.findings import Finding
from collaudit.reports.formats.night_texts import escaped, markdown_text
from collaudit.reports.page.html import html_text
from collaudit.reports.terminal.screen_text import screen_text
from collaudit.reports.values.first_words import MOST_WORDS, _fitting, first_lines

TOOL = NoticedForce("tool", "link6", "tool0", samples.JOINTS, (ForceLevel(0.9, 61.2),), 0.0)
SENSITIVITY = Sensitivity({}, (TOOL,), ForceTime(0.2, 0.9, True, 100.0))


def _words(result: AuditResult) -> int:
    return sum(len(line.split()) for line in first_lines(result))


def _busy() -> AuditResult:
    result = samples.busy(3).result
    after = AfterContact("stopped", 0.25, "transient", 0.4, 0.0, 0.08, 0.32, 0.041)
    contacts = tuple(replace(contact, id=f"a{k}", after=after) for k, contact in enumerate(result.contacts))
    return replace(result, contacts=contacts, sensitivity=SENSITIVITY, reasons=("3 contacts (policy: at most 0).",))


def test_a_fail_begins_with_its_contacts() -> None:
    result = _busy()
    count, first, *others = first_lines(result)
    assert count == result.reasons[0]
    for words in (
        "22:05:08.250 UTC",
        "wrist_1_link or further out",
        "shoulder_lift at 1.55 γ",
        "11 to 54 N",
        "alarm after 26 ms",
    ):
        assert words in first
    assert "the tool stopped after 320 ms and 41.0 mm, slowing from 80 ms on" in first
    assert "slowing from 80 ms on; transient (250 ms above γ)." in first
    assert any(line.startswith("Would have noticed") for line in others)
    assert others[-1].startswith("Next: ") and "collaudit accept OUT a" in others[-1]


def test_a_pass_begins_with_the_push_and_then_says_what_it_does_not_cover() -> None:
    noticed = "Would have noticed a push (200 ms) of 62 N at the tool, in 90 % of the moving time."
    reason = f"0 contacts in 60 s, within the policy. {noticed}"
    result = replace(
        samples.passed().result, sensitivity=SENSITIVITY, reasons=(reason,), exclusions=("Gaps in the log: 3 s.",)
    )
    first, found, excluded, *_ = first_lines(result)
    assert first == noticed
    assert found == "0 contacts in 60 s, within the policy."
    assert excluded == "Not covered: Gaps in the log: 3 s."


def test_a_log_that_was_not_judged_says_what_is_missing_and_what_mends_it() -> None:
    missing = Finding("time-gap", "warning", "gaps of 3 s")
    result = replace(samples.not_judged().result, findings=(missing,), reasons=("gaps of 3 s forbid a verdict",))
    first, *_, last = first_lines(result)
    assert first == "gaps of 3 s forbid a verdict"
    assert last == f"Next: {missing.kind.remedy}"


@pytest.mark.parametrize("make", [samples.failed, samples.passed, samples.not_judged, samples.hostile, samples.busy])
def test_it_is_short_whatever_there_is_to_say(make) -> None:  # type: ignore[no-untyped-def]
    result = make().result
    assert _words(result) <= MOST_WORDS
    long = replace(result, reasons=("many words " * 90, *(f"reason {k} of many" for k in range(60))))
    assert _words(long) <= MOST_WORDS
    assert "More statements below: " in " ".join(first_lines(long))


def test_page_terminal_and_markdown_say_the_same() -> None:
    result = _busy()
    page = html_text([replace(samples.busy(3), result=result)])
    terminal, markdown = screen_text(result), markdown_text([result])
    for line in first_lines(result):
        assert f"  - {line}\n" in terminal
        assert f"- {escaped(line)}\n" in markdown
        assert f">{line}</p>" in page
    assert page.index(first_lines(result)[1]) < page.index('class="facts"') < page.index("<nav")


def test_contacts_that_are_not_told_are_counted_as_contacts() -> None:
    result = _busy()
    many = replace(result, contacts=tuple(replace(result.contacts[0], id=f"b{k}") for k in range(24)))
    long = replace(many, reasons=(f"24 contacts, {'on every joint ' * 8}", "a reason", "another"))
    lines = first_lines(long)
    assert "23 more contacts: below." in lines
    assert _words(long) <= MOST_WORDS


def test_a_long_cause_leaves_room_for_what_happened() -> None:
    long = " ".join(["cause"] * 140)
    first, *_, cause = _fitting(["1 contact of the arm, new, at 12.3 s, on the elbow."], ["and more"], [long])
    assert first == "1 contact of the arm, new, at 12.3 s, on the elbow." and cause.endswith("…")
