"""Tables between blanks: read by pandas they give the same as line by line, or the same error."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from collaudit.core.config.schema import LogConfig
from collaudit.core.data.joint_log import JointLog
from collaudit.core.errors import LogError
from collaudit.core.logs import read_log
from collaudit.core.logs.csv import csv_parsing

SETTINGS = LogConfig.of({"csv": {"time": "1", "position": "2", "effort": "3"}})
#: What the last row but one says, and the text after the last.
ROWS = [
    "0.4 0.004 1.4", "  0.4   0.004\t1.4 ", "0.4 nan 1.4", "0.4 NA 1.4", "0.4 0.004 nan", "0.4 0.004",
    "0.4 0.004 1.4 9", "0.4 x 1.4", "0.4 1_000 1.4", "0.4 0x10 1.4", "# 0.4 0.004 1.4", "",
    "   ", "0.4 True 1.4", "0.4 1e400 1.4",
    "0.4 -0 +1.4", "0.4 .5 1.", "0.4 12345678901234567890123 1.4", "4 5 6", '0.4 "0.004" 1.4',
    "0.4 0.123456789012345678 1", "0.4 1,5 2",
]  # fmt: skip


def read(path: Path) -> JointLog | str:
    try:
        return read_log((path,), SETTINGS, robot_joints=None)
    except LogError as error:
        return error.render()


@pytest.mark.parametrize("row", ROWS)
@pytest.mark.parametrize("end", ["\n", ""])
def test_both_ways_agree(row: str, end: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "log.txt"
    lines = [f"{k / 10:.18e} {k / 1000:.18e} {1 + k / 10:.18e}" for k in range(4)]
    path.write_text("\n".join([*lines, row, "0.5 0.005 1.5"]) + end)
    fast = read(path)
    monkeypatch.setattr(csv_parsing, "read_plain", lambda *_: None)
    slow = read(path)
    if isinstance(fast, str) or isinstance(slow, str):
        assert fast == slow
        assert "line" in str(fast)
        return
    for name in ("time_s", "position_rad", "effort"):
        np.testing.assert_array_equal(getattr(fast, name), getattr(slow, name))


def test_plain_tables_take_the_fast_way(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    taken = []
    own = csv_parsing.read_plain
    monkeypatch.setattr(csv_parsing, "read_plain", lambda *given: taken.append(own(*given)) or taken[-1])
    path = tmp_path / "log.txt.gz"
    np.savetxt(path, np.random.default_rng(1).normal(size=(200, 3)).cumsum(axis=0) ** 2)
    read(path)
    assert taken[0] is not None
