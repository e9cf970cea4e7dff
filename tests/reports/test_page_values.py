"""What the page says in words and numbers where a careless text would mislead."""

from __future__ import annotations

import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import samples

from collaudit.core.data.detection_result import ControllerAlarmComparison
from collaudit.core.errors import LogError
from collaudit.reports.page.index import write_index
from collaudit.reports.sections.event_sections import mark_text
from collaudit.reports.sections.judged_sections import residual_section
from collaudit.reports.values.entries import entry_of, entry_of_error
from collaudit.reports.values.words import clock_text, counted

BENCH = Path(__file__).resolve().parents[1] / "bench"


def test_wall_clock() -> None:
    assert clock_text("2024-03-12T22:04:11.250000Z", 28.0) == "2024-03-12 22:04:39.250 UTC"
    assert clock_text("2024-12-31T23:59:59Z", 1.5) == "2025-01-01 00:00:00.500 UTC"
    assert clock_text(None, 1.0) == clock_text("yesterday", 1.0) == clock_text("2024-01-01", 1e300) == "–"


def test_the_largest_residual_covers_every_listed_event() -> None:
    result = samples.failed(2000).result
    near = replace(result.near_misses[0], joint="elbow", peak_nm=-12.5)
    rows = {row["joint"]: row for row in residual_section(replace(result, near_misses=(near,))).records}
    assert rows["elbow"]["largest"].startswith("12.5")


def test_no_zero_where_the_log_was_not_judged() -> None:
    result = samples.failed(2000).result
    assert counted(0, replace(result, verdict="not_judged")) == "–"
    assert counted(2, replace(result, verdict="not_judged")) == "2"
    assert counted(0, result) == "0"


def test_a_label_is_named_with_how_it_goes_with_a_contact() -> None:
    flag = ControllerAlarmComparison(4.0, None, "not-judged", None, "grasp")
    assert mark_text(flag) == "label grasp at 4.000 s: not judged: no contact could have been noticed here"
    agreed = ControllerAlarmComparison(4.0, 3.9, "agreed", 0.1, "stopped")
    assert mark_text(agreed) == "label stopped at 4.000 s, 100 ms after the detection: agrees with a contact"


def test_an_index_of_a_thousand_logs_is_quick(tmp_path: Path) -> None:
    entry = entry_of(samples.failed(2000).result, "run/report.html")
    entries = [replace(entry, name=f"{k}.bag", start=f"2024-01-01T00:{k % 60:02}:00Z") for k in range(1000)]
    start = time.process_time()
    write_index(tmp_path, [*entries, entry_of_error("b.bag", LogError("cut short"))])
    assert time.process_time() - start < 5


def test_a_page_takes_little_more_memory_than_reading_the_signals(tmp_path: Path) -> None:
    """Ten minutes of seven joints, in processes of their own; time is measured by ``tests/bench``."""
    peak_mb = {}
    subprocess.run([sys.executable, BENCH / "report_hour.py", "write", tmp_path, "10"], check=True)
    for part in ("read", "report"):
        subprocess.run([sys.executable, BENCH / "report_hour.py", part, tmp_path], check=True)
        peak_mb[part] = float((tmp_path / f"{part}.txt").read_text().split()[1])
    assert peak_mb["report"] < 1.2 * peak_mb["read"]
    assert (tmp_path / "report.html").stat().st_size < 1_500_000
