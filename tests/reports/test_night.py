"""A night that people read: its sentence, a line a log, the nights before, and a summary that fits a CI server."""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
import samples
from browser import axe_source, launched, violations
from histories import history

from collaudit.core.errors import LogError
from collaudit.core.history.night_groups import Moment, NightGroup
from collaudit.reports.formats.registry import summary_text
from collaudit.reports.page.index import write_index
from collaudit.reports.values.entries import IndexEntry, entry_of, entry_of_error, nights_before
from collaudit.reports.values.night import QUIET, night_sentence

EXCLUSIONS = tuple(
    f"Joint {k} was not judged for {k} s of its motion, since friction is not known there." for k in range(1, 11)
)


GROUP = NightGroup(
    robot="B",
    joints=("joint2", "joint3"),
    cause="",
    text="",
    place_m=(0.4, 0.0, 0.5),
    state="flaky",
    since="2026-11-20",
    nights=4,
    logs=("B/cell0/run3.mcap", "B/cell2/run5.mcap"),
    moments=(Moment("B/cell0/run3.mcap", 42.0, "2026-11-25T03:10:00Z"),),
)
GONE = replace(GROUP, state="gone", moments=())


def night(logs: int) -> list[IndexEntry]:
    """Logs of two robots; of B two have contacts, one of them new; one log cannot be read."""
    quiet = replace(entry_of(samples.passed(2000).result, "run/report.html"), exclusions=EXCLUSIONS)
    touched = entry_of(samples.failed(2000).result, "run/report.html")
    out = []
    for k in range(logs - 1):
        robot = "AB"[k % 2]
        entry = replace(quiet if k not in (3, 5) else touched, robot=robot, name=f"{robot}/cell{k % 3}/run{k}.mcap")
        states = {"new": 1, "known": entry.contacts - 1} if k == 3 else {"known": entry.contacts}
        entry = replace(entry, contact_states=states if entry.contacts else {})
        out.append(replace(entry, start=f"2026-11-25T0{k % 5}:10:00Z"))
    return [*out, replace(entry_of_error("A/cell1/cut.mcap", LogError("cut short")), robot="A")]


def test_a_night_in_a_sentence() -> None:
    said = night_sentence(night(42))
    contacts = sum(entry.contacts for entry in night(42))
    assert (
        said
        == f"41 of 42 logs judged; 2 break the policy; {contacts} contacts on robot B (1 new, {contacts - 1} known)."
    )
    plain = [
        replace(entry, robot=None, contact_states={"new": entry.contacts} if entry.contacts else {})
        for entry in night(42)
    ]
    assert night_sentence(plain) == f"41 of 42 logs judged; 2 break the policy; {contacts} contacts."
    calm = [entry for entry in night(42) if not entry.contacts and not entry.error]
    assert night_sentence(calm) == f"{len(calm)} of {len(calm)} logs judged; no contact."
    assert night_sentence(night(42)[-1:]) == "0 of 1 log judged."


def test_the_nights_before_are_of_the_log_of_that_name_and_robot() -> None:
    rows = [row for row in history("A", 20) if row.joint == "j1"]
    named = [replace(r, log="A/run.mcap", verdict="fail" if k == 18 else "pass") for k, r in enumerate(rows)]
    others = [replace(r, log="A/other.mcap", log_sha256=f"{k}") for k, r in enumerate(rows)]
    before = nights_before({"A/run.mcap": named[-1:]}, [*named, *others, *history("B", 20)])
    assert len(before["A/run.mcap"]) == 14 and before["A/run.mcap"][-3:] == ["pass", "fail", "pass"]


def test_the_summary_fits_a_ci_servers_page() -> None:
    many = [samples.passed(500).result] * 30 + [samples.failed(500).result] * 12
    text = summary_text(many, "markdown")
    assert len(text.split()) <= 400 and text.count("\n| ---") == 1
    assert text.splitlines()[2].startswith("42 of 42 logs judged; 12 break the policy; ")
    assert sum(line.startswith("| ❌ FAIL") for line in text.splitlines()) == 12 and "PASS" not in text
    assert len(summary_text([samples.failed(500).result] * 500, "markdown").split()) <= 400


@pytest.fixture(scope="module")
def axe(tmp_path_factory: pytest.TempPathFactory) -> str:
    return axe_source(tmp_path_factory.mktemp("axe"))


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """The index of 42 logs in a real Chromium."""
    from playwright.sync_api import sync_playwright

    folder = tmp_path_factory.mktemp("night")
    before = {e.name: ["fail" if k == 20 else "pass" for k in range(12, 26)] for e in night(42)}
    write_index(folder / "42", night(42), replace(QUIET, groups=(GROUP, GONE)), before)
    write_index(folder / "1000", night(1000), QUIET, before)
    with sync_playwright() as playwright:
        browser = launched(playwright)
        opened = browser.new_page(viewport={"width": 1280, "height": 900})
        opened.folder = folder
        opened.goto((folder / "42" / "index.html").as_uri())
        yield opened
        browser.close()


