"""Memory garbage in logs of every format: it sets no time, no rate and no value, and is named."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from log_writers import EPOCH, KINDS, Said, motion, write_any

from collaudit.core.conditioning.conditioning import condition
from collaudit.core.config.schema import ConditioningConfig, LogConfig
from collaudit.core.logs.log_description import describe
from collaudit.core.logs.log_reading import read_log
from collaudit.core.logs.signals.joint_values import _beyond
from collaudit.core.logs.signals.sample_clock import garbage_ns, garbage_stamps

COUNT = 300
AT = (0, 120, 121, 122, 123, 124, 299)
UNITS: dict[str, Any] = {"effort": "Nm", "time": "auto"}


def read(path: Path, **settings: Any) -> Any:
    return read_log((path,), LogConfig.of(settings), robot_joints=None)


def spoilt(spoil: Callable[[Said], Said]) -> Callable[[str], Sequence[Said]]:
    def messages(encoding: str) -> list[Said]:
        said = motion(COUNT, encoding=encoding, with_wrench=False)
        return [spoil(one) if k in AT else one for k, one in enumerate(said)]

    return messages


def header_of(sec: int) -> Callable[[Said], Said]:
    def spoil(one: Said) -> Said:
        one.value.header.stamp.sec = sec
        return one

    return spoil


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("sec", [0, 2**31 - 1])
def test_garbage_stamps_of_messages_are_left_out_and_named(kind: str, sec: int, tmp_path: Path) -> None:
    log = read(write_any(tmp_path, kind, spoilt(header_of(sec))))
    (found,) = [f for f in log.findings if f.code == "log-nan"]
    assert "7 of 300 stamps" in found.text
    assert "message 1." in found.text
    assert log.time_s.size == COUNT - len(AT)
    assert (log.time_s[0], log.time_s[-1]) == pytest.approx((0.0, 0.594))
    assert log.source.start_ns == EPOCH + 2_000_000
    assert not {"log-clock"} & {f.code for f in log.findings}
    series = condition(log, ConditioningConfig())
    assert series.period_s == pytest.approx(0.002)


def test_garbage_times_of_recording_set_no_duration(tmp_path: Path) -> None:
    path = write_any(tmp_path, "mcap-zstd", spoilt(lambda one: replace(one, log_ns=2**63 - 5)))
    log = read(path, time="log")
    assert log.time_s[-1] == pytest.approx(0.594, abs=1e-3)
    described = describe((path,))
    assert described.duration_s == pytest.approx(0.594, abs=1e-3)
    assert described.topics[0].count == COUNT
    assert described.topics[0].rate_hz == pytest.approx(500, rel=0.01)
    assert "log-nan" in {f.code for f in described.findings}


def table(tmp_path: Path, stamps: Sequence[str], cells: dict[int, str] | None = None) -> Path:
    rows = []
    for k, stamp in enumerate(stamps):
        t = 0.002 * k
        effort = (cells or {}).get(k, f"{3 * np.sin(t):.6f}")
        rows.append(f"{stamp},{np.sin(t):.9f},{np.cos(t):.9f},{effort}")
    path = tmp_path / "log.csv"
    path.write_text("\n".join(["t,q1,dq1,tau1", *rows]) + "\n")
    return path


@pytest.mark.parametrize("garbage", ["1e154", "-1e300", "4294967296.5", "1e19", "1" + "0" * 150, "1e308"])
@pytest.mark.parametrize("start", [0.0, 1.7e9])
def test_garbage_stamps_of_a_table_are_left_out_and_named(garbage: str, start: float, tmp_path: Path) -> None:
    stamps = [garbage if k in AT else f"{start + 0.002 * k:.3f}" for k in range(COUNT)]
    path = table(tmp_path, stamps)
    log = read(path, units=UNITS)
    (found,) = [f for f in log.findings if f.code == "log-nan"]
    assert "7 of 300 stamps" in found.text
    assert "row 1." in found.text
    assert (log.time_s[0], log.time_s[-1]) == pytest.approx((0.0, 0.594), abs=1e-6)
    assert log.source.start_ns == (None if start == 0.0 else pytest.approx(1.7e18 + 2e6, abs=1e6))
    described = describe((path,), LogConfig.of({"units": UNITS}))
    assert described.duration_s == pytest.approx(0.594, abs=1e-6)
    assert described.topics[0].rate_hz == pytest.approx(500, rel=0.01)
    assert "log-nan" in {f.code for f in described.findings}


def test_garbage_among_whole_numbers_overflows_nothing(tmp_path: Path) -> None:
    stamps = [str(2**63 - 1) if k in AT else str(EPOCH + 2_000_000 * k) for k in range(COUNT)]
    log = read(table(tmp_path, stamps), units=UNITS)
    assert np.diff(log.time_s).max() == pytest.approx(0.012)
    assert log.source.start_ns == EPOCH + 2_000_000


@pytest.mark.parametrize("cell", ["1e308", "-1e30", "3e154"])
def test_efforts_that_no_arm_has_are_missing_and_named(cell: str, tmp_path: Path) -> None:
    log = read(table(tmp_path, [f"{0.002 * k:.3f}" for k in range(COUNT)], {50: cell, 80: cell}), units=UNITS)
    (found,) = [f for f in log.findings if f.code == "log-nan"]
    assert found.joint == "joint1"
    assert found.text.startswith("2 values of the effort of joint 'joint1'")
    assert found.text.endswith("in row 51.")
    assert np.flatnonzero(np.isnan(log.effort[:, 0])).tolist() == [50, 80]
    series = condition(log, ConditioningConfig())
    assert np.nanmax(np.abs(series.effort)) < 4


@pytest.mark.parametrize("kind", ["mcap-zstd", "bag-none", "db3"])
def test_values_that_no_arm_has_do_not_spread(kind: str, tmp_path: Path) -> None:
    def spoil(one: Said) -> Said:
        for values in (one.value.position, one.value.velocity, one.value.effort):
            values[2] = 1e200
        return one

    log = read(write_any(tmp_path, kind, spoilt(spoil)))
    assert {f.joint for f in log.findings if f.code == "log-nan"} == {"joint3"}
    series = condition(log, ConditioningConfig())
    assert np.nanmax(np.abs(series.acceleration_rad_s2)) < 30
    assert np.nanmax(np.abs(series.velocity_rad_s)) < 2


@settings(max_examples=80, deadline=None)
@given(
    count=st.integers(50, 500),
    period=st.floats(1e-4, 1.0),
    start=st.sampled_from([0.0, 100.0, 1.7e9]),
    pause=st.floats(0.0, 9e5),
    odd=st.lists(st.sampled_from([1e154, -1e10, 1e19, 5e9]), max_size=5),
)
def test_only_garbage_is_garbage(count: int, period: float, start: float, pause: float, odd: list[float]) -> None:
    """A long pause is no garbage, wherever it stands."""
    time_s = start + period * np.arange(count)
    time_s[count // 3 :] += pause
    spoilt_s = np.insert(time_s, count // 2, odd)
    assert np.count_nonzero(garbage_stamps(spoilt_s)) == len(odd)
    assert not garbage_stamps(time_s).any()


@given(
    st.lists(st.integers(-(2**62), 2**62) | st.integers(1_690_000_000 * 10**9, 1_710_000_000 * 10**9), max_size=8),
    st.sampled_from([0, 10**12, 10**15, 2 * 10**15, 10**17]),
)
def test_whole_nanoseconds_are_judged_as_seconds_are(odd: list[int], spread: int) -> None:
    usual = np.linspace(0, spread, 80).astype(np.int64) + 1_700_000_000 * 10**9
    stamps = np.concatenate([usual, np.array(odd, dtype=np.int64)])
    found, expected = garbage_ns(stamps), garbage_stamps(stamps / 1e9)
    assert (np.zeros_like(expected) if found is None else found).tolist() == expected.tolist()


@pytest.mark.parametrize("order", ["C", "F"])
@pytest.mark.parametrize("at", [0, 300_000, 599_999])
def test_one_impossible_value_is_found_wherever_it_stands(at: int, order: Literal["C", "F"]) -> None:
    values = np.full((600_000, 3), np.nan, order=order)
    values[::2] = 1e9
    assert _beyond(values) is None
    values[at, 2] = -1.1e9
    found = _beyond(values)
    assert found is not None and np.argwhere(found).tolist() == [[at, 2]]
