"""Patterns name what glob names, and a circle of links ends at once."""

from __future__ import annotations

import glob
import os
import time
from pathlib import Path

import pytest

from collaudit.core.errors import CollauditError
from collaudit.core.logs.inputs import expand_inputs, matching_paths

PATTERNS = ("*.csv", "**/*.csv", "a/**/*.csv", "**/b/*.csv", "a/*/x.csv", "**/a/**/x.csv", ".hidden/*.csv", "?/[b]/*")
#: ``**`` inside a name is ``*``; behind the last slash only folders are meant.
PATTERNS += ("**.csv", "a/x**", "a/*/")


@pytest.fixture
def tree(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    for name in ("x.csv", "a/x.csv", "a/b/x.csv", "a/b/y.mcap", "c [1]/x.csv", ".hidden/x.csv", "a/.hidden/x.csv"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).touch()
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("absolute", [False, True])
@pytest.mark.parametrize("pattern", PATTERNS)
def test_as_glob_without_links(pattern: str, absolute: bool, tree: Path) -> None:
    whole = str(tree / pattern) if absolute else pattern
    assert [str(path) for path in matching_paths(whole)] == _named(glob.glob(whole, recursive=True))  # noqa: PTH207


def _named(found: list[str]) -> list[str]:
    return [str(Path(name)) for name in sorted(set(found))]


def test_a_circle_of_links_ends(tree: Path) -> None:
    for number in range(6):
        (tree / "a" / f"up{number}").symlink_to(tree)
    started = time.process_time()
    assert [str(path) for path in matching_paths("**/*.csv")] == ["a/b/x.csv", "a/x.csv", "c [1]/x.csv", "x.csv"]
    assert time.process_time() - started < 5


def test_pipes_and_devices_are_no_logs(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.csv")
    for path in (tmp_path / "pipe.csv", Path("/dev/zero")):
        with pytest.raises(CollauditError, match="no regular file"):
            expand_inputs([path])
    with pytest.raises(CollauditError, match="no regular file"):
        expand_inputs([str(tmp_path / "*.csv")])
