"""The page: complete, escaped, deterministic, well formed."""

from __future__ import annotations

import re
import time
import zlib
from base64 import b64decode, b64encode
from collections import Counter
from dataclasses import replace
from hashlib import sha256
from html.parser import HTMLParser

import numpy as np
import pytest
import samples

from collaudit.core.data.audit_result import Audit, PolicyLimits
from collaudit.core.data.detection_result import DisturbedJoint, RestDisturbance
from collaudit.core.findings import Finding
from collaudit.reports.page.html import html_text
from collaudit.reports.values.visible_text import visible
from collaudit.reports.values.words import STATEMENT

VOID = {"meta", "br", "link", "img", "input", "hr"}


class Page(HTMLParser):
    """Elements, attributes and text of a page; complains about unbalanced tags."""

    def __init__(self, text: str) -> None:
        super().__init__(convert_charrefs=True)
        self.open: list[str] = []
        self.tags: Counter[str] = Counter()
        self.attributes: list[tuple[str, str, str]] = []
        self.texts: list[str] = []
        self.feed(text)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags[tag] += 1
        self.attributes += [(tag, name, value or "") for name, value in attrs]
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags[tag] += 1
        self.attributes += [(tag, name, value or "") for name, value in attrs]

    def handle_endtag(self, tag: str) -> None:
        assert self.open and self.open[-1] == tag, f"</{tag}> closes {self.open[-3:]}"
        self.open.pop()

    def handle_data(self, data: str) -> None:
        if not {"style", "script"} & set(self.open):
            self.texts.append(data)

    @property
    def text(self) -> str:
        return " ".join(" ".join(self.texts).split())

    def values(self, name: str) -> list[str]:
        return [value for _, attribute, value in self.attributes if attribute == name]


@pytest.fixture(scope="module")
def failed() -> Audit:
    return samples.failed()


@pytest.fixture(scope="module")
def failed_text(failed: Audit) -> str:
    return html_text([failed])


@pytest.fixture(scope="module")
def page(failed_text: str) -> Page:
    return Page(failed_text)


def test_it_says_what_a_reader_needs(page: Page, failed: Audit) -> None:
    for words in (
        "FAIL",
        *failed.result.reasons,
        STATEMENT,
        "What was judged, and what not",
        "Contacts (2)",
        "Near misses (3)",
        "2024-03-12 22:04:39.196 UTC",
        "× 2.30",
        "108 ms",
        "Sign-off",
        "9.22 N·m",
        "−7.42 N·m",
        "Not every parameter of this law is determined by the data.",
        "from 8.20, open above",
        "A + B",
        "no constant-velocity section",
        "at least 3 h without collisions",
        "Synchronise the clocks",
        "gap in the log",
        "force-controlled in this phase",
        failed.result.log.sha256,
        "collaudit 0.1.0, numpy 2.4.6",
    ):
        assert words in page.text, words


def test_a_peak_just_under_its_threshold_does_not_read_as_equal(page: Page) -> None:
    assert "99.99 % of γ 3.9996 N·m 4.0000 N·m" in page.text


def test_findings_are_grouped_by_kind_and_sorted_by_severity(page: Page, failed: Audit) -> None:
    found = re.findall(r"✕ error|△ warning|i info", page.text)
    assert found == ["✕ error", "△ warning", "△ warning", "i info"]
    again = tuple(Finding("fit-doubtful", "warning", "not at constant speed", joint=j) for j in ("elbow", "wrist_1"))
    more = replace(failed.result, findings=(*failed.result.findings, *again))
    text = Page(html_text([replace(failed, result=more)])).text
    assert "wrist_3 never moved at constant speed 1 more elbow, wrist_1: not at constant speed" in text
    assert text.count("fit-doubtful") == 1


def test_every_contact_and_near_miss_has_a_stable_place(page: Page) -> None:
    ids = page.values("id")
    links = [value[1:] for value in page.values("href") if value.startswith("#")]
    assert set(links) <= set(ids)
    wanted = [f"log1-contact-{k}" for k in (1, 2)] + [f"log1-near-miss-{k}" for k in (1, 2, 3)]
    assert set(wanted) <= set(ids)
    assert sorted(page.values("data-back")) == sorted(wanted)


def test_near_misses_come_closest_to_an_alarm_first(page: Page) -> None:
    assert [i for i in page.values("id") if "near-miss-" in i] == [f"log1-near-miss-{k}" for k in (2, 1, 3)]


