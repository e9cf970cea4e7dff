"""The page in a real browser: offline, without and with JavaScript, on phone, desk and paper, for everybody."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import samples
from browser import axe_source, keep_picture, launched, violations

from collaudit.core.data.audit_result import Audit
from collaudit.core.data.signals import arm_at
from collaudit.core.errors import LogError
from collaudit.reports.page import html
from collaudit.reports.page.environment import write_assets
from collaudit.reports.page.html import write_html
from collaudit.reports.page.index import write_index
from collaudit.reports.page.matter_pages import body_regions_html
from collaudit.reports.sections.body_region_sections import BodyLimits
from collaudit.reports.values.entries import entry_of, entry_of_error

playwright = pytest.importorskip("playwright.sync_api")
pytestmark = pytest.mark.browser

STYLE = Path(html.__file__).parent / "templates" / "style.css"
VERDICTS = [
    (samples.failed, "FAIL", "rgb(176, 0, 32)"),
    (samples.passed, "PASS", "rgb(20, 98, 58)"),
    (samples.not_judged, "NOT JUDGED", "rgb(107, 68, 0)"),
]


@pytest.fixture(scope="module")
def chromium() -> Iterator[Any]:
    with playwright.sync_playwright() as running:
        browser = launched(running)
        yield browser
        browser.close()


@pytest.fixture(autouse=True)
def pages_are_closed(request: pytest.FixtureRequest) -> Iterator[None]:
    """After each test: pages that stay open take a sixth of the processor's time of all these tests."""
    yield
    if "chromium" in request.fixturenames:
        for context in request.getfixturevalue("chromium").contexts:
            context.close()


@pytest.fixture(scope="module")
def axe(tmp_path_factory: pytest.TempPathFactory) -> str:
    return axe_source(tmp_path_factory.mktemp("axe"))


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("report") / "report.html"
    write_html(path, [samples.failed(30_000)])
    return path


class Visit:
    """A page that is open: what it asked for and what it said on the console."""

    def __init__(self, chromium: Any, path: Path, fragment: str = "", **context: Any) -> None:
        self.page = chromium.new_context(viewport={"width": 1280, "height": 900}, **context).new_page()
        self.console: list[str] = []
        self.asked: list[str] = []
        self.page.on("console", lambda message: self.console.append(message.text))
        self.page.on("pageerror", lambda error: self.console.append(str(error)))
        self.page.on("request", lambda request: self.asked.append(request.url))
        self.page.goto(path.as_uri() + fragment)

    @property
    def outside(self) -> list[str]:
        return [url for url in self.asked if not url.startswith(("file:", "blob:"))]


def visit(chromium: Any, tmp_path: Path, audit: Audit) -> Visit:
    write_html(tmp_path / "report.html", [audit])
    return Visit(chromium, tmp_path / "report.html")


@pytest.mark.parametrize(("make", "word", "colour"), VERDICTS)
def test_the_verdict_is_seen_and_nothing_is_fetched(
    chromium: Any, tmp_path: Path, make, word: str, colour: str
) -> None:
    seen = visit(chromium, tmp_path, make(5000))
    assert seen.page.title().startswith(f"{word}: collision audit of")
    shown = seen.page.locator(".verdict .word")
    assert shown.is_visible()
    assert shown.bounding_box()["y"] < 400
    assert shown.evaluate("e => getComputedStyle(e).color") == colour
    assert (seen.console, seen.outside) == ([], [])


def test_hostile_names_run_nothing(chromium: Any, tmp_path: Path) -> None:
    seen = visit(chromium, tmp_path, samples.hostile())
    seen.page.locator("section.signals").scroll_into_view_if_needed()
    seen.page.wait_for_selector(".uplot")
    assert seen.page.title().startswith("FAIL: collision audit of <script>")
    assert (seen.console, seen.outside) == ([], [])


def test_the_test_would_notice(chromium: Any, tmp_path: Path) -> None:
    path = tmp_path / "bad.html"
    path.write_text("<title>a</title><script>document.title='owned'</script><img src='http://x.invalid/'>")
    seen = Visit(chromium, path)
    assert seen.page.title() == "owned"
    assert seen.outside == ["http://x.invalid/"]


def test_a_script_that_is_not_the_pages_own_does_not_run(chromium: Any, report: Path, tmp_path: Path) -> None:
    path = tmp_path / "changed.html"
    path.write_text(report.read_text().replace("</main>", "</main><script>document.title='owned'</script>"))
    seen = Visit(chromium, path)
    assert seen.page.title().startswith("FAIL")
    assert any("Content Security Policy" in line for line in seen.console)


def shown_times(status: Any) -> list[float]:
    """The log's seconds of the stretch that is shown; the wall clock's stand in brackets beside them."""
    return [float(x) for x in re.findall(r"([\d.]+) s", status.inner_text())[:2]]


