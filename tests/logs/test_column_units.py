"""Units in the names of columns: converted, or refused; never taken for another."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from collaudit.core.config.schema import LogConfig
from collaudit.core.errors import LogError
from collaudit.core.logs.log_reading import read_log

ROWS = 50


def read(folder: Path, header: str, **units: str) -> Any:
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
        ("t,q1,dq1,tau1 [%]", "effort", "%"),
        ("t,q1,dq1,current1 [mA]", "effort", "mA"),
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
    assert "log-units-guessed" not in {f.code for f in log.findings if "effort" in f.text}