@pytest.mark.parametrize("make", [samples.failed, samples.many_events, samples.not_judged, samples.hostile])
def test_ids_are_unique_and_references_resolve(make) -> None:
    assert_sound_ids(html_text([make()]))


def test_ids_stay_unique_with_several_logs() -> None:
    assert_sound_ids(html_text([samples.failed(4000), samples.failed(5000), samples.not_judged()]))


def assert_sound_ids(text: str) -> None:
    page = Page(text)
    ids = Counter(page.values("id"))
    assert [name for name, count in ids.items() if count > 1] == []
    used = {
        name
        for value in page.values("style") + page.values("clip-path")
        for name in re.findall(r"url\(#([^)]+)\)", value)
    }
    used |= {value[1:] for value in page.values("href") if value.startswith("#")}
    used |= set(page.values("aria-labelledby"))
    assert used <= set(ids)


def test_it_needs_nothing_from_outside(failed_text: str, page: Page) -> None:
    assert page.tags["link"] == page.tags["img"] == page.tags["iframe"] == 0
    assert "default-src 'none'" in failed_text
    outside = [v for name in ("href", "src", "action") for v in page.values(name) if not v.startswith("#")]
    assert outside == []
    assert not re.search(r"@import|url\((?!#)", failed_text)
    assert not [value for _, name, value in page.attributes if name.startswith("on")]


def test_only_scripts_whose_hash_is_stated_may_run(failed_text: str) -> None:
    policy = re.search(r"script-src ([^;]*);", failed_text)
    assert policy is not None
    running = re.findall(r"<script>(.*?)</script>", failed_text, flags=re.DOTALL)
    packed = re.search(r'<script type="text/plain" id="plot-library">([^<]*)</script>', failed_text)
    assert packed is not None
    library = zlib.decompress(b64decode(packed[1])).decode()
    assert "uPlot" in library
    assert "Leon Sorokin" in library, "its licence line goes with it"
    texts = [library, *running]
    assert policy[1].split() == [f"'sha256-{b64encode(sha256(text.encode()).digest()).decode()}'" for text in texts]
    others = re.findall(r"<script ([^>]*)>", failed_text)
    assert others == ['type="application/json" id="log1-data"', 'type="text/plain" id="plot-library"']


def test_it_can_be_read_without_eyes(page: Page) -> None:
    assert ("html", "lang", "en") in page.attributes
    assert page.tags["th"] > 0
    images = [value for tag, name, value in page.attributes if tag == "svg" and name == "role"]
    labels = [value for tag, name, value in page.attributes if tag == "svg" and name == "aria-label"]
    assert len(images) == len(labels) > 10
    assert all(labels)
    assert page.tags["caption"] == page.tags["table"]


@pytest.mark.parametrize("make", [samples.failed, samples.hostile])
def test_the_same_audit_gives_the_same_bytes(make) -> None:
    assert html_text([make()]) == html_text([make()])


def test_hostile_text_is_shown_and_never_obeyed() -> None:
    text = html_text([samples.hostile()])
    page = Page(text)
    assert page.tags["img"] == 0
    assert page.tags["script"] == 3
    assert not [value for _, name, value in page.attributes if name.startswith("on")]
    for name in samples.HOSTILE:
        assert " ".join(visible(name).split()) in page.text
    for hidden in ("\u202e", "\x1b", "\x00"):
        assert hidden not in text
    assert "49" not in [word.strip("{}") for word in page.text.split() if word.startswith("{{")]


def test_a_log_without_a_verdict_does_not_look_clean() -> None:
    page = Page(html_text([samples.not_judged()]))
    assert "NOT JUDGED" in page.text
    assert "Contacts (–)" in page.text
    assert "Contacts 0" not in page.text


def test_a_pass_says_so_and_no_more() -> None:
    page = Page(html_text([samples.passed()]))
    assert "PASS" in page.text and "FAIL" not in page.text


def test_several_logs_come_worst_first() -> None:
    page = Page(html_text([samples.passed(), samples.not_judged(), samples.failed(4000)]))
    names = re.findall(r"polishing|tiago|quiet_night", page.text)
    assert names[:3] == ["polishing", "tiago", "quiet_night"]


def test_many_events_are_all_listed_and_some_drawn_and_it_says_so() -> None:
    audit = samples.many_events(300)
    start = time.process_time()
    page = Page(html_text([audit]))
    assert time.process_time() - start < 60
    assert "The 10 furthest above their thresholds have cards:" in page.text
    assert {f"log1-contact-{k}-plot-clip0" for k in range(291, 301)} <= set(page.values("id"))
    assert {f"log1-contact-{k}" for k in range(1, 301)} <= set(page.values("id"))
    assert page.tags["article"] == 11, "the log and ten cards"
    assert page.tags["tr"] > 300
    more = Page(html_text([samples.many_events(700)])).text
    assert "The first 500 of 700 contacts" in more
    assert "All 700 are in audit.json." in more