def test_a_row_leads_to_its_place_in_the_signals_and_back(chromium: Any, report: Path) -> None:
    seen = Visit(chromium, report)
    page = seen.page
    page.get_by_role("link", name="show contact 2 in the signals").click()
    page.wait_for_selector(".uplot")
    status = page.locator(".tools [role=status]")
    start, end = shown_times(status)
    onset = samples.failed(30_000).result.collisions[1].onset_s
    assert start < onset < end < start + 2
    page.get_by_role("button", name="Zoom out").click()
    wider = shown_times(status)
    assert wider[1] - wider[0] == pytest.approx(2 * (end - start), rel=0.01)
    assert page.evaluate("document.querySelectorAll('.uplot').length") >= 3
    page.get_by_role("button", name="Back to where you came from").click()
    assert page.evaluate("document.activeElement.dataset.back") == "log1-contact-2"
    page.get_by_label("elbow", exact=True).uncheck()
    assert not page.locator("#log1-joint-3").is_visible()
    page.get_by_role("button", name="Measured and modelled torque").click()
    assert page.locator("button[aria-pressed=true]").inner_text() == "Measured and modelled torque"
    assert seen.console == []


def test_a_link_into_a_folded_part_opens_it(chromium: Any, tmp_path: Path) -> None:
    write_html(tmp_path / "many.html", [samples.many_events(30)])
    page = Visit(chromium, tmp_path / "many.html", "#log1-contact-20").page
    assert page.locator("#log1-contact-20").is_visible()
    assert not page.locator("#log1-against svg").first.is_visible()


def test_everything_is_readable_without_javascript(chromium: Any, report: Path) -> None:
    page = Visit(chromium, report, java_script_enabled=False).page
    assert page.locator("figure.signal svg.stretch").first.is_visible()
    assert not page.locator(".tools").first.is_visible()
    for words in ("What was judged, and what not", "Contact 1", "Near misses", "Sign-off", "sha256"):
        assert page.get_by_text(words).first.is_visible()


def test_the_keyboard_comes_to_the_content_first(chromium: Any, report: Path) -> None:
    page = Visit(chromium, report).page
    page.keyboard.press("Tab")
    assert page.evaluate("document.activeElement.textContent") == "Skip to the content"
    assert page.locator(".skip").bounding_box()["x"] >= 0
    page.keyboard.press("Enter")
    assert page.evaluate("location.hash") == "#content"


