"""The unit of a table's time column: stated, else by the column's name, else by the size, else asked for."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from collaudit.core.config.schema import LogConfig
from collaudit.core.errors import LogError
from collaudit.core.logs.log_description import describe
from collaudit.core.logs.log_guess import guess_csv_columns
from collaudit.core.logs.log_reading import read_log
from collaudit.core.logs.tables.table_time import LONGEST_STEP_S
from collaudit.core.logs.tables.time_columns import SCALES

ROWS = 200
TIME_S = 0.002 * np.arange(ROWS)
Q = np.sin(TIME_S)


def write(folder: Path, column: str, stamps: Any) -> Path:
    path = folder / "log.csv"
    rows = "".join(f"{stamp},{q:.9g},1\n" for stamp, q in zip(stamps, Q, strict=True))
    path.write_text(f"{column},q1,tau1\n{rows}", encoding="utf-8")
    return path


def read(path: Path, **units: str) -> tuple[Any, dict[str, str]]:
    log = read_log((path,), LogConfig.of({"units": {"effort": "Nm", **units}}), robot_joints=None)
    return log, {finding.code: finding.severity for finding in log.findings if "unit" in finding.text}


@pytest.mark.parametrize("name", ["time_{}", "t [{}]", "timestamp({})"])
@pytest.mark.parametrize("unit", SCALES)
def test_the_name_of_the_time_column_states_its_unit(name: str, unit: str, tmp_path: Path) -> None:
    path = write(tmp_path, name.format(unit), TIME_S * SCALES[unit])
    log, found = read(path)
    np.testing.assert_allclose(log.time_s, TIME_S, atol=1e-9)
    assert found["log-guessed"] == "info"
    guess = guess_csv_columns([path])
    assert guess is not None
    assert guess.units["time"] == unit


@pytest.mark.parametrize("step", [1, 2, 2_000, 2_000_000])
@pytest.mark.parametrize("runs", [1, 4])
def test_steps_too_long_for_seconds_are_asked_about(step: int, runs: int, tmp_path: Path) -> None:
    """One run, or several that each begin at zero."""
    path = write(tmp_path, "t", step * (np.arange(ROWS) % (ROWS // runs)))
    assert refused(path) == described(path)
    for unit in SCALES:
        if step / SCALES[unit] >= LONGEST_STEP_S:
            assert refused(path, time=unit)
            continue
        log, found = read(path, time=unit)
        assert log.time_s[1] == pytest.approx(step / SCALES[unit])
        assert "log-unit-suspect" not in found


def test_a_counter_that_wraps_is_asked_about(tmp_path: Path) -> None:
    """Microseconds since the controller started, in 32 bits."""
    path = write(tmp_path, "t", (2**32 - 100_000 + 2000 * np.arange(ROWS)) % 2**32)
    assert refused(path) == described(path)


def refused(path: Path, **units: str) -> str:
    """Why a log is not read."""
    with pytest.raises(LogError, match="log-unit-suspect") as caught:
        read(path, **units)
    return caught.value.message


def described(path: Path) -> str:
    """The same as ``inspect`` says it."""
    (said,) = [one for one in describe((path,)).findings if one.forbids_pass]
    return f"{said.code}: {said.text}"


def test_seconds_are_taken_as_before(tmp_path: Path) -> None:
    assert "log-unit-suspect" not in read(write(tmp_path, "t", TIME_S))[1]


def test_slow_seconds_of_our_time_are_no_question(tmp_path: Path) -> None:
    """20 Hz, stamped since the epoch: nothing else has such numbers."""
    log, found = read(write(tmp_path, "t", [f"{1.7e9 + 0.05 * k:.2f}" for k in range(ROWS)]))
    assert "log-unit-suspect" not in found
    assert log.time_s[1] == pytest.approx(0.05)


@pytest.mark.parametrize("name", ["t_{}", "x_time_{}", "field.header.stamp_{}", "state.time.{}", "ros_time_{}"])
@pytest.mark.parametrize("unit", SCALES)
def test_a_word_for_time_may_stand_behind_others_and_before_its_unit(name: str, unit: str, tmp_path: Path) -> None:
    log, _ = read(write(tmp_path, name.format(unit), TIME_S * SCALES[unit]))
    np.testing.assert_allclose(log.time_s, TIME_S, atol=1e-9)


@pytest.mark.parametrize("name", ["x_time", "x__time", "field.time", "robot.timestamp"])
def test_names_as_exports_change_them(name: str, tmp_path: Path) -> None:
    assert read(write(tmp_path, name, TIME_S))[0].time_s[1] == TIME_S[1]


@pytest.mark.parametrize("name", ["dt", "time_constant", "delay_ms", "q_time", "t1", "lifetime", "nanosec"])
def test_other_words_are_no_time(name: str, tmp_path: Path) -> None:
    with pytest.raises(LogError, match="no time column"):
        read(write(tmp_path, name, TIME_S))


SPLIT = [("header.stamp.sec", "header.stamp.nanosec"), ("field.header.stamp.secs", "field.header.stamp.nsecs"),
         ("/js/header/stamp/sec", "/js/header/stamp/nanosec"), ("secs", "nsecs"), ("t_sec", "t_nsec")]  # fmt: skip


@pytest.mark.parametrize(("whole", "rest"), SPLIT)
@pytest.mark.parametrize("stated", [False, True])
def test_split_stamps_are_put_together(whole: str, rest: str, stated: bool, tmp_path: Path) -> None:
    start = 1_700_000_000_999_000_000
    stamps = start + np.round(TIME_S * 1e9).astype(np.int64)
    path = write(tmp_path, f"{whole},{rest}", [f"{ns // 10**9},{ns % 10**9}" for ns in stamps.tolist()])
    settings = {"csv": {"time": whole, "position": "q{i}"}} if stated else {}
    log = read_log((path,), LogConfig.of({"units": {"effort": "Nm"}, **settings}), robot_joints=None)
    np.testing.assert_array_equal(log.time_s, np.round(TIME_S * 1e9) / 1e9)
    assert log.source.start_ns == start


def test_two_whole_stamps_are_no_split_one(tmp_path: Path) -> None:
    path = write(tmp_path, "time_s,time_ns", [f"{t:.9g},{t * 1e9:.0f}" for t in TIME_S])
    np.testing.assert_allclose(read(path)[0].time_s, TIME_S, atol=1e-12)


@pytest.mark.parametrize("rate_hz", [2500, 5000, 20000])
def test_milliseconds_of_a_fast_arm_are_asked_about(rate_hz: float, tmp_path: Path) -> None:
    path = write(tmp_path, "t", np.arange(ROWS) * 1e3 / rate_hz)
    assert refused(path)
    assert read(path, time="ms")[0].time_s[1] == pytest.approx(1 / rate_hz)


def test_seconds_and_microseconds(tmp_path: Path) -> None:
    path = write(tmp_path, "feedBack.time.sec,feedBack.time.usec", [f"17,{round(t * 1e6)}" for t in TIME_S])
    np.testing.assert_allclose(read(path)[0].time_s, TIME_S, atol=1e-9)


@pytest.mark.parametrize("unit", ["ms", "us", "ns"])
@pytest.mark.parametrize("degrees", [False, True])
def test_positions_that_move_by_their_velocities_tell_the_unit(unit: str, degrees: bool, tmp_path: Path) -> None:
    """Coarse encoders, filtered velocities: only one unit of time lets one be the derivative of the other."""
    path = moved(tmp_path, TIME_S * SCALES[unit], 57.3 if degrees else 1.0)
    with pytest.raises(LogError, match=rf'state it, \[log.units\] time = "{unit}"\.'):
        read(path)
    assert describe((path,)).topics[0].time_unit == unit, "init writes it as a guess"
    np.testing.assert_allclose(read(path, time=unit)[0].time_s, TIME_S, atol=1e-9)


def test_a_counter_is_asked_about_with_its_rate(tmp_path: Path) -> None:
    """And whole seconds, at a thousand rows each, are not taken as milliseconds."""
    with pytest.raises(LogError, match=r"rate_hz = 500, as"):
        read(moved(tmp_path, np.arange(ROWS), 1.0))
    with pytest.raises(LogError, match="the stamp of the row before"):
        read(moved(tmp_path, np.arange(ROWS) // 100, 0.5))


def moved(folder: Path, stamps: Any, scale: float) -> Path:
    """A joint in motion, whose encoder counts, beside its velocity, in rad times ``scale``."""
    count = scale * 2.0 * np.pi / 65536.0
    position = np.round(scale * Q / count) * count
    velocity = scale * np.cos(TIME_S)
    path = folder / "moved.csv"
    rows = "".join(f"{t},{q:.9g},{v:.9g},1\n" for t, q, v in zip(stamps, position, velocity, strict=True))
    path.write_text(f"t,q1,dq1,tau1\n{rows}", encoding="utf-8")
    return path
