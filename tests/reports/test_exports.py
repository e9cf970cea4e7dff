"""Exports, each read back by a reader that people use: mcap, pyarrow, pandas, junitparser, markdown-it, a runner."""

from __future__ import annotations

import csv
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import samples
from junitparser import Error, Failure, JUnitXml
from markdown_it import MarkdownIt
from mcap.reader import make_reader
from mcap.stream_reader import StreamReader
from mcap_ros2.decoder import DecoderFactory

from collaudit.core.data.audit_result import Audit
from collaudit.core.data.signals import State
from collaudit.core.errors import ConfigError, LogError
from collaudit.reports.formats.audit_mcap import start_ns, write_audit_mcap, write_clips
from collaudit.reports.formats.registry import FORMATS, report_text, write_report
from collaudit.reports.values.entries import entry_of_error

BROKEN = entry_of_error("broken.bag", LogError("the bag is cut short", where="broken.bag"))
NANO = 1_000_000_000


@pytest.fixture(scope="module")
def audit() -> Audit:
    made = samples.failed(4000)
    signals = made.signals
    resting = (signals.state == State.FRICTION_INTERVAL)[:, :, None] * np.array([-1.0, 2.0], np.float32)
    ranges = np.where(resting == 0, np.nan, resting).astype(np.float32)
    return replace(made, signals=replace(signals, least_nm=ranges[..., 0], most_nm=ranges[..., 1]))


def _topics(path: Path) -> dict[str, list[tuple[int, object]]]:
    out: dict[str, list[tuple[int, object]]] = {}
    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        for _, channel, message, decoded in reader.iter_decoded_messages():
            assert message.publish_time == message.log_time
            out.setdefault(channel.topic, []).append((message.log_time, decoded))
    return out


def test_a_clip_is_three_seconds_around_each_contact(tmp_path: Path, audit: Audit) -> None:
    made = write_clips(tmp_path / "clips", audit)
    contacts = audit.result.contacts
    assert [path.name.rpartition("-")[0] for path in made] == [f"contact-{k}" for k, _ in enumerate(contacts, 1)]
    signals, origin = audit.signals, start_ns(audit.result.log.start)
    for path, contact in zip(made, contacts, strict=True):
        topics = _topics(path)
        inside = (signals.time_s >= contact.onset_s - 3.0) & (signals.time_s <= contact.end_s + 3.0)
        times = origin + np.round(signals.time_s[inside] * NANO).astype(np.int64)
        for name in ("residual", "model", "joints"):
            assert [time for time, _ in topics[f"/collaudit/{name}"]] == times.tolist()
        joints = [message for _, message in topics["/collaudit/joints"]]
        np.testing.assert_array_equal([message.position for message in joints], signals.position_rad[inside])
        np.testing.assert_array_equal([message.effort for message in joints], signals.measured_nm[inside])
        assert {"/collaudit/gamma", "/collaudit/state"} <= set(topics) and len(topics["/collaudit/contacts"]) == 1


def test_mcap_holds_the_signals_on_the_clock_of_the_log(tmp_path: Path, audit: Audit) -> None:
    path = tmp_path / "run.mcap"
    write_report(path, [audit], "mcap")
    topics = {name.removeprefix("/collaudit/"): found for name, found in _topics(path).items()}
    signals, origin = audit.signals, start_ns(audit.result.log.start)
    times = origin + np.round(signals.time_s * NANO).astype(np.int64)
    assert [time for time, _ in topics["residual"]] == times.tolist()
    for time, message in topics["residual"][:3]:
        assert message.header.stamp.sec * NANO + message.header.stamp.nanosec == time
        assert tuple(message.name) == signals.joint_names
        assert len(message.position) == len(message.velocity) == 0
    read = np.array([message.effort for _, message in topics["residual"]])
    np.testing.assert_array_equal(read, signals.residual_nm)
    np.testing.assert_array_equal([message.effort for _, message in topics["gamma"]], signals.gamma_nm)
    resting = (signals.state == State.FRICTION_INTERVAL).any(axis=1)
    assert [time for time, _ in topics["friction_range/most"]] == times[resting].tolist()
    assert np.nanmax([m.effort for _, m in topics["friction_range/most"]]) == 2.0
    assert len(topics["contacts"]) == len(audit.result.collisions)
    assert len(topics["near_misses"]) == len(audit.result.near_misses)
    first = min(audit.result.collisions, key=lambda c: c.onset_s)
    assert topics["contacts"][0][0] == origin + round(first.onset_s * NANO)
    assert first.joint in topics["contacts"][0][1].msg
    assert "no safety function" in topics["verdict"][0][1].msg