@pytest.fixture(scope="module")
def busy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A minute with thirty contacts of three joints each, as many near misses, and findings."""
    path = tmp_path_factory.mktemp("busy") / "busy.html"
    write_html(path, [samples.busy()])
    return path


@pytest.mark.parametrize("made", ["report", "busy"])
def test_six_joints_fit_4000_pixels_and_a_minute_400_kilobytes(
    chromium: Any, made: str, request: pytest.FixtureRequest
) -> None:
    path = request.getfixturevalue(made)
    page = Visit(chromium, path).page
    for top in range(0, 4000, 800):
        page.evaluate(f"scrollTo(0, {top})")
        page.wait_for_timeout(50)
    assert page.evaluate("document.documentElement.scrollHeight") <= 4000
    assert path.stat().st_size <= 400_000


def test_a_page_of_one_contact_says_it_first_and_in_900_words(chromium: Any, tmp_path: Path) -> None:
    audit = samples.busy(1)
    page = visit(chromium, tmp_path, audit).page
    words = page.locator("main").inner_text().split()
    assert len(words) <= 900
    before = page.locator("main").inner_text().split(f"{audit.result.contacts[0].onset_s:.3f} s")[0]
    assert len(before.split()) <= 40
    assert page.locator(".verdict").bounding_box()["y"] < 120


@pytest.mark.parametrize("made", ["report", "busy"])
def test_it_prints_on_eight_pages_with_everything_unfolded(
    chromium: Any, made: str, request: pytest.FixtureRequest, tmp_path: Path
) -> None:
    path = request.getfixturevalue(made)
    page = Visit(chromium, path).page
    page.emulate_media(media="print")
    assert page.locator("#log1-friction-tables table").first.is_visible()
    assert not page.locator("nav.toc").is_visible()
    printed = page.pdf(path=tmp_path / "page.pdf", prefer_css_page_size=True, print_background=True)
    assert len(re.findall(rb"/Type\s*/Page\b", printed)) <= 8
    assert 'counter(page) " of " counter(pages)' in path.read_text()
    assert '@top-left { content: "collaudit: polishing_2024-03-12.bag: FAIL"' in path.read_text()


def test_a_row_of_the_table_of_contacts_leads_to_the_signals_and_back(chromium: Any, busy: Path) -> None:
    seen = Visit(chromium, busy, "#log1-contact-7")
    page = seen.page
    assert page.locator("#log1-contact-7").is_visible(), "a link into the folded table opens it"
    page.wait_for_selector(".tools button")
    page.get_by_role("link", name="show contact 7", exact=True).click()
    page.wait_for_selector(".uplot")
    start, end = shown_times(page.locator(".tools [role=status]"))
    onset = samples.busy().result.contacts[6].onset_s
    assert start < onset < end < start + 2
    page.get_by_role("button", name="Back to where you came from").click()
    assert page.evaluate("document.activeElement.dataset.back") == "log1-contact-7"
    assert (seen.console, seen.outside) == ([], [])


def test_the_arm_moves_with_the_cursor_and_from_contact_to_contact(chromium: Any, busy: Path) -> None:
    audit = samples.busy()
    seen = Visit(chromium, busy)
    page = seen.page
    page.wait_for_selector(".player svg")
    page.get_by_role("button", name="Next contact").click()
    page.get_by_role("button", name="Next contact").click()
    second = audit.result.contacts[1]
    assert "contact 2" in page.locator(".player .clock").inner_text()
    assert f"{second.onset_s:.3f} s (22:04:14.181 UTC)" in page.locator(".player .clock").inner_text()
    assert page.locator(".player .arm-hit").first.get_attribute("d").count("M") == 3, "the joints that alarmed"
    page.locator(".player input").first.fill("500")
    at = float(re.findall(r"[\d.]+", page.locator(".player .clock").inner_text())[0])
    k = round(at / samples.PERIOD_S)
    position = dict(zip(samples.JOINTS, audit.signals.position_rad[k].tolist(), strict=True))
    points = arm_at(samples.arm(), position)[0]
    drawn = page.evaluate("ArmPlayer.last.joints")
    assert np.allclose(drawn, points, atol=0.02), "the browser's kinematics are Python's"
    assert (seen.console, seen.outside) == ([], [])


def test_without_javascript_the_arm_is_in_the_cards(chromium: Any, busy: Path) -> None:
    page = Visit(chromium, busy, java_script_enabled=False).page
    assert page.locator(".card").count() == 10
    assert page.locator(".card .arm-axis").count() == 20
    assert not page.locator(".player").is_visible()


def pages(tmp_path: Path) -> dict[str, Path]:
    """A report of several logs, and an index."""
    write_html(tmp_path / "several.html", [samples.failed(4000), samples.passed(4000), samples.not_judged(3000)])
    result = samples.failed(3000).result
    dated = [replace(entry_of(result, f"{k}/report.html"), name=f"{k}.bag") for k in range(3)]
    write_index(tmp_path, [*dated, entry_of_error("b.bag", LogError("cut short"))])
    limits = BodyLimits.of(
        {"source": "our own measurements", "region": [{"name": "hand", "quasi_static_n": 140, "transient_n": 280}]}
    )
    (tmp_path / "limits.html").write_text(
        body_regions_html([samples.busy(3).result, samples.passed(3000).result], limits)
    )
    return {name: tmp_path / f"{name}.html" for name in ("several", "index", "limits")}


#: Widths on both sides of the style's one bound (46 rem), and schemes, with axe's rules (none: all). A scheme sets
#: colours and nothing else, so dark pages are examined for these at one width; between the widths only what may widen a
#: page is looked at.
EXAMINED = {(360, "light"): (), (1280, "light"): (), (1280, "dark"): ("color-contrast", "link-in-text-block")}


def test_axe_finds_nothing_at_any_width_light_or_dark(chromium: Any, axe: str, busy: Path, tmp_path: Path) -> None:
    found = []
    for name, path in {"busy": busy, **pages(tmp_path)}.items():
        page = Visit(chromium, path).page
        for width in (360, 768, 1280):
            page.set_viewport_size({"width": width, "height": 900})
            assert page.evaluate("document.documentElement.scrollWidth") <= width, f"{name} scrolls sideways"
            for scheme, rules in [(scheme, rules) for (at, scheme), rules in EXAMINED.items() if at == width]:
                page.emulate_media(color_scheme=scheme)
                found += [f"{name} {width} {scheme}: {text}" for text in violations(page, axe, *rules)]
                keep_picture(page, f"{name}-{width}-{scheme}")
    assert found == []


def test_the_style_has_one_bound_of_widths_and_a_scheme_sets_colours_only() -> None:
    """What EXAMINED leaves out relies on this."""
    style = STYLE.read_text(encoding="utf-8")
    assert re.findall(r"@media ([^{]*(?:width|height)[^{]*)", style) == ["(max-width: 46rem) "]
    (dark,) = re.findall(r"prefers-color-scheme: dark\) \{ :root \{(.*?)\}", style, re.DOTALL)
    declared = dict(re.findall(r"([\w-]+): ?([^;]+);", dark))
    assert declared and all(name.startswith("--") for name in declared)
    assert all(re.fullmatch(r"#[0-9a-f]{3,6}", value) for value in declared.values())


def test_nothing_that_is_unfolded_widens_a_phones_page(chromium: Any, report: Path) -> None:
    page = Visit(chromium, report).page
    page.set_viewport_size({"width": 360, "height": 900})
    page.evaluate("document.querySelectorAll('details').forEach((each) => { each.open = true; })")
    assert page.evaluate("document.documentElement.scrollWidth") <= 360


def test_reports_of_an_audit_share_their_scripts(chromium: Any, axe: str, tmp_path: Path) -> None:
    """Opened from a disk, where nothing is sent by a server: the same plots, by files that all reports name."""
    own = tmp_path / "own.html"
    write_html(own, [samples.failed(4000)])
    (tmp_path / "run").mkdir()
    write_html(tmp_path / "run" / "report.html", [samples.failed(4000)], "../assets")
    write_assets(tmp_path)
    page, whole = (tmp_path / "run" / "report.html").read_text(), own.read_text()
    assert "uPlot" not in page and len(whole) - len(page) > 40_000
    assert "script-src 'self';" in page and "'self'" not in whole
    seen, alone = Visit(chromium, tmp_path / "run" / "report.html"), Visit(chromium, own)
    for visit in (seen, alone):
        visit.page.locator("section.signals").first.scroll_into_view_if_needed()
        visit.page.wait_for_selector(".uplot")
    assert seen.page.locator(".uplot").count() == alone.page.locator(".uplot").count()
    assert (seen.console, seen.outside) == ([], []) and violations(seen.page, axe) == []
    for file in (tmp_path / "assets").iterdir():
        file.unlink()
    lost = Visit(chromium, tmp_path / "run" / "report.html").page
    assert lost.evaluate("typeof uPlot") == "undefined"
    assert lost.locator("svg").count() > 0, "without them it is a page with curves"


def test_axe_would_notice(chromium: Any, axe: str, tmp_path: Path) -> None:
    path = tmp_path / "bad.html"
    path.write_text("<p style='color:#ccc;background:#fff'>pale<img src='data:,'>")
    found = " ".join(violations(Visit(chromium, path).page, axe))
    assert all(rule in found for rule in ("color-contrast", "image-alt", "html-has-lang", "document-title"))


def test_the_index_is_sorted_and_filtered(chromium: Any, tmp_path: Path) -> None:
    made = [samples.failed, samples.passed, samples.not_judged]
    entries = [replace(entry_of(make(3000).result, "x/report.html"), name=f"{k}.bag") for k, make in enumerate(made)]
    write_index(tmp_path, [*entries, entry_of_error("b.bag", LogError("cut short"))])
    seen = Visit(chromium, tmp_path / "index.html")
    page = seen.page
    names = "Array.from(document.querySelectorAll('#logs tbody tr:not([hidden]) th'), (e) => e.textContent)"
    assert page.title() == "FAIL: collision audit of 4 logs"
    assert page.evaluate(names) == ["0.bag", "b.bag", "2.bag", "1.bag"]
    page.get_by_role("button", name="Log", exact=True).click()
    assert page.evaluate(names) == ["0.bag", "1.bag", "2.bag", "b.bag"]
    page.get_by_label("Verdict", exact=False).select_option("not_judged")
    assert page.evaluate(names) == ["2.bag", "b.bag"]
    page.get_by_label("Filter", exact=False).fill("cut short")
    assert page.evaluate(names) == ["b.bag"]
    assert page.locator("[role=status]").inner_text() == "1 of 4 logs"
    assert seen.console == []


@pytest.mark.parametrize(("scheme", "width"), [("light", 1280), ("dark", 390)])
def test_the_page_of_trends_is_for_everybody(chromium: Any, axe: str, tmp_path: Path, scheme: str, width: int) -> None:
    from histories import history

    from collaudit.core.history.night_row import joint_nights
    from collaudit.reports.page.matter_pages import trend_page

    rows = [*history("cell <b>7</b>", 40), *history("steady", 40)]
    (tmp_path / "trend.html").write_text(trend_page(joint_nights(rows)))
    seen = Visit(chromium, tmp_path / "trend.html", color_scheme=scheme)
    seen.page.set_viewport_size({"width": width, "height": 900})
    assert not violations(seen.page, axe) and not seen.console and not seen.outside
    assert seen.page.get_by_text("cell <b>7</b>").first.is_visible()
    assert seen.page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    keep_picture(seen.page, f"trend-{scheme}-{width}")
