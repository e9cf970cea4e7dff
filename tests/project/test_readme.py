"""What the README shows is what happens: its commands are run, its help block is the real one."""

import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest
from simulated_logs import TEN_SPEEDS
from user_guide.pages import help_text

from collaudit.cli.main import collaudit, run
from collaudit.fixtures import experiments

PROJECT = Path(__file__).resolve().parents[2]
README = (PROJECT / "README.md").read_text(encoding="utf-8")
#: The simulated person pushes the arm, so the policy is broken.
EXPECTED = {"detect": 1, "audit": 1, "init": 3, "recommend": 3}


def _block(marker: str) -> str:
    match = re.search(rf"<!-- {re.escape(marker)}[^>]*-->\n```\w*\n(.*?)```", README, re.DOTALL)
    assert match, f"README has no block after <!-- {marker} -->"
    return match.group(1)


def test_every_command_is_shown_as_its_help_says_it() -> None:
    for name, summary in collaudit.summaries.items():
        assert f"| `collaudit {name}` | {summary} |" in README
        assert summary in help_text("")


def test_it_fits_two_screens() -> None:
    assert len(README.splitlines()) <= 110


def test_it_shows_a_report() -> None:
    """A picture that is there, loads quickly, and leaves the two screens to the text."""
    shown = re.search(r'<img src="([^"]+)" width="(\d+)" alt="[^"]{20,}">\]\((\S+)\)', README)
    assert shown is not None
    assert (PROJECT / shown[1]).stat().st_size < 100_000 and int(shown[2]) <= 640
    assert (PROJECT / shown[3]).is_file()


def test_the_two_promises() -> None:
    first = re.search(r"```sh\n(.*?)```", README, re.DOTALL)
    assert first is not None
    assert first.group(1).split("\n")[:2] == ["make demo", "make test"]


def _in_a_process(args: list[str]) -> tuple[int, str]:
    program = [sys.executable, "-c", "from collaudit.cli.main import main; main()"]
    done = subprocess.run([*program, *args], capture_output=True, text=True, stdin=subprocess.DEVNULL, timeout=600)
    return done.returncode, done.stdout + done.stderr


def _here(args: list[str], capfd: pytest.CaptureFixture[str]) -> tuple[int, str]:
    capfd.readouterr()
    code = run(args)
    return code, "".join(capfd.readouterr())


@pytest.mark.slow
@pytest.mark.parametrize(
    "speeds", [TEN_SPEEDS, pytest.param(experiments.FRICTION_SPEEDS, marks=pytest.mark.bench)], ids=["ten", "all"]
)
def test_every_line_of_the_quick_start_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str], speeds: int
) -> None:
    """The friction run with a third of its speeds, which ends every line alike; with all of them in `make bench`."""
    whole = experiments.friction
    monkeypatch.setattr(experiments, "friction", lambda arm, joints, _: whole(arm, joints, speeds))
    monkeypatch.chdir(tmp_path)
    lines = [line for line in _block("quick start").splitlines() if line.strip()]
    assert len(lines) >= 9
    for line in lines:
        program, *args = shlex.split(line)
        assert program == "collaudit"
        # What reads another's files is a process of its own; the others run in this one, which has imported all.
        code, said = _in_a_process(args) if args[0] in ("detect", "report") else _here(args, capfd)
        assert code == EXPECTED.get(args[0], 0), f"{line}\n{said}"
        assert "Traceback" not in said
    for path in ("collaudit.toml", "run/audit.json", "run/signals.parquet", "report.html", "out/index.html"):
        assert (tmp_path / path).stat().st_size > 0
    assert (tmp_path / "out/run/report.html").is_file()