def test_mcap_states_are_those_of_every_sample(tmp_path: Path, audit: Audit) -> None:
    path = tmp_path / "run.mcap"
    write_report(path, [audit], "mcap")
    origin = start_ns(audit.result.log.start)
    rebuilt = np.full(audit.signals.state.shape, -1)
    names = list(audit.signals.joint_names)
    for time, message in _topics(path)["/collaudit/state"]:
        row = round((time - origin) / NANO / samples.PERIOD_S)
        for status in message.status:
            facts = {item.key: item.value for item in status.values}
            assert State.of(facts["state"]) == int(facts["code"])
            rebuilt[row:, names.index(status.name)] = int(facts["code"])
    np.testing.assert_array_equal(rebuilt, audit.signals.state)


def test_mcap_is_whole_and_the_same_twice(tmp_path: Path, audit: Audit) -> None:
    paths = [tmp_path / "a.mcap", tmp_path / "b.mcap"]
    for path in paths:
        write_audit_mcap(path, audit)
    assert paths[0].read_bytes() == paths[1].read_bytes()
    with paths[0].open("rb") as file:
        records = list(StreamReader(file, validate_crcs=True).records)
    assert type(records[0]).__name__ == "Header" and type(records[-1]).__name__ == "Footer"
    with paths[0].open("rb") as file:
        summary = make_reader(file).get_summary()
        metadata = [record.metadata for record in make_reader(file).iter_metadata()]
    assert summary is not None and summary.statistics is not None
    assert summary.statistics.message_count == sum(summary.statistics.channel_message_counts.values())
    assert metadata[0]["log_sha256"] == audit.result.log.sha256
    assert metadata[0]["verdict"] == "FAIL"


def test_mcap_of_many_chunks_is_in_order(tmp_path: Path) -> None:
    write_audit_mcap(tmp_path / "long.mcap", samples.failed(60_000))
    with (tmp_path / "long.mcap").open("rb") as file:
        reader = make_reader(file)
        summary = reader.get_summary()
        assert summary is not None and len(summary.chunk_indexes) > 2
        times = [message.log_time for _, _, message in reader.iter_messages(topics=["/collaudit/residual"])]
    assert len(times) == 60_000 and times == sorted(times)


def test_mcap_of_hostile_names_and_of_a_log_without_a_date(tmp_path: Path) -> None:
    made = samples.hostile()
    undated = replace(made, result=replace(made.result, log=replace(made.result.log, start=None)))
    write_audit_mcap(tmp_path / "odd.mcap", undated)
    topics = _topics(tmp_path / "odd.mcap")
    assert topics["/collaudit/residual"][0][0] == 0
    assert "\x1b" not in topics["/collaudit/verdict"][0][1].msg


def test_an_mcap_holds_one_run(tmp_path: Path, audit: Audit) -> None:
    with pytest.raises(ConfigError, match="one run"):
        write_report(tmp_path / "x.mcap", [audit, audit], "mcap")


def test_stamps_keep_nanoseconds() -> None:
    assert start_ns("2024-03-12T08:00:00.123456789Z") == 1710230400 * NANO + 123456789
    assert start_ns(None) == 0


