"""The unit of a table's time column: stated, else by the column's name, else by the size, else asked for."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from collaudit.core.config.schema import LogConfig
from collaudit.core.logs import guess_csv_columns, read_log
from collaudit.core.logs.tables.table_stamps import SCALES

ROWS = 200
TIME_S = 0.002 * np.arange(ROWS)
Q = np.sin(TIME_S)


def write(folder: Path, column: str, stamps: Any) -> Path:
    path = folder / "log.csv"
    rows = "".join(f"{stamp},{q:.9g},1\n" for stamp, q in zip(stamps, Q, strict=True))
    path.write_text(f"{column},q1,tau1\n{rows}", encoding="utf-8")
    return path


def read(path: Path, **units: str) -> tuple[Any, dict[str, str]]:
    log = read_log((path,), LogConfig.model_validate({"units": {"effort": "Nm", **units}}), robot_joints=None)
    return log, {finding.code: finding.severity for finding in log.findings}


@pytest.mark.parametrize("name", ["time_{}", "t [{}]", "timestamp({})"])
@pytest.mark.parametrize("unit", SCALES)
def test_the_name_of_the_time_column_states_its_unit(name: str, unit: str, tmp_path: Path) -> None:
    path = write(tmp_path, name.format(unit), TIME_S * SCALES[unit])
    log, found = read(path)
    np.testing.assert_allclose(log.time_s, TIME_S, atol=1e-9)
    assert found["log-units-guessed"] == "info"
    guess = guess_csv_columns([path])
    assert guess is not None
    assert guess.units["time"] == unit


@pytest.mark.parametrize("step", [1, 2, 2_000, 2_000_000])
def test_steps_too_long_for_seconds_are_asked_about(step: int, tmp_path: Path) -> None:
    path = write(tmp_path, "t", step * np.arange(ROWS))
    assert read(path)[1]["log-time-unit-suspect"] == "error"
    for unit in SCALES:
        log, found = read(path, time=unit)
        assert log.time_s[1] == pytest.approx(step / SCALES[unit])
        assert "log-time-unit-suspect" not in found


def test_seconds_are_taken_as_before(tmp_path: Path) -> None:
    assert "log-time-unit-suspect" not in read(write(tmp_path, "t", TIME_S))[1]
