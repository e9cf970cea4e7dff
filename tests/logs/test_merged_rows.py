"""Topics merged by time into one table: each column is a series on its own rows."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from collaudit.core.config.schema import LogConfig
from collaudit.core.data.joint_log import JointLog
from collaudit.core.logs.log_description import describe
from collaudit.core.logs.log_reading import read_log

ROWS = 500
TIME_S = 0.002 * np.arange(ROWS)
JOINTS = ("q1", "q2", "dq1", "dq2", "tau1", "tau2")


def joints(*wanted: str) -> pd.DataFrame:
    values = {name: np.sin(TIME_S * (k + 1)) for k, name in enumerate(JOINTS)}
    return pd.DataFrame({"t": TIME_S, **{name: values[name] for name in JOINTS if name.startswith(wanted)}})


def other(period_s: float, **columns: Any) -> pd.DataFrame:
    """Rows of another topic, a little behind those of the joints."""
    time_s = np.arange(0.0003, TIME_S[-1], period_s)
    return pd.DataFrame({"t": time_s, **{name: [value] * time_s.size for name, value in columns.items()}})


def merged(path: Path, *tables: pd.DataFrame, **settings: Any) -> JointLog:
    """The log of an outer merge, as PlotJuggler and pandas write one."""
    whole = pd.concat(tables).sort_values("t", kind="stable")
    whole.to_csv(path, index=False, float_format="%.6f")
    units = {"effort": "Nm", "time": "s"}
    return read_log((path,), LogConfig.of({"units": units, **settings}), robot_joints=None)


@pytest.fixture(scope="module")
def alone(tmp_path_factory: pytest.TempPathFactory) -> JointLog:
    return merged(tmp_path_factory.mktemp("alone") / "log.csv", joints("q", "dq", "tau"))


OTHERS = {
    "an IMU": other(0.01, imu=9.81),
    "a camera": other(0.0333, frame="left"),
    "a fast sensor": other(0.0005, strain=0.1),
    "empty rows": other(0.004),
}


@pytest.mark.parametrize("kind", OTHERS)
def test_rows_without_any_joint_value_are_no_samples(kind: str, alone: JointLog, tmp_path: Path) -> None:
    log = merged(tmp_path / "log.csv", joints("q", "dq", "tau"), OTHERS[kind])
    for name in ("time_s", "position_rad", "velocity_rad_s", "effort"):
        np.testing.assert_array_equal(getattr(log, name), getattr(alone, name))
    topic = describe((tmp_path / "log.csv",)).topics[0]
    assert (topic.count, round(topic.rate_hz or 0.0)) == (ROWS, 500)


@pytest.mark.parametrize("apart", ["tau", "dq"])
def test_a_quantity_on_rows_of_its_own_is_brought_to_the_positions(apart: str, alone: JointLog, tmp_path: Path) -> None:
    own = joints(apart).assign(t=TIME_S + 0.0007)
    rest = joints(*({"q", "dq", "tau"} - {apart}))
    log = merged(tmp_path / "log.csv", rest, own, OTHERS["an IMU"])
    np.testing.assert_array_equal(log.time_s, alone.time_s)
    name = {"tau": "effort", "dq": "velocity_rad_s"}[apart]
    # it is later by 0.7 ms, of a sine of at most 6 rad/s
    np.testing.assert_allclose(getattr(log, name)[1:], getattr(alone, name)[1:], atol=6 * 0.0007 + 1e-4)
    assert np.isnan(getattr(log, name)[0]).all(), "nothing was recorded before it"


def test_a_gap_of_a_quantity_on_its_own_rows_stays(tmp_path: Path) -> None:
    own = joints("tau").assign(t=TIME_S + 0.0007)
    log = merged(tmp_path / "log.csv", joints("q", "dq"), own.drop(index=range(100, 200)))
    assert log.effort is not None
    assert np.isnan(log.effort[101:200]).all() and np.isfinite(log.effort[210:]).all()


def test_missing_cells_are_no_rows_of_their_own(tmp_path: Path) -> None:
    """Positions lost in most rows: what is there is not spread over what is not."""
    table = joints("q", "dq", "tau")
    table.loc[table.index % 8 != 0, ["q1", "q2"]] = np.nan
    log = merged(tmp_path / "log.csv", table)
    assert log.time_s.size == ROWS
    assert np.isnan(log.position_rad).any(axis=1).sum() == np.count_nonzero(np.arange(ROWS) % 8)


def test_time_at_the_end_without_joints_stays(tmp_path: Path) -> None:
    """A driver that ended while its recorder went on."""
    table = joints("q", "dq", "tau").assign(temperature_of_the_cell=20.0)
    table.loc[300:, list(JOINTS)] = np.nan
    log = merged(tmp_path / "log.csv", table)
    assert log.time_s.size == ROWS and np.isnan(log.position_rad[300:]).all()


def test_a_label_holds_in_rows_of_other_sensors(tmp_path: Path) -> None:
    table = joints("q", "dq", "tau").assign(contact=0)
    table.loc[100:200, "contact"] = 1
    log = merged(tmp_path / "log.csv", table, OTHERS["an IMU"], labels=["contact"])
    (label,) = log.annotations
    assert list(label.intervals_s) == [pytest.approx((0.2, 0.4), abs=0.003)]


def test_a_wrench_on_rows_of_its_own_keeps_its_stamps(tmp_path: Path) -> None:
    axes = ("fx", "fy", "fz", "mx", "my", "mz")
    log = merged(
        tmp_path / "log.csv", joints("q", "dq", "tau"), other(0.01, **dict.fromkeys(axes, 1.0)), csv={"wrench": axes}
    )
    assert log.wrench is not None
    np.testing.assert_allclose(log.wrench.time_s, other(0.01)["t"], atol=1e-6)
    assert (log.wrench.wrench == 1.0).all() and log.time_s.size == ROWS
