"""``make bench``: what help and a page cost, beside what they cannot do without."""

from __future__ import annotations

import subprocess
import sys
import time
from pathlib import Path

import pytest

pytestmark = pytest.mark.bench
REPORT_HOUR = Path(__file__).with_name("report_hour.py")


def test_help_costs_at_most_twice_the_import_of_click() -> None:
    """Side by side, the best of several: the machine may be busy with other things."""
    base, shown = [], []
    for _ in range(6):
        base.append(_seconds("import click"))
        shown.append(_seconds("from collaudit.cli.main import main; main(['--help'])"))
    print(f"import click: {min(base):.3f} s, --help: {min(shown):.3f} s")
    assert min(shown) <= 2 * min(base)


def test_a_page_costs_little_more_than_reading_the_signals(tmp_path: Path) -> None:
    """Ten minutes of seven joints, the best of several."""
    subprocess.run([sys.executable, REPORT_HOUR, "write", tmp_path, "10"], check=True)
    seconds = {"read": 1e9, "report": 1e9}
    for part in ("read", "report") * 3:
        subprocess.run([sys.executable, REPORT_HOUR, part, tmp_path], check=True)
        seconds[part] = min(seconds[part], float((tmp_path / f"{part}.txt").read_text().split()[0]))
    print({part: f"{took:.2f} s" for part, took in seconds.items()})
    assert seconds["report"] < 2.5 * seconds["read"]


def _seconds(code: str) -> float:
    start = time.perf_counter()
    subprocess.run([sys.executable, "-c", code], check=True, capture_output=True)
    return time.perf_counter() - start
