"""Running the command line in process on real logs, in a folder of the test's own."""

from __future__ import annotations

import contextlib
import io
import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from fits_once import share_fits

from collaudit.cli.main import run


@dataclass(frozen=True)
class Outcome:
    """Exit code and output of one command."""

    code: int
    out: str
    err: str


Command = Callable[..., Outcome]


@pytest.fixture(autouse=True)
def fits_are_shared(monkeypatch: pytest.MonkeyPatch, once: Callable[..., Any]) -> None:
    """Several tests begin with the same commands on the same log."""
    share_fits(monkeypatch, once)


@pytest.fixture
def cli(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Command:
    """Run `collaudit ARGS...` inside an empty folder."""
    monkeypatch.chdir(tmp_path)

    def call(*args: object) -> Outcome:
        out, err = io.StringIO(), io.StringIO()
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            code = run([str(a) for a in args])
        assert "Traceback" not in err.getvalue()
        return Outcome(code, out.getvalue(), err.getvalue())

    return call


def load(path: str | Path) -> Any:
    """A JSON file of the test's folder."""
    return json.loads(Path(path).read_text(encoding="utf-8"))
