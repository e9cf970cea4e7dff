"""The tutorial, every line as docs/tutorial.md has it; completion and manual pages as docs/install.md."""

from __future__ import annotations

import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from user_guide.man_pages import man_pages

from collaudit.cli import main as entry
from collaudit.cli.main import collaudit as group
from collaudit.core.findings.finding_kinds import KINDS

DOCS = Path(__file__).resolve().parents[2] / "docs"
PAGE = (DOCS / "tutorial.md").read_text(encoding="utf-8")
STEPS = re.findall(r"^## (\d+)\. (.+?)\n(.*?)(?=^## |\Z)", PAGE, re.MULTILINE | re.DOTALL)
WRITTEN = (
    "collaudit.toml",
    "friction.json",
    "run/signals.parquet",
    "verdict.json",
    "report.html",
    "out/index.html",
    "out/summary.xml",
    "out/summary.txt",
    "audit.mcap",
)


def test_there_are_ten_steps() -> None:
    assert [int(number) for number, _, _ in STEPS] == list(range(1, 11))
    assert all("```sh\n" in text for _, _, text in STEPS)


def _run(line: str, folder: Path) -> int:
    """A line of the page: a command in this process, anything else in a shell."""
    words = shlex.split(line)
    if words[0] == "collaudit" and ">" not in words:
        return entry.run(words[1:])
    shell = (
        f"collaudit() {{ {shlex.quote(sys.executable)} -c 'from collaudit.cli.main import main; main()' \"$@\"; }}\n"
    )
    return subprocess.run(["sh", "-c", shell + line], cwd=folder, check=False).returncode


@pytest.mark.slow
def test_every_line_of_the_tutorial_runs(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    for number, title, text in STEPS:
        for block in re.findall(r"```sh\n(.*?)```", text, re.DOTALL):
            expected = 0
            for line in block.splitlines():
                stated = re.match(r"# exit (\d+)", line)
                if stated:
                    expected = int(stated[1])
                    continue
                assert _run(line, tmp_path) == expected, f"step {number} ({title}): {line}"
                expected = 0
    for name in WRITTEN:
        assert (tmp_path / name).stat().st_size > 0, name


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_completion_of_every_shell_that_is_documented(shell: str) -> None:
    page = (DOCS / "install.md").read_text(encoding="utf-8")
    assert f"_COLLAUDIT_COMPLETE={shell}_source collaudit" in page
    done = _complete(f"{shell}_source", "")
    assert done.returncode == 0
    assert f"{shell}_complete" in done.stdout


def _complete(instruction: str, line: str) -> subprocess.CompletedProcess[str]:
    env = {**os.environ, "_COLLAUDIT_COMPLETE": instruction, "COMP_WORDS": line, "COMP_CWORD": str(line.count(" "))}
    command = [sys.executable, "-c", "from collaudit.cli.main import main; main()"]
    return subprocess.run(command, capture_output=True, text=True, env=env, check=False)


def test_commands_and_scenarios_are_completed() -> None:
    assert "plain,recommend" in _complete("bash_complete", "collaudit re").stdout
    assert _complete("bash_complete", "collaudit simulate stop").stdout == "plain,stop-go\n"


def test_there_is_a_manual_page_for_each_command_and_every_option_is_in_it() -> None:
    made = man_pages()
    assert {f"collaudit-{name}.1" for name in group.summaries} | {"collaudit.1"} == set(made)
    for each in group.summaries:
        command = group.get_command(None, each)  # type: ignore[arg-type]
        assert command is not None
        page = made[f"collaudit-{each}.1"].replace("\\-", "-")
        for param in command.params:
            assert param.param_type_name == "argument" or param.opts[0] in page
        assert "something could not be judged; never a pass" in page


@pytest.mark.skipif(shutil.which("groff") is None, reason="groff is not installed")
def test_manual_pages_are_sound_roff() -> None:
    for name, text in man_pages().items():
        done = subprocess.run(
            ["groff", "-man", "-ww", "-Tutf8"], input=text, capture_output=True, text=True, check=True
        )
        assert done.stderr == "", name


def test_findings_that_pages_name_exist() -> None:
    prefixes = {code.split("-")[0] for code in KINDS}
    named = {
        page: {
            code
            for code in re.findall(r"`([a-z]+(?:-[a-z]+)+)`", (DOCS / page).read_text(encoding="utf-8"))
            if code.split("-")[0] in prefixes
        }
        for page in ("troubleshooting.md", "tutorial.md", "choosing-gamma.md", "evidence.md", "decisions.md")
    }
    assert {page: codes - set(KINDS) for page, codes in named.items() if codes - set(KINDS)} == {}
    assert len(set().union(*named.values())) >= 5
