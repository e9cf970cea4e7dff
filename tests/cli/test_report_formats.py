"""Adding a report format: one file and one line, and every command knows it."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from collaudit.core.errors import ConfigError
from collaudit.reports.formats.registry import FORMATS, summary_text

#: The one file: its function takes results, the lines of logs that could not be audited, and the night.
TOY = '''
"""A toy report format: a verdict a line."""

def verdicts_text(results, unread, night):
    lines = [f"{result.log.name} {result.verdict}" for result in results]
    return "\\n".join([*lines, *(f"{entry.name} unread" for entry in unread)]) + "\\n"
'''
#: The one line, here in front of the command since the registry itself is not edited.
RUN = """
import sys
from collaudit.reports.formats.registry import FORMATS, ReportFormat
FORMATS["toy"] = ReportFormat(".toy", "toy_report:verdicts_text", of_many=True)
from collaudit.cli.main import run
sys.exit(run(sys.argv[1:]))
"""


@pytest.fixture
def with_toy(tmp_path: Path):
    """Run a command of a collaudit that has the toy format."""
    (tmp_path / "toy_report.py").write_text(TOY, encoding="utf-8")

    def run(*args: object) -> subprocess.CompletedProcess[str]:
        path = os.pathsep.join([str(tmp_path), os.environ.get("PYTHONPATH", "")])
        command = [sys.executable, "-c", RUN, *map(str, args)]
        return subprocess.run(command, capture_output=True, text=True, env={**os.environ, "PYTHONPATH": path})

    return run


def test_a_toy_format_is_offered_and_written_by_every_command(with_toy, arm, tmp_path: Path) -> None:
    for command, before in (("report", "mcap"), ("audit", "slack-json")):
        assert f"{before}, toy," in " ".join(with_toy(command, "--help").stdout.split())
    assert ", toy" in with_toy("report", "x", "-o", "-", "--format", "pdf").stderr
    bad = tmp_path / "bad.csv"
    bad.write_text("t,q1\n0,0\n")
    judged = ["-c", arm.config, "--friction", arm.friction, "-o", tmp_path / "out", "--format", "toy"]
    assert with_toy("audit", arm.clean, bad, *judged).returncode == 3
    name = "clean.csv"
    assert sorted((tmp_path / "out/summary.toy").read_text().splitlines()) == sorted(
        [f"{tmp_path.name}/bad.csv unread", f"{name} pass"]
    )
    (run,) = (path.parent for path in (tmp_path / "out").rglob("audit.json"))
    shown = with_toy("report", run, "-o", tmp_path / "page.html", "--format", "html,toy")
    assert shown.returncode == 0, shown.stderr
    assert (tmp_path / "page.toy").read_text() == f"{name} pass\n"


def test_help_and_names_come_from_the_registry(collaudit) -> None:
    everything = " ".join(collaudit("report", "--help").out.split())
    assert f"Out of {', '.join(FORMATS)}, separated" in everything
    refused = collaudit("audit", "x", "-o", "out", "--format", "html")
    assert refused.code == 2
    assert "expected: junit, sarif, markdown, github" in refused.err


def test_suffixes_are_apart() -> None:
    assert len({fmt.suffix for fmt in FORMATS.values()}) == len(FORMATS)


def test_a_format_of_one_run_is_none_of_many() -> None:
    with pytest.raises(ConfigError, match="not for many logs"):
        summary_text([], "html")


def test_limits_on_the_command_line(arm, collaudit, tmp_path: Path) -> None:
    before = tmp_path / "before"
    collaudit("detect", arm.pushed, "-c", arm.config, "--friction", arm.friction, "-o", before)
    limits = tmp_path / "limits.toml"
    limits.write_text('source = "ours"\n[[region]]\nname = "hand"\ntransient_n = 200\n')
    shown = collaudit("report", before, "--limits", limits)
    assert shown.code == 0 and "200 N transient" in shown.out and "no assessment" in shown.out
    assert json.loads(collaudit("report", before, "--limits", limits, "--json").out)["source"] == "ours"
    page = tmp_path / "limits.html"
    assert collaudit("report", before, "--limits", limits, "-o", page).code == 0 and "<html" in page.read_text()
    assert collaudit("report", before, "--limits", limits, "-o", tmp_path / "x.csv").code == 2
    assert collaudit("report", before).code == 2
