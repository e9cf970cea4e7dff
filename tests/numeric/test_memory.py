"""What limits memory is known, and a log that does not fit is refused."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from collaudit.core.errors import NotJudgedError
from collaudit.core.numeric import linear_algebra as memory
from collaudit.core.numeric.linear_algebra import memory_bytes
from collaudit.core.prepare import preparation
from collaudit.core.prepare.preparation import refuse_larger_than_memory


def test_a_log_that_memory_cannot_hold_is_refused_with_a_way_on(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(preparation, "memory_bytes", lambda: 18.0 * 1000 * 3 * 8)
    refuse_larger_than_memory(1000, 3, "log.mcap")
    with pytest.raises(NotJudgedError) as refused:
        refuse_larger_than_memory(1001, 3, "log.mcap")
    assert refused.value.where == "log.mcap" and "log.from_s" in str(refused.value.hint)


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
    assert memory._group_bytes(listed, tmp_path) == limit
