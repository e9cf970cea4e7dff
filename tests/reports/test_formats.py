"""Index, summary, text, JUnit, SARIF, Markdown: complete, valid, and safe with hostile names."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import pytest
import samples
from sarif_pydantic import Sarif

from collaudit.core.errors import ConfigError, LogError
from collaudit.reports.files.run_files import result_json
from collaudit.reports.files.written_files import json_text
from collaudit.reports.formats.night_texts import escaped
from collaudit.reports.formats.registry import FORMATS, report_text, summary_text, write_report
from collaudit.reports.page.index import summarise, write_index
from collaudit.reports.terminal.command_texts import summary_table
from collaudit.reports.terminal.screen_text import audit_text
from collaudit.reports.values.entries import IndexEntry, entry_of, entry_of_error, worst_first
from collaudit.reports.values.night import NightFacts

BROKEN = entry_of_error(
    "broken.bag", LogError("the bag is cut short", where="broken.bag", found="12 bytes", expected="a ROS 1 bag")
)


@pytest.fixture(scope="module")
def audits():
    return [samples.passed(5000), samples.not_judged(), samples.hostile(), samples.failed(5000)]


@pytest.fixture(scope="module")
def entries(audits) -> list[IndexEntry]:
    return [*(entry_of(audit.result, f"{k}/report.html") for k, audit in enumerate(audits)), BROKEN]


def test_entries_are_ordered_worst_first(entries: list[IndexEntry]) -> None:
    assert [entry.verdict for entry in worst_first(entries)] == ["fail", "fail", "not_judged", "not_judged", "pass"]
    assert worst_first(entries)[2].error is not None


def test_the_index_does_not_depend_on_the_order_of_entries(tmp_path: Path, entries: list[IndexEntry]) -> None:
    write_index(tmp_path / "a", entries)
    write_index(tmp_path / "b", entries[::-1])
    for name in ("index.html", "summary.json"):
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes()


def test_the_index_links_and_escapes(tmp_path: Path, entries: list[IndexEntry]) -> None:
    odd = IndexEntry("a b#c?.bag", "pass", (), "javascript:alert(1)/a b#c?%.html", 0, 0, 1.0)
    write_index(tmp_path, [*entries, odd])
    text = (tmp_path / "index.html").read_text()
    assert 'href="./0/report.html"' in text
    assert 'href="./javascript%3Aalert%281%29/a%20b%23c%3F%25.html"' in text
    assert text.count("<script>") == 1, "the page's own, by its hash"
    assert "the bag is cut short" in text
    assert "12 bytes" in text


def test_the_summary_counts(entries: list[IndexEntry]) -> None:
    summary = json.loads(json_text(summarise(entries)))
    assert summary["schema"] == "collaudit/summary/1"
    assert summary["verdict"] == "fail"
    assert summary["counts"] == {"fail": 2, "not_judged": 2, "pass": 1}
    assert summary["collisions"] == 4
    assert [log["name"] for log in summary["logs"]][-1] == "quiet_night.mcap"


def test_no_logs_are_no_pass(tmp_path: Path) -> None:
    write_index(tmp_path, [])
    assert json.loads((tmp_path / "summary.json").read_text())["verdict"] == "not_judged"


def test_the_summary_table_is_aligned_and_safe(entries: list[IndexEntry]) -> None:
    text = summary_table(entries)
    assert "\x1b" not in text
    assert "\u202e" not in text
    lines = text.splitlines()
    assert lines[0].startswith("verdict     log ")
    assert lines[2].startswith("FAIL ")
    assert "5 logs: 1 pass, 2 fail, 2 not judged" in lines[-1]
    starts = {line.index(word) for line in lines[2:7] for word in ("FAIL", "NOT JUDGED", "PASS") if word in line}
    assert starts == {0}


def test_no_contact_in_a_log_without_a_verdict_is_a_dash(entries: list[IndexEntry], tmp_path: Path) -> None:
    """0 beside NOT JUDGED reads like an all clear; time that could be judged changes nothing about that."""
    silent = replace(entries[0], verdict="not_judged", contacts=0, collisions=0, near_misses=0, judged_h=0.5)
    assert silent.counts_mean_something and silent.counted(0) == "–" and silent.counted(2) == "2"
    assert replace(silent, verdict="pass").counted(0) == "0"
    assert summary_table([silent]).splitlines()[2].split()[-2:-1] != ["0"] and " 0  " not in summary_table([silent])
    write_index(tmp_path, [silent])
    assert (
        '<td class="num" data-key="-1">–</td><td class="num wide" data-key="-1">–</td>'
        in (tmp_path / "index.html").read_text()
    )


def test_among_many_logs_each_has_one_reason_and_how_many_follow(entries: list[IndexEntry]) -> None:
    many = replace(
        entries[0], reasons=("The first. " + 40 * "x " + 40 * "y ", "The second."), exclusions=("The third.",)
    )
    line = summary_table([many], most=20).splitlines()[2]
    assert line.endswith("y… (and 2 more)") and len(line) < 220
    assert "The second.; The third." in summary_table([many]), "-v has every reason"


def test_the_text_of_an_audit_has_its_numbers() -> None:
    text = audit_text(samples.failed(5000).result)
    for words in (
        "FAIL",
        "shoulder_pan",
        " 9.22  ",
        "peak, N·m",
        " 3.9996  ",
        "99.99 % of γ",
        "log-effort-missing",
        "no safety function",
    ):
        assert words in text


def test_junit_has_a_case_per_log(audits) -> None:
    suites = ElementTree.fromstring(report_text(audits, "junit", [BROKEN]))
    assert suites.attrib == {"name": "collaudit", "tests": "5", "failures": "2", "errors": "2"}
    by_name = {case.get("name"): case for case in suites.iter("testcase")}
    assert by_name["quiet_night.mcap"].find("failure") is None
    assert "2 collisions" in by_name["polishing_2024-03-12.bag"].find("failure").get("message")
    assert "not in N·m" in by_name["tiago.csv"].find("error").get("message")
    assert "12 bytes" in by_name["broken.bag"].find("error").text
    assert [suite.get("name") for suite in suites] == ["collaudit"], "no robot is known"


def test_junit_has_a_suite_a_robot_and_a_class_a_folder(audits) -> None:
    names = ["A/cell1/run.mcap", "B/run.mcap", "A/run.mcap"]
    results = [replace(a.result, log=replace(a.result.log, name=n)) for a, n in zip(audits, names, strict=False)]
    robots = {"A/cell1/run.mcap": "A", "B/run.mcap": "B", "A/run.mcap": "A"}
    suites = ElementTree.fromstring(
        summary_text(results, "junit", [replace(BROKEN, robot="B")], NightFacts(robots=robots))
    )
    told = {s.get("name"): [(c.get("classname"), c.get("name")) for c in s.iter("testcase")] for s in suites}
    assert told == {
        "A": [("A.cell1", "A/cell1/run.mcap"), ("A", "A/run.mcap")],
        "B": [("B", "B/run.mcap"), ("collaudit", "broken.bag")],
    }
    lasted = {c.get("name"): float(c.get("time", "nan")) for c in suites.iter("testcase")}
    assert lasted["broken.bag"] == 0.0, "nothing of it was read"
    for result in results:
        assert lasted[result.log.name] == pytest.approx(result.log.duration_s, abs=1e-3)
    assert float(suites[0].get("time", "nan")) == pytest.approx(lasted[names[0]] + lasted[names[2]], abs=2e-3)
    assert suites[0].find("properties/property").get("name") == "A/cell1/run.mcap: contacts"


def test_sarif_fits_the_models_of_the_standard(audits) -> None:
    text = report_text(audits, "sarif", [BROKEN])
    Sarif.model_validate_json(text)
    document = json.loads(text)
    assert document["version"] == "2.1.0"
    run = document["runs"][0]
    rules = {rule["id"] for rule in run["tool"]["driver"]["rules"]}
    results = run["results"]
    assert {result["ruleId"] for result in results} <= rules
    assert {result["level"] for result in results} <= {"error", "warning", "note"}
    assert sum(result["ruleId"] == "contact" for result in results) == 4
    assert not any("quiet_night" in json.dumps(result) for result in results), "a pass is no result"
    assert sum(result["ruleId"] == "not-judged" for result in results) == 2
    for result in results:
        uri = result["locations"][0]["physicalLocation"]["artifactLocation"]["uri"]
        assert not set(uri) & set(' <>"\\^`{|}')
        assert result["message"]["text"]
    prints = [result["partialFingerprints"]["primaryLocationLineHash"] for result in results]
    assert len(set(prints)) == len(prints)


def test_markdown_is_a_table_and_nothing_else(audits) -> None:
    text = report_text(audits, "markdown", [BROKEN])
    assert "| ❌ FAIL | polishing\\_2024-03-12.bag |" in text
    assert "| ❔ NOT JUDGED | broken.bag |" in text
    assert "<script" not in text
    assert "<img" not in text
    for line in text.splitlines():
        if line.startswith("| ❌"):
            assert line.replace("\\|", "").count("|") == 6


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("joint_1", "joint\\_1"),
        ("a|b", "a\\|b"),
        ("[x](y)", "\\[x\\](y)"),
        ("https://evil.example", "https&#58;//evil.example"),
        ("@team #12", "&#64;team &#35;12"),
        ("a\nb", "a\\\\x0ab"),
    ],
)
def test_markdown_text_stays_text(text: str, shown: str) -> None:
    assert escaped(text) == shown


@pytest.mark.parametrize("fmt", FORMATS)
def test_every_format_is_written_the_same_twice(tmp_path: Path, audits, fmt) -> None:
    some = audits[:1] if fmt == "mcap" else audits[:2] if fmt == "html" else audits
    write_report(tmp_path / "a", some, fmt)
    write_report(tmp_path / "b", some, fmt)
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()


def test_json_of_one_is_its_audit(audits) -> None:
    assert report_text(audits[:1], "json") == result_json(audits[0].result)
    assert len(json.loads(report_text(audits, "json"))["audits"]) == 4


def test_nothing_and_unknown_formats_are_refused(audits) -> None:
    with pytest.raises(ConfigError, match="nothing to report"):
        report_text([], "html")
    with pytest.raises(ConfigError, match="unknown report format"):
        report_text(audits, "pdf")
