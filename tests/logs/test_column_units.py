"""Units in the names of columns: converted, or refused; never taken for another."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from collaudit.core.config.schema import LogConfig
from collaudit.core.errors import ConfigError, LogError
from collaudit.core.logs.log_reading import read_log

ROWS = 50


def read(folder: Path, header: str, **units: Any) -> Any:
    path = folder / "log.csv"
    time_s = 0.01 * np.arange(ROWS)
    rows = "".join(f"{t:.9g},{np.sin(t):.9g},{np.cos(t):.9g},1\n" for t in time_s)
    path.write_text(f"{header}\n{rows}", encoding="utf-8")
    return read_log((path,), LogConfig.of({"units": units}), robot_joints=None)


@pytest.mark.parametrize(
    ("header", "quantity", "unit"),
    [
        ("t,q1 [mrad],dq1,tau1", "position", "mrad"),
        ("t,q1 [rev],dq1,tau1", "position", "rev"),
        ("t,q1,dq1 [rpm],tau1", "velocity", "rpm"),
        ("t,q1,dq1,tau1 [mNm]", "effort", "mNm"),
        ("t,q1,dq1,tau1 [kgcm]", "effort", "kgcm"),
    ],
)
def test_a_unit_that_is_not_converted_is_refused_unless_stated(
    header: str, quantity: str, unit: str, tmp_path: Path
) -> None:
    with pytest.raises(LogError, match=f"{quantity} columns are in a unit that is not converted") as refused:
        read(tmp_path, header)
    assert unit in str(refused.value)
    assert f"[log.units] {quantity}" in str(refused.value.hint)
    read(tmp_path, header, **{quantity: {"position": "rad", "velocity": "rad/s", "effort": "Nm"}[quantity]})


@pytest.mark.parametrize("speed", ["deg/s", "°/s", "deg/sec", "deg·s^-1", "degps"])
def test_spelt_units_are_converted(speed: str, tmp_path: Path) -> None:
    log = read(tmp_path, f"t,q1 [deg],dq1 [{speed}],tau1 [N·m]")
    assert log.position_rad[10, 0] == pytest.approx(np.radians(np.sin(0.1)))
    assert log.velocity_rad_s[0, 0] == pytest.approx(np.radians(1.0))
    assert not [f for f in log.findings if f.code == "log-guessed" and "effort" in f.text and "unit" in f.text]


OF_DRIVES = [
    ("%", "percent", 0.01),
    ("percent", "percent", 0.01),
    ("‰", "permille", 0.001),
    ("mA", "mA", 0.001),
    ("A", "A", 1.0),
]


@pytest.mark.parametrize(("written", "unit", "share"), OF_DRIVES)
def test_efforts_in_units_of_drives_need_their_constants(written: str, unit: str, share: float, tmp_path: Path) -> None:
    """By the name of the column or as stated; of prismatic joints the same."""
    key = "rated_torque_nm" if unit.startswith("per") else "torque_constant_nm_per_a"
    header = f"t,q1,dq1,tau1 [{written}]"
    with pytest.raises(ConfigError) as asked:
        read(tmp_path, header)
    assert key in str(asked.value)
    for units in ({key: {"joint1": 40.0}}, {key: {"joint1": 40.0}, "effort": unit}):
        log = read(tmp_path, header, **units)
        assert (log.effort_unit, log.effort[0, 0]) == ("Nm", pytest.approx(40.0 * share))
    other = "torque_constant_nm_per_a" if unit.startswith("per") else "rated_torque_nm"
    with pytest.raises(ConfigError, match=f"{other} is given"):
        read(tmp_path, header, effort=unit, **{key: {"joint1": 40.0}, other: {"joint1": 1.0}})


@pytest.mark.parametrize(("length", "metres"), [("mm", 1e-3), ("m", 1.0)])
def test_lengths_of_sliding_joints(length: str, metres: float, tmp_path: Path) -> None:
    """Angles of the others stay what they are."""
    path = tmp_path / "log.csv"
    rows = "".join(f"{0.01 * k},{k},90,{2 * k},5,1,1\n" for k in range(ROWS))
    path.write_text(f"t,q1,dq1,q2,dq2,tau1,tau2\n{rows}")
    units = {"length": length, "position": "deg"}
    log = read_log((path,), LogConfig.of({"units": units}), robot_joints=None, prismatic=["joint2"])
    assert log.position_rad[3] == pytest.approx([np.radians(3), 6 * metres])
    assert log.velocity_rad_s[3] == pytest.approx([np.pi / 2, 5 * metres])
