"""docs/debug-a-verdict.md is a promise: its lines run in order, and lead from a contact to the samples behind it."""

from __future__ import annotations

import re
import shlex
from pathlib import Path
from typing import Any

import pytest

from collaudit.cli.main import run
from collaudit.core.data.signals import State

PAGE = Path(__file__).resolve().parents[2] / "docs" / "debug-a-verdict.md"


def test_the_page_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.chdir(tmp_path)
    names: dict[str, Any] = {}
    for language, block in re.findall(r"```(sh|python)\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL):
        if language == "python":
            exec(compile(block, str(PAGE), "exec"), names)
            continue
        expected = 0
        for line in block.splitlines():
            if stated := re.match(r"# exit (\d+)", line):
                expected = int(stated[1])
                continue
            assert run(shlex.split(line)[1:]) == expected, line
            expected = 0
    facts, contact, joint = names["facts"], names["contact"], names["joint"]
    assert facts["verdict"] == "fail" and joint in facts["rule"]["watch"]
    fired = names["above"] & (names["here"][f"state:{joint}"] <= 1)
    assert fired.loc[contact["onset_s"] - 1e-6 :].iloc[: facts["rule"]["n"]].all(), "n samples in a row from the onset"
    assert "samples above γ in force" in capsys.readouterr().out


def test_the_page_names_every_state() -> None:
    named = re.findall(r'(\d+): "([a-z-]+)"', PAGE.read_text(encoding="utf-8"))
    assert [(int(number), code) for number, code in named] == [(state.value, state.code) for state in State]
