"""What `inspect` says of the columns of an unknown table."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from collaudit.core.config.schema import LogConfig
from collaudit.core.logs.log_description import describe
from collaudit.core.logs.log_reading import read_log
from collaudit.core.logs.log_summary import LogSummary
from collaudit.core.logs.tables.column_roles import _stated_unit
from collaudit.reports.terminal.screen_text import log_text

ROWS = 400
TIME_S = 0.008 * np.arange(ROWS)
Q = np.column_stack([np.sin(2 * TIME_S + k) for k in range(6)])
DQ = np.column_stack([2 * np.cos(2 * TIME_S + k) for k in range(6)])
TAU = np.column_stack([5 * np.cos(7 * TIME_S + k) + k for k in range(6)])


def write(path: Path, header: str | None, values: Any, sep: str = ",") -> Path:
    rows = [sep.join(f"{x:.9g}" for x in row) for row in np.asarray(values)]
    path.write_text("\n".join([*([header] if header is not None else []), *rows]) + "\n")
    return path


def roles(summary: LogSummary) -> dict[str, str]:
    return {column.name: column.role for column in summary.columns}


def test_every_column_has_a_range_a_role_and_a_reason(tmp_path: Path) -> None:
    flag, state = (TIME_S > 1).astype(float), 7 + np.floor(TIME_S)
    columns = [1 + np.arange(ROWS), TIME_S, Q[:, 0], DQ[:, 0], TAU[:, 0], flag, state, np.full(ROWS, 3.0)]
    path = write(
        tmp_path / "log.csv", "n,stempel,winkel,rate_degps,kraft [Nm],hand,modus,konst", np.column_stack(columns)
    )
    summary = describe((path,))
    assert roles(summary) == {
        "n": "counter",
        "stempel": "time?",
        "winkel": "position?",
        "rate_degps": "velocity?",
        "kraft [Nm]": "signal",
        "hand": "label?",
        "modus": "state or run?",
        "konst": "constant",
    }
    by_name = {column.name: column for column in summary.columns}
    assert (by_name["n"].min, by_name["n"].max, by_name["n"].changes) == (1.0, ROWS, ROWS - 1)
    assert (by_name["hand"].changes, by_name["konst"].changes) == (1, 0)
    assert (by_name["kraft [Nm]"].unit, by_name["rate_degps"].unit) == ("Nm", "deg/s")
    assert by_name["rate_degps"].why == "goes as the derivative of winkel"
    assert by_name["stempel"].why == "grows with each row, by 0.008 in the median"
    text = log_text(summary, 120)
    assert max(map(len, text.splitlines()[:12])) <= 120


def test_columns_that_differ_in_a_number_are_one_line(tmp_path: Path) -> None:
    header = "t," + ",".join(f"{w}{k + 1}" for w in ("q", "tau") for k in range(6))
    summary = describe((write(tmp_path / "log.csv", header, np.column_stack([TIME_S, Q, TAU])),))
    text = log_text(summary, 120)
    assert "q1 … q6" in text
    assert "position (6)" in text
    assert len([line for line in text.splitlines() if "tau" in line and "by its name" in line]) == 1
    assert [column.joint for column in summary.columns][1:3] == ["joint1", "joint2"]


@pytest.mark.parametrize(
    ("name", "unit"),
    [("dq_deg_per_s_1", "deg/s"), ("qd_rad_s_1", "rad/s"), ("speed_deg/sec", "deg/s"), ("q_deg", "deg"), ("t_s", "s")],
)
def test_units_of_names(name: str, unit: str) -> None:
    assert _stated_unit(name) == unit


def test_text_and_damaged_columns_do_not_hinder(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_text("t,q1,word,ok\n" + "".join(f"{0.01 * k},{k},go,True\n" for k in range(99)) + "1.0,x,go,True\n")
    assert roles(describe((path,)))["word"] == "text"
    assert roles(describe((path,)))["ok"] == "label?"
    assert all(column.min is None for column in describe((path,)).columns)


def test_what_is_stated_is_said_to_be(tmp_path: Path) -> None:
    path = write(tmp_path / "log.csv", "t,q1,q2", np.column_stack([TIME_S, Q[:, :2]]))
    settings = LogConfig.of({"csv": {"time": "t", "position": "q{i}"}})
    summary = describe((path,), settings)
    assert [column.why for column in summary.columns] == ["as stated", "as stated, q{i}", "as stated, q{i}"]


def names(form: str, count: int = 6) -> list[str]:
    return [form.format(i=k + 1, i0=k) for k in range(count)]


RTDE = ["timestamp", *names("actual_q_{i0}"), *names("actual_qd_{i0}"), *names("actual_current_{i0}"), "safety_mode"]


@pytest.mark.parametrize("header", [" ".join(RTDE), "timestamp " + " ".join(RTDE[1:])])
def test_an_rtde_recording_between_blanks(header: str, tmp_path: Path) -> None:
    mode = np.ones(ROWS)
    path = write(tmp_path / "robot.rtde.csv", header, np.column_stack([TIME_S + 5e4, Q, DQ, TAU, mode]), sep=" ")
    summary = describe((path,))
    log = read_log((path,), LogConfig.of({"units": {"effort": "raw", "time": "s"}}), robot_joints=None)
    np.testing.assert_allclose(log.position_rad, Q, atol=1e-8)
    assert log.velocity_rad_s is not None
    np.testing.assert_allclose(log.velocity_rad_s, DQ, atol=1e-8)
    assert roles(summary)["safety_mode"] == "constant"


@pytest.mark.parametrize(
    ("time", "forms"),
    [
        ("%time", ("field.position{i0}", "field.velocity{i0}", "field.effort{i0}")),
        ("__time", ("/joint_states/position[{i0}]", "/joint_states/velocity[{i0}]", "/joint_states/effort[{i0}]")),
    ],
)
def test_exports_of_rostopic_and_plotjuggler_are_read_as_stated(
    time: str, forms: tuple[str, ...], tmp_path: Path
) -> None:
    header = ",".join([time, *(name for form in forms for name in names(form))])
    path = write(tmp_path / "log.csv", header, np.column_stack([TIME_S, Q, DQ, TAU]))
    csv = {"time": time, **dict(zip(("position", "velocity", "effort"), forms, strict=True))}
    log = read_log((path,), LogConfig.of({"csv": csv, "units": {"effort": "Nm"}}), robot_joints=None)
    np.testing.assert_allclose(log.effort, TAU, atol=1e-7)
    assert len(describe((path,)).columns) == 19