def test_the_table_of_events(tmp_path: Path, audit: Audit) -> None:
    path = tmp_path / "run.csv"
    assert write_report(path, [audit, samples.not_judged()], "csv") == (path,)
    events = pd.read_csv(path)
    counts = events["event"].value_counts().to_dict()
    result = audit.result
    assert counts["alarm"] == len(result.collisions) and counts["near miss"] == len(result.near_misses)
    silent = events[events["event"] == "none"]
    assert silent["verdict"].tolist() == ["not_judged"], "no events of a log that was not judged is said"
    alarm = events[events["event"] == "alarm"].iloc[0]
    first = min(result.collisions, key=lambda c: c.onset_s)
    assert (alarm["joints"], alarm["peak_nm"], alarm["onset_s"]) == (first.joint, first.peak_nm, first.onset_s)


@pytest.mark.parametrize("begin", ["=", "+", "-", "@", "\t", "\r", "=HYPERLINK("])
def test_no_cell_of_a_csv_is_a_formula(tmp_path: Path, audit: Audit, begin: str) -> None:
    """Names of logs and joints are of other people's making; numbers keep their signs."""
    result = audit.result
    joint = result.collisions[0].joint
    named = replace(
        result,
        log=replace(result.log, name=f'{begin}log",x'),
        collisions=tuple(replace(alarm, joint=f"{begin}{alarm.joint}") for alarm in result.collisions),
    )
    written = write_report(tmp_path / "run.csv", [replace(audit, result=named)], "csv")
    for path in written:
        with path.open(encoding="utf-8", newline="") as file:
            rows = list(csv.reader(file))
        texts = [cell for row in rows for cell in row if not _is_number(cell)]
        assert not [cell for cell in texts if cell.startswith(("=", "+", "-", "@", "\t", "\r"))]
        assert any(joint in cell for cell in texts)
    assert any(float(cell) < 0 for row in rows[1:] for cell in row if _is_number(cell))


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True


def test_junit_is_read_by_a_junit_reader(tmp_path: Path, audit: Audit) -> None:
    path = tmp_path / "r.xml"
    write_report(path, [audit, samples.not_judged(), samples.passed(5000), samples.hostile()], "junit", [BROKEN])
    suites = JUnitXml.fromfile(str(path))
    results = {case.name: case.result for suite in suites for case in suite}
    assert (suites.tests, suites.failures, suites.errors) == (5, 2, 2)
    assert isinstance(results[audit.result.log.name][0], Failure)
    assert isinstance(results["broken.bag"][0], Error), "what was not judged is an error, never skipped"
    assert results["quiet_night.mcap"] == []


def test_markdown_is_read_as_tables(audit: Audit) -> None:
    tokens = (
        MarkdownIt("commonmark").enable("table").parse(report_text([audit, samples.hostile()], "markdown", [BROKEN]))
    )
    kinds = [token.type for token in tokens]
    assert kinds.count("table_open") >= 1
    assert not [token for token in tokens if token.type.startswith("html")]
    inner = [child.type for token in tokens for child in token.children or ()]
    assert not {"html_inline", "image", "link_open"} & set(inner)


#: A workflow command as the runner takes it apart.
COMMAND = re.compile(r"^::(?P<command>error|warning|notice)(?: (?P<properties>[^:]*))?::(?P<message>[^\r\n]*)$")


def test_github_annotations_are_one_command_a_line(audit: Audit) -> None:
    text = report_text([audit, samples.hostile(), samples.passed(5000), samples.not_judged()], "github", [BROKEN])
    found = [COMMAND.match(line) for line in text.splitlines()]
    assert all(found)
    levels = [match["command"] for match in found if match]
    assert levels.count("error") == 2 and levels.count("warning") == 2
    assert levels[0] == "error", "worst first"
    assert "broken.bag" in text and "\x1b" not in text
    assert f"title=FAIL%3A {audit.result.log.name}" in text


def test_files_do_not_go_to_stdout(audit: Audit) -> None:
    for name, known in FORMATS.items():
        if known.files:
            with pytest.raises(ConfigError, match="written to files"):
                report_text([audit], name)


def test_an_export_of_signals_tells_how_far_it_is(tmp_path: Path) -> None:
    told: list[float] = []
    audit = samples.failed(60_000)
    write_report(tmp_path / "run.mcap", [audit], "mcap", progress=lambda done, of: told.append(done / of))
    assert told == sorted(told) and told[-1] == 1.0
