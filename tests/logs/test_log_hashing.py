"""The hash of a log is that of the bytes that were read, or there is none."""

from __future__ import annotations

import os
import pickle
from collections.abc import Callable
from pathlib import Path

import log_writers as w
import pytest

from collaudit.core.config.schema import LogConfig
from collaudit.core.errors import LogError
from collaudit.core.logs.log_reading import Hashing, read_log, sha256_of

KINDS = ("mcap-zstd", "bag-none", "db3")


def appended(path: Path) -> None:
    with path.open("ab") as stream:
        stream.write(b"more")


def overwritten(path: Path) -> None:
    data, before = path.read_bytes(), path.stat()
    path.write_bytes(bytes(len(data)))
    os.utime(path, ns=(before.st_atime_ns, before.st_mtime_ns + 1))


def replaced(path: Path) -> None:
    before, other = path.stat(), path.with_name("other")
    other.write_bytes(bytes(before.st_size))
    os.utime(other, ns=(before.st_atime_ns, before.st_mtime_ns))
    other.replace(path)


def made(folder: Path, kind: str) -> Path:
    return w.write_any(folder, kind, lambda encoding: w.motion(40, joints=3, encoding=encoding))


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("change", [appended, overwritten, replaced])
def test_a_log_that_changes_while_it_is_judged_has_no_hash(
    kind: str, change: Callable[[Path], None], tmp_path: Path
) -> None:
    path = made(tmp_path, kind)
    log = read_log((path,), LogConfig(), robot_joints=None)
    change(path)
    with pytest.raises(LogError, match="has changed while it was read") as caught:
        str(pickle.loads(pickle.dumps(log)).source.sha256)
    assert caught.value.exit_code == 3 and str(path) in caught.value.render()


@pytest.mark.parametrize("kind", KINDS)
def test_a_log_that_stays_as_it_is_has_its_own(kind: str, tmp_path: Path) -> None:
    path = made(tmp_path, kind)
    hashing = Hashing((path,))
    os.utime(path, ns=(0, path.stat().st_mtime_ns))  # reading changes the time of access
    assert hashing.result() == sha256_of((path,))


def test_a_log_that_is_gone_is_said_to_be(tmp_path: Path) -> None:
    path = made(tmp_path, "mcap-zstd")
    hashing = Hashing((path,))
    path.unlink()
    with pytest.raises(LogError, match="cannot be read"):
        hashing.result()
