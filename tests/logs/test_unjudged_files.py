"""What lies in a folder and was not judged: which kind it is, and whether it counts as not judged."""

from __future__ import annotations

import io
import os
import tarfile
import zipfile
from pathlib import Path

import pytest

from collaudit.core.errors import LogError
from collaudit.core.logs.inputs import expand_inputs, left_out, left_out_urls, other_files


def tar_of(path: Path, mode: str, *names: str, size: int = 10) -> Path:
    with tarfile.open(path, mode) as tar:
        for name in names:
            info = tarfile.TarInfo(name)
            info.size = size
            tar.addfile(info, io.BytesIO(bytes(size)))
    return path


def zip_of(path: Path, *names: str) -> Path:
    with zipfile.ZipFile(path, "w") as archive:
        for name in names:
            archive.writestr(name, "x")
    return path


def kind(path: Path, rule: str = "not_judged") -> tuple[str, bool] | None:
    found = left_out([path], rule)
    return (found[0].kind, found[0].not_judged) if found else None


@pytest.mark.parametrize(
    "name",
    [
        "night.bag.active", "run.csv.1", "run.mcap.part", "run.csv.part.1", "run.db3-wal", "run.bag.orig.active",
        "run.CSV.TMP", "run.mcap.crdownload", "run.csv~", "unknown.active",
    ],
)  # fmt: skip
def test_what_a_recorder_left_counts_whatever_the_policy_says(name: str, tmp_path: Path) -> None:
    (tmp_path / name).write_text("x")
    assert [kind(tmp_path / name, rule) for rule in ("not_judged", "list", "ignore")] == 3 * [("leftover", True)]


@pytest.mark.parametrize("name", ["collision.log", "run2.txt", "run3.dat", "run4.ulg", "notes.1", "run", "r\nn.dat"])
def test_other_names_do_what_the_policy_says(name: str, tmp_path: Path) -> None:
    (tmp_path / name).write_text("x")
    found = [kind(tmp_path / name, rule) for rule in ("not_judged", "list", "ignore")]
    assert found == [("other", True), ("other", False), None]


def test_companions_of_logs_are_named_and_never_count(tmp_path: Path) -> None:
    for name in ("cell.toml", "arm.urdf", "film.mp4", "README", "SHA256SUMS", "summary.xml"):
        assert kind(tmp_path / name) == ("companion", False)


def test_archives_count_unless_they_hold_no_log(tmp_path: Path) -> None:
    holding = [
        tar_of(tmp_path / "a.tar.gz", "w:gz", "notes.txt", "deep/run.mcap"),
        tar_of(tmp_path / "b.tar", "w", "run.bag.active"),
        tar_of(tmp_path / "b.tar.xz", "w:xz", "run.csv"),
        zip_of(tmp_path / "c.zip", "run.csv", "other.csv"),
        tar_of(tmp_path / "d.tgz", "w:gz", "film.avi", size=20 << 20),  # what follows 16 MB is not looked at
    ]
    for unknown in ("e.7z", "f.rar", "g.tar.gz", "h.zip"):
        (tmp_path / unknown).write_bytes(b"damaged")
        holding.append(tmp_path / unknown)
    assert [kind(path, "ignore") for path in holding] == len(holding) * [("archive", True)]
    assert "run.mcap" in left_out(holding[:1], "list")[0].text
    empty = [tar_of(tmp_path / "x.tar.gz", "w:gz", "a.txt", "b.png"), zip_of(tmp_path / "y.zip", "a.txt", "b.txt")]
    assert [kind(path, "list") for path in empty] == 2 * [("other", False)]


def test_a_folder_is_looked_through_and_patterns_too(tmp_path: Path) -> None:
    night = tmp_path / "night"
    (night / "cell").mkdir(parents=True)
    for name in ("run.csv", "cell/run.csv.1", "collision.log", ".run.csv.Xk2a9", ".hidden", "._run.csv"):
        (night / name).write_text("t,q1\n0,0\n")
    for arguments in ([night], [str(tmp_path / "nig*")]):
        names = {path.relative_to(night).as_posix() for path in other_files(arguments)}
        assert names == {"cell/run.csv.1", "collision.log", ".run.csv.Xk2a9"}
        assert expand_inputs(arguments) == [night / "run.csv"]
    assert other_files([night / "run.csv", night / "collision.log"]) == [], "what is named itself is not left out"


def test_a_folder_that_cannot_be_read_stands_for_what_is_in_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    closed = tmp_path / "closed"
    closed.mkdir()
    (tmp_path / "run.csv").write_text("t,q1\n0,0\n")
    inside = Path.iterdir

    def refused(path: Path):
        if path == closed:
            raise PermissionError
        return inside(path)

    monkeypatch.setattr(Path, "iterdir", refused)
    assert expand_inputs([tmp_path]) == [tmp_path / "run.csv"]
    assert [(one.kind, one.not_judged) for one in left_out(other_files([tmp_path]), "ignore")] == [("unreadable", True)]


def test_a_pipe_is_not_waited_for_and_counts(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "run.csv")
    assert kind(tmp_path / "run.csv", "ignore") == ("unreadable", True)


def test_a_folder_without_logs_says_what_it_holds(tmp_path: Path) -> None:
    (tmp_path / "night.bag.active").write_text("x")
    with pytest.raises(LogError) as caught:
        expand_inputs([tmp_path])
    assert "night.bag.active" in caught.value.render()


def test_remote_files_are_told_by_their_names() -> None:
    urls = ["s3://n/x.zip", "s3://n/collision.log", "s3://n/a.bag.active", "s3://n/cell.toml"]
    assert [one.not_judged for one in left_out_urls(urls, "list")] == [True, False, True, False]
