"""docs/real-logs.md is a promise: every command it shows runs, in order, and ends as the page says."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from collaudit.cli.main import collaudit, run
from collaudit.core.errors import EXIT_USAGE

pytestmark = pytest.mark.real
PAGE = Path(__file__).resolve().parents[2] / "docs" / "real-logs.md"
#: Arms whose logs the page fits, by the names of their files.
FITTED = ("ur10", "ur3.", "ur3_bags", "ur3_mcap", "panda", "tiago")


def commands() -> list[str]:
    blocks = re.findall(r"```sh\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    return [line for block in blocks for line in block.splitlines() if line.strip()]


def ran(line: str, shell: bool, capfd: pytest.CaptureFixture[str]) -> tuple[int, str]:
    """Exit code and words of a line: our own commands in this process, which has imported all, or a shell's."""
    if shell or not line.startswith("collaudit "):
        done = subprocess.run(["bash", "-c", line], capture_output=True, text=True, timeout=120)
        return done.returncode, done.stderr
    capfd.readouterr()
    code = run(shlex.split(os.path.expandvars(line))[1:])
    return code, capfd.readouterr().err


@pytest.mark.parametrize(
    "fitted", [False, pytest.param(True, marks=pytest.mark.bench)], ids=["what needs no fit", "every command"]
)
def test_every_command_of_the_page_runs(
    tmp_path: Path, data_dir: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str], fitted: bool
) -> None:
    """Of the arms whose logs are fitted, tests/real/test_real_logs.py runs the steps; here in `make bench`."""
    monkeypatch.chdir(tmp_path)
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    for name, value in (("DATA", str(data_dir)), ("NO_COLOR", "1"), ("PATH", path)):
        monkeypatch.setenv(name, value)
    lines = [line for line in commands() if fitted or not any(arm in line for arm in FITTED)]
    assert len(lines) >= (25 if fitted else 9)
    codes = {}
    for line in lines:
        codes[line], said = ran(line, fitted and line == lines[0], capfd)
        assert codes[line] != EXIT_USAGE, f"{line}\n{said}"
        assert "Traceback" not in said
    assert all(codes[line] == 3 for line in lines if line.endswith("-o out")), "what is no robot log is not judged"
    assert all(codes[line] == 3 for line in lines if "kuka" in line and " detect " in line)
    assert not (tmp_path / "out").exists()
    if fitted:
        inverted = [
            line for line in lines if line.startswith(("collaudit init", "collaudit inspect")) and "ur3" in line
        ]
        assert [codes[line] for line in inverted] == [3, 3], "an inverted effort is not judged until its sign is stated"
        assert all(codes[line] in (0, 1) for line in lines if "-o ur" in line and line not in inverted)
        assert (tmp_path / "ur10.html").exists()


@pytest.mark.parametrize("line", [line for line in commands() if line.startswith("collaudit ")])
def test_every_command_of_the_page_is_one(line: str) -> None:
    """Its options and their values are known; nothing is run."""
    name, *words = shlex.split(line)[1:]
    command = collaudit.get_command(None, name)  # type: ignore[arg-type]
    assert command is not None
    command.make_context(name, words)