def test_joints_the_signals_lack_do_not_break_the_page(failed: Audit) -> None:
    gone = replace(failed.result.collisions[0], joint="ghost")
    audit = replace(failed, result=samples.with_alarms(failed.result, (gone,)))
    assert "ghost" in Page(html_text([audit])).text


def test_an_empty_log_does_not_break_the_page(failed: Audit) -> None:
    s = failed.signals
    wide = np.empty((0, len(s.joint_names)))
    empty = replace(
        s, time_s=np.empty(0), position_rad=wide, velocity_rad_s=wide, measured_nm=wide, model_nm=wide,
        residual_nm=wide, state=wide.astype(np.int8), gamma_nm=wide.astype(np.float32),
    )  # fmt: skip
    result = replace(samples.not_judged().result, coverage=replace(failed.result.coverage, joints={}), phases=())
    assert "NOT JUDGED" in Page(html_text([Audit(result, empty)])).text


def test_a_disturbed_standing_joint_is_shown_and_is_no_contact(failed: Audit) -> None:
    pushed = RestDisturbance(3.0, 3.25, (DisturbedJoint("elbow", -1.75, 1e-4),))
    page = Page(html_text([replace(failed, result=replace(failed.result, disturbances=(pushed,)))]))
    assert "3.000 s 3.250 s elbow 1.75 N·m" in page.text
    assert "Contacts (2)" in page.text
    assert "log1-disturbance-1" in page.values("id")


def test_a_log_that_was_not_judged_draws_nothing_empty() -> None:
    text = html_text([samples.not_judged()])
    drawn = text[text.index('<div class="verdict') : text.index("</main>")]
    assert "timeline" not in drawn and "figure" not in drawn and 'class="plot' not in drawn and "histogram" not in drawn
    assert "No residual could be computed for any joint" in drawn
    assert drawn.count("effort is not in N·m") >= len(samples.JOINTS), "each joint has its reason"


def test_numbers_have_three_digits_whoever_computed_them() -> None:
    audit = samples.busy(3)
    gamma = dict.fromkeys(audit.result.rule.gamma_nm, 3.8653767322)
    contacts = [replace(c, scene=replace(c.scene, tool_speed_m_s=1.6e-5)) for c in audit.result.contacts if c.scene]
    result = replace(audit.result, rule=replace(audit.result.rule, gamma_nm=gamma), contacts=tuple(contacts))
    text = html_text([replace(audit, result=result)])
    assert "3.87 N·m" in text and "3.8653" not in re.sub(r"<script type=.*?</script>", "", text, flags=re.DOTALL)
    assert "under 0.001 m/s" in text and "e-05 m/s" not in text


def test_the_top_says_whose_log_it_is_and_what_values_are_held_against() -> None:
    audit = samples.busy(3)
    page = Page(html_text([audit]))
    for words in (
        "robot UR10e, serial 2019-0042",
        "lab cell 3",
        "operator A. Example",
        "at most 0: outside",
        "at most 10.0 /h",
    ):
        assert words in page.text, words
    kept = replace(audit.result, contacts=(), collisions=(), limits=PolicyLimits(0, None, 0.8))
    assert "at most 0: within" in Page(html_text([replace(audit, result=kept)])).text
    silent = Page(html_text([replace(audit, result=replace(audit.result, stated={"lab": "cell 3"}))])).text
    for key in ("robot", "tool", "operator"):
        assert f"{key} not stated" in silent, "what nobody states is flagged"
    assert "lab cell 3" in silent
    hostile = replace(audit.result, stated={"robot": "<script>alert(1)</script>"})
    assert "<script>alert" not in html_text([replace(audit, result=hostile)])
    assert "2024-03-12 22:04:11.250 UTC to 2024-03-12 22:05:11" in page.text


def test_values_above_gamma_are_flagged() -> None:
    text = html_text([samples.failed(4000)])
    body = text[text.index("Statistics of the judged residual") :]
    rows = body[: body.index("</table>")].split("<tr>")[2:]
    flagged = [re.findall(r"<bdi>(\w+)</bdi>", row)[0] for row in rows if "▲" in row]
    assert flagged == ["shoulder_pan", "shoulder_lift", "elbow", "wrist_1"], "whose largest residual exceeds γ"