def test_a_log_is_a_line(page: Any) -> None:
    page.set_viewport_size({"width": 1280, "height": 900})
    heights = page.evaluate("Array.from(document.querySelectorAll('#logs tbody tr'), (r) => r.offsetHeight)")
    assert len(heights) == 42 and max(heights) < 40
    assert page.evaluate("document.documentElement.scrollHeight") <= 2500
    assert len(page.inner_text("body").split()) < 1200
    row = page.inner_text("#logs tbody tr:first-child").split()
    assert row[:4] == ["FAIL", "B", "cell0/run3.mcap", "2026-11-25"]
    assert page.locator("#logs tbody tr:first-child svg.nights path").count() == 2
    assert page.locator("#logs th[scope=row] a").count() == 41
    unread = page.inner_text("#logs tbody tr[data-verdict=not_judged]").split()
    assert unread[:8] == ["NOT", "JUDGED", "A", "cell1/cut.mcap", "–", "–", "–", "–"], "no 0 beside NOT JUDGED"


def test_what_fails_stands_above_the_logs(page: Any) -> None:
    page.set_viewport_size({"width": 1280, "height": 900})
    rows = page.locator("main table").first.locator("tbody tr")
    assert rows.count() == 2
    assert rows.first.inner_text().split()[:5] == ["flaky", "B", "contact", "of", "joint2,"]
    assert "B/cell0/run3.mcap, B/cell2/run5.mcap" in rows.first.inner_text()
    assert rows.first.bounding_box()["y"] < page.locator("#logs").bounding_box()["y"]


@pytest.mark.parametrize("width", [390, 1280, 1920])
def test_long_names_are_cut_in_the_middle(page: Any, tmp_path: Path, width: int) -> None:
    ends = ("50sec.csv", "50secLoad.csv")
    names = [f"A/cell1/moving_arm_{'mounted_' * 6}{end}" for end in ends]
    write_index(tmp_path, [replace(night(3)[0], robot="A", name=name) for name in names])
    page.set_viewport_size({"width": width, "height": 900})
    page.goto((tmp_path / "index.html").as_uri())
    for end, cell in zip(ends, page.locator("#logs tbody th").all(), strict=True):
        tail = cell.locator("span").last
        assert tail.inner_text().endswith(end) and cell.inner_text().startswith("cell1/moving_arm_")
        outer, inner = cell.bounding_box(), tail.bounding_box()
        assert outer["x"] <= inner["x"] and inner["x"] + inner["width"] <= outer["x"] + outer["width"] + 1
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    assert "2026-11-25" in page.inner_text("h1")
    page.goto((page.folder / "42" / "index.html").as_uri())


def test_a_pass_with_accepted_contacts_says_so(tmp_path: Path) -> None:
    touched = next(entry for entry in night(42) if entry.contacts)
    excused = replace(
        touched, verdict="pass", reasons=("2 contacts, within the policy (2 accepted).",), exclusions=EXCLUSIONS
    )
    write_index(tmp_path, [excused])
    page = (tmp_path / "index.html").read_text()
    assert "<summary>2 contacts, within the policy (2 accepted)" in page
    assert f"{EXCLUSIONS[0]}\n{EXCLUSIONS[1]}\n" in page, "a line each"


def test_details_open_with_a_click(page: Any) -> None:
    quiet = page.locator("#logs tbody tr", has_text="10 exclusions").first
    assert EXCLUSIONS[0] not in page.inner_text("body")
    quiet.locator("summary").click()
    assert EXCLUSIONS[0] in quiet.inner_text()
    quiet.locator("summary").click()


def test_a_phone_shows_it_too(page: Any) -> None:
    page.set_viewport_size({"width": 390, "height": 844})
    assert page.evaluate("document.documentElement.scrollWidth") <= 390
    assert page.evaluate("document.documentElement.scrollHeight") <= 3000
    assert "cell0/run3.mcap" in page.inner_text("#logs tbody tr:first-child")


def test_a_thousand_logs_are_quick(page: Any) -> None:
    start = time.monotonic()
    page.goto((page.folder / "1000" / "index.html").as_uri())
    page.get_by_label("Filter", exact=False).fill("run999 cell0")
    page.wait_for_function("document.querySelector('[role=status]').textContent.endsWith('of 1000 logs')")
    assert time.monotonic() - start < 10, "two seconds, on a machine that does nothing else"
    assert (page.folder / "1000" / "index.html").stat().st_size < 2_500_000
    page.goto((page.folder / "42" / "index.html").as_uri())


def test_it_is_for_everybody(page: Any, axe: str) -> None:
    for width in (390, 1280):
        page.set_viewport_size({"width": width, "height": 900})
        assert violations(page, axe) == []
