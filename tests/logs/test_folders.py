"""What a folder of logs holds besides plain files: nothing of it goes without a word."""

from __future__ import annotations

import os
from pathlib import Path

from collaudit.core.logs.inputs import expand_inputs, other_files

CSV = "time,a,b\n0,1,2\n1,2,3\n"


def names(root: Path, found: list[Path]) -> list[str]:
    return [str(path.relative_to(root)) for path in found]


def test_linked_folders_are_entered_once_and_in_no_circle(tmp_path: Path) -> None:
    logs, elsewhere = tmp_path / "night" / "logs", tmp_path / "elsewhere"
    for folder in (logs / "own", elsewhere):
        folder.mkdir(parents=True)
        (folder / "x.csv").write_text(CSV)
    (logs / "a_link").symlink_to(elsewhere)
    (logs / "again").symlink_to(elsewhere)
    (logs / "b_own").symlink_to(logs / "own")
    (logs / "own" / "up").symlink_to(logs)
    (logs / "far_up").symlink_to(tmp_path)
    assert names(logs, expand_inputs([logs])) == ["own/x.csv", "a_link/x.csv"]


def test_a_link_that_leads_nowhere_is_a_log_and_a_pipe_is_not(tmp_path: Path) -> None:
    (tmp_path / "lost.csv").symlink_to(tmp_path / "not" / "mounted.csv")
    (tmp_path / "circle.csv").symlink_to("circle.csv")
    os.mkfifo(tmp_path / "pipe.csv")
    assert names(tmp_path, expand_inputs([tmp_path])) == ["circle.csv", "lost.csv"]
    assert names(tmp_path, other_files([tmp_path])) == ["pipe.csv"]


def test_other_files_are_told_but_for_hidden_ones(tmp_path: Path) -> None:
    for name in ("log.csv", "log.txt", "log.csv.part", "log.zip", "log.toml", "log.truth.json", "README.md", ".hidden"):
        (tmp_path / name).write_text(CSV)
    told = ["README.md", "log.csv.part", "log.toml", "log.truth.json", "log.txt", "log.zip"]
    assert names(tmp_path, other_files([tmp_path])) == told
    assert other_files([tmp_path / "log.txt", "*.csv"]) == []
