"""ROS 2 bags whose recorder compressed them, message by message or file by file: the same log as without."""

from __future__ import annotations

import shutil
import sqlite3
from pathlib import Path

import log_writers as w
import numpy as np
import pytest
import zstandard

from collaudit.core.config.schema import LogConfig
from collaudit.core.data.joint_log import JointLog
from collaudit.core.errors import LogError
from collaudit.core.logs.log_description import describe
from collaudit.core.logs.log_reading import read_log

COUNT = 400


def read(path: Path) -> JointLog:
    return read_log((path,), LogConfig(), robot_joints=None)


@pytest.fixture(scope="module")
def reference(tmp_path_factory: pytest.TempPathFactory) -> JointLog:
    return read(w.write_folder(tmp_path_factory.mktemp("plain") / "bag", w.motion(COUNT)))


def check(log: JointLog, reference: JointLog) -> None:
    assert log.joint_names == reference.joint_names
    for name in ("time_s", "position_rad", "velocity_rad_s", "effort"):
        np.testing.assert_array_equal(getattr(log, name), getattr(reference, name))
    assert not [finding for finding in log.findings if finding.code in ("log-partial", "log-left-out")]


@pytest.mark.parametrize("method", ["zstd", "lz4"])
@pytest.mark.parametrize("storage", ["sqlite3", "mcap"])
def test_compressed_messages(method: str, storage: str, tmp_path: Path, reference: JointLog) -> None:
    folder = w.write_folder(tmp_path / "bag", w.motion(COUNT), storage=storage, packing=f"message-{method}")
    assert "compression_mode: message" in (folder / "metadata.yaml").read_text().lower()
    check(read(folder), reference)
    lone = shutil.copy(w.storage_file(folder), tmp_path)
    check(read(Path(lone)), reference)
    joints = next(topic for topic in describe((folder,)).topics if topic.name == "/joint_states")
    assert (joints.count, len(joints.joints)) == (COUNT, 6)


@pytest.mark.parametrize("method", ["zstd", "lz4"])
@pytest.mark.parametrize("storage", ["sqlite3", "mcap"])
def test_compressed_files(method: str, storage: str, tmp_path: Path, reference: JointLog) -> None:
    folder = w.write_folder(tmp_path / "bag", w.motion(COUNT), storage=storage, packing=f"file-{method}")
    suffix = ".db3" if storage == "sqlite3" else ".mcap"
    (packed,) = folder.glob(f"*{suffix}.{method}")
    check(read(folder), reference)
    assert describe((folder,)).format == read(folder).source.format
    (folder / "metadata.yaml").write_text("")
    log = read(folder)
    np.testing.assert_array_equal(log.position_rad, reference.position_rad)
    assert packed.name in next(finding.text for finding in log.findings if finding.code == "log-partial")


@pytest.mark.parametrize("method", ["zstd", "lz4"])
def test_a_compressed_file_cut_short_says_what_was_read(method: str, tmp_path: Path) -> None:
    whole = read(w.write_folder(tmp_path / "plain" / "bag", w.motion(5 * COUNT), storage="mcap"))
    folder = w.write_folder(tmp_path / "bag", w.motion(5 * COUNT), storage="mcap", packing=f"file-{method}")
    (packed,) = folder.glob(f"*.{method}")
    packed.write_bytes(packed.read_bytes()[: packed.stat().st_size // 2])
    log = read(folder)
    count = log.time_s.shape[0]
    assert 0 < count < 5 * COUNT
    np.testing.assert_array_equal(log.position_rad, whole.position_rad[:count])
    assert any(finding.severity == "error" for finding in log.findings if finding.code == "log-partial")


def test_a_file_that_becomes_too_large_is_refused(tmp_path: Path) -> None:
    folder = w.write_folder(tmp_path / "bag", w.motion(10), packing="file-zstd")
    (packed,) = folder.glob("*.zstd")
    bomb = zstandard.ZstdCompressor().compressobj()
    head = bomb.compress(b"SQLite format 3\0")
    packed.write_bytes(head + b"".join(bomb.compress(bytes(1 << 24)) for _ in range(16)) + bomb.flush())
    with pytest.raises(LogError, match="more than its size allows"):
        read(folder)


def test_no_copy_is_left_behind(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = w.write_folder(tmp_path / "bag", w.motion(10), packing="file-zstd")
    copies = tmp_path / "copies"
    copies.mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(copies))
    read(folder)
    describe((folder,))
    assert list(copies.iterdir()) == []


@pytest.mark.parametrize("spoilt", ["cut", "bomb", "noise"])
def test_messages_that_cannot_be_unpacked_are_counted(spoilt: str, tmp_path: Path, reference: JointLog) -> None:
    folder = w.write_folder(tmp_path / "bag", w.motion(COUNT, with_wrench=False), packing="message-zstd")
    bag = sqlite3.connect(w.storage_file(folder))
    (data,) = bag.execute("SELECT data FROM messages WHERE id = 100").fetchone()
    bad = {
        "cut": data[:-20],
        "bomb": zstandard.ZstdCompressor().compress(bytes(1 << 27)),
        "noise": data[:20] + bytes(reversed(data[20:])),
    }[spoilt]
    bag.execute("UPDATE messages SET data = ? WHERE id = 100", (bad,))
    bag.commit()
    bag.close()
    log = read(folder)
    np.testing.assert_array_equal(log.position_rad, np.delete(reference.position_rad, 99, axis=0))
    (finding,) = [finding for finding in log.findings if finding.code == "log-left-out"]
    assert "1 of 400 messages" in finding.text


def test_other_compression_is_refused_by_its_name(tmp_path: Path) -> None:
    folder = w.write_folder(tmp_path / "bag", w.motion(10), packing="message-zstd")
    metadata = folder / "metadata.yaml"
    metadata.write_text(metadata.read_text().replace("compression_format: zstd", "compression_format: snappy"))
    with pytest.raises(LogError, match="snappy"):
        read(folder)
