"""Tables between runs of blanks: they give the same as tables between commas."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from collaudit.core.config.schema import LogConfig
from collaudit.core.data.joint_log import JointLog
from collaudit.core.errors import LogError
from collaudit.core.logs.log_reading import read_log

SETTINGS = LogConfig.of({"csv": {"time": "1", "position": "2", "effort": "3"}, "units": {"time": "s"}})
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
def test_what_stands_between_blanks_is_read_as_between_commas(row: str, end: str, tmp_path: Path) -> None:
    lines = [f"{k / 10:.18e} {k / 1000:.18e} {1 + k / 10:.18e}" for k in range(4)]
    found = []
    for mark, name in ((" ", "log.txt"), (",", "log.csv")):
        text = "\n".join([*lines, row if mark == " " else ",".join(row.split()), "0.5 0.005 1.5".replace(" ", mark)])
        (tmp_path / name).write_text(text.replace(" ", mark) + end)
        found.append(read(tmp_path / name))
    blanks, commas = found
    if isinstance(blanks, str) or isinstance(commas, str):
        assert isinstance(blanks, str) and "line" in blanks
        assert isinstance(commas, str) or "1,5" in row or '"' in row
        return
    for name in ("time_s", "position_rad", "effort"):
        np.testing.assert_array_equal(getattr(blanks, name), getattr(commas, name))


def test_a_packed_table_between_blanks(tmp_path: Path) -> None:
    path = tmp_path / "log.txt.gz"
    numbers = np.column_stack([np.arange(200) / 100, np.random.default_rng(1).normal(size=(200, 2))])
    np.savetxt(path, numbers)
    log = read(path)
    assert isinstance(log, JointLog)
    np.testing.assert_array_equal(log.position_rad[:, 0], numbers[:, 1])


def test_decimal_commas_between_blanks(tmp_path: Path) -> None:
    rows = [f"{k / 100:.2f} {k / 7:.6f} {k / 3:.6f}" for k in range(30)]
    path = tmp_path / "log.txt"
    path.write_text("\n".join(rows) + "\n")
    points = read(path)
    path.write_text("\n".join(rows).replace(".", ",") + "\n")
    csv = {"time": "1", "position": "2", "effort": "3", "delimiter": " "}
    commas = read_log((path,), LogConfig.of({"csv": csv}), robot_joints=None)
    assert isinstance(points, JointLog)
    np.testing.assert_array_equal(points.position_rad, commas.position_rad)


def test_a_packed_table_between_blanks_that_is_cut_is_partial(tmp_path: Path) -> None:
    numbers = np.column_stack([np.arange(20_000) / 100, np.random.default_rng(1).normal(size=(20_000, 2))])
    np.savetxt(tmp_path / "whole.txt.gz", numbers)
    path = tmp_path / "log.txt.gz"
    path.write_bytes((tmp_path / "whole.txt.gz").read_bytes()[:-100_000])
    log = read(path)
    assert isinstance(log, JointLog)
    assert "log-partial" in {finding.code for finding in log.findings}
    np.testing.assert_array_equal(log.position_rad[:, 0], numbers[: log.time_s.size, 1])
