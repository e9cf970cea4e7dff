"""Clocks compared with each other."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import log_writers as w
import pytest

from collaudit.core.config.schema import LogConfig
from collaudit.core.findings import Finding
from collaudit.core.logs.log_reading import read_log

SECOND = 10**9


def clock_findings(tmp_path: Path, stamp_of: Callable[[int], int], count: int = 3000) -> list[Finding]:
    said = [
        w.joint_state(["a"], [0.0], stamp_ns=stamp_of(k), log_ns=w.EPOCH + k * w.PERIOD + 100_000 * (k % 3))
        for k in range(count)
    ]
    log = read_log((w.write_mcap(tmp_path / "x.mcap", said),), LogConfig(), robot_joints=None)
    return [f for f in log.findings if f.code.startswith("log-clock")]


def test_equal_clocks_say_nothing(tmp_path: Path) -> None:
    assert clock_findings(tmp_path, lambda k: w.EPOCH + k * w.PERIOD - 3 * SECOND) == []


@pytest.mark.parametrize(("factor", "severity"), [(1.005, "info"), (0.5, "warning")])
def test_drift(factor: float, severity: str, tmp_path: Path) -> None:
    (finding,) = clock_findings(tmp_path, lambda k: w.EPOCH + round(k * w.PERIOD * factor))
    assert (finding.code, finding.severity) == ("log-clock", severity)
    assert f"{(factor - 1) * 1e6:+.3g} ppm" in finding.text


@pytest.mark.parametrize("jump_s", [2, -7])
def test_a_jump_is_told_by_what_the_clock_gained(jump_s: int, tmp_path: Path) -> None:
    (finding,) = clock_findings(tmp_path, lambda k: w.EPOCH + k * w.PERIOD + (jump_s * SECOND if k >= 1000 else 0))
    assert finding.code == "log-clock"
    assert f"gained {jump_s:+} s" in finding.text


def test_one_late_message_is_no_jump(tmp_path: Path) -> None:
    assert clock_findings(tmp_path, lambda k: w.EPOCH + k * w.PERIOD + (2 * SECOND if k == 1000 else 0)) == []


@pytest.mark.parametrize(
    "stamp_of",
    [
        lambda k: 0 if k // 100 % 4 == 0 else w.EPOCH + k * w.PERIOD,  # not stamped, again and again
        lambda k: (0 if k // 100 % 4 == 0 else w.EPOCH) + k * w.PERIOD,  # of another clock
        lambda k: (0 if k < 1000 else w.EPOCH) + k * w.PERIOD,  # a clock that is set once the arm runs
    ],
)
def test_stamps_that_lie_years_apart_leave_the_times_of_recording(
    stamp_of: Callable[[int], int], tmp_path: Path
) -> None:
    said = [
        w.joint_state(["a"], [0.001 * k], stamp_ns=stamp_of(k), log_ns=w.EPOCH + k * w.PERIOD + 100_000 * (k % 3))
        for k in range(3000)
    ]
    log = read_log((w.write_mcap(tmp_path / "x.mcap", said),), LogConfig(), robot_joints=None)
    assert log.time_s.size == 3000 and log.time_s[-1] == pytest.approx(2999 * w.PERIOD / SECOND, abs=0.001)
    assert any("timed by log time" in f.text and "never set" in f.text for f in log.findings)
