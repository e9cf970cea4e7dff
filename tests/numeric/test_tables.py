"""A log's tables are put into files where memory would not hold them, and nothing but their place differs."""

from __future__ import annotations

import errno
import math
import os
from pathlib import Path

import numpy as np
import pytest

from collaudit.core.numeric import tables
from collaudit.core.numeric.tables import copied, folder_of_tables, memory_bytes, picked, table


@pytest.fixture
def in_files(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """No memory at all: every table is a file in this folder."""
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr(tables, "memory_bytes", lambda: 0.0)
    return tmp_path


def is_in_a_file(x: np.ndarray) -> bool:
    owner: object = x
    while isinstance(owner, np.ndarray) and owner.base is not None:
        owner = owner.base
    return not isinstance(owner, np.ndarray)


def test_a_table_is_in_memory_where_all_tables_of_its_log_fit(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tables, "memory_bytes", lambda: 18.0 * 1000 * 3 * 8)
    assert not is_in_a_file(table(1000, 3))
    assert is_in_a_file(table(1001, 3))
    assert not is_in_a_file(table(1001, 3, np.int8))


def test_a_table_in_a_file_is_an_array_like_any_other(in_files: Path) -> None:
    x = np.random.default_rng(1).normal(size=(1000, 3))
    made = copied(x)
    assert is_in_a_file(made)
    assert made.flags.f_contiguous
    assert made.flags.writeable
    assert np.array_equal(made, x)
    assert np.array_equal(picked(made, [2, 0]), x[:, [2, 0]])
    made[:, 1] = np.nan
    assert np.isnan(made[:, 1]).all()
    assert table(0, 3).shape == (0, 3)
    assert not list(in_files.iterdir()), "the files have no names"


def test_a_disk_without_room_is_one_clear_error(in_files: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "posix_fallocate", full, raising=False)
    with pytest.raises(MemoryError, match="memory cannot hold") as failed:
        table(1000, 3)
    assert str(in_files) in str(failed.value)
    assert "No space left" in str(failed.value)
    assert "TMPDIR" in str(failed.value)


def test_the_folder_of_tables(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("TMPDIR", str(tmp_path / "absent"))
    monkeypatch.setattr(tables, "memory_bytes", lambda: 0.0)
    assert folder_of_tables() == str(tmp_path / "absent")
    with pytest.raises(MemoryError, match="No such file or directory in"):
        table(10, 1)
    monkeypatch.delenv("TMPDIR")
    assert Path(folder_of_tables()).is_dir()


def test_a_limit_of_the_process_counts_as_its_memory() -> None:
    resource = pytest.importorskip("resource")
    before = resource.getrlimit(resource.RLIMIT_DATA)
    whole = memory_bytes()
    assert 1e8 < whole < math.inf
    resource.setrlimit(resource.RLIMIT_DATA, (8 << 30 if whole > 8 << 30 else int(whole) - 1, before[1]))
    try:
        assert memory_bytes() <= min(8 << 30, whole - 1)
    finally:
        resource.setrlimit(resource.RLIMIT_DATA, before)


@pytest.mark.parametrize(
    ("listed", "limit"),
    [
        ("0::/night/worker\n", 734003200.0),
        ("0::/night\n", math.inf),
        ("9:name=systemd:/\n4:memory:/process/7\n0::/\n", 5e8),
        ("4:cpu,memory:/elsewhere\n", 6e8),
        ("3:cpuset:/night/worker\n", math.inf),
        ("", math.inf),
    ],
)
def test_limits_of_the_groups_that_hold_a_process(tmp_path: Path, listed: str, limit: float) -> None:
    stated = {
        "night/memory.max": "max",
        "night/worker/memory.max": "734003200",
        "memory/memory.limit_in_bytes": "600000000",
        "memory/process/memory.limit_in_bytes": "500000000",
        "memory/process/7/memory.limit_in_bytes": "9223372036854771712",
    }
    for name, text in stated.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text + "\n")
    assert tables._group_bytes(listed, tmp_path) == limit
