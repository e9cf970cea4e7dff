"""Clocks compared with each other, and decoded logs kept in a cache."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields
from pathlib import Path

import log_writers as w
import numpy as np
import pytest

from collaudit.core.config.schema import LogConfig
from collaudit.core.findings import Finding
from collaudit.core.logs import log_reading as reading
from collaudit.core.logs import read_log
from collaudit.core.logs.signals import clock_checks
from collaudit.core.logs.signals.clock_checks import JUMP_PERIODS, JUMP_S

SECOND = 10**9


def clock_findings(tmp_path: Path, stamp_of: Callable[[int], int], count: int = 3000) -> list[Finding]:
    said = [
        w.joint_state(["a"], [0.0], stamp_ns=stamp_of(k), log_ns=w.EPOCH + k * w.PERIOD + 100_000 * (k % 3))
        for k in range(count)
    ]
    log = read_log((w.write_mcap(tmp_path / "x.mcap", said),), LogConfig(), robot_joints=None)
    return [f for f in log.findings if f.code.startswith("clock-") or "stamps count from" in f.text]


def test_equal_clocks_say_nothing(tmp_path: Path) -> None:
    assert clock_findings(tmp_path, lambda k: w.EPOCH + k * w.PERIOD - 3 * SECOND) == []


def test_drift(tmp_path: Path) -> None:
    (finding,) = clock_findings(tmp_path, lambda k: w.EPOCH + round(k * w.PERIOD * 1.005))
    assert finding.code == "clock-drift"
    assert "+5e+03 ppm" in finding.text


@pytest.mark.parametrize(
    ("jump_ns", "words"), [(2 * SECOND, "+2 s"), (-4_294_967_296, "32-bit nanoseconds"), (-7 * SECOND, "-7 s")]
)
def test_jumps_and_wrap_around(tmp_path: Path, jump_ns: int, words: str) -> None:
    (finding,) = clock_findings(tmp_path, lambda k: w.EPOCH + k * w.PERIOD + (jump_ns if k >= 1000 else 0))
    assert finding.code == "clock-jump"
    assert words in finding.text
    assert finding.start_s == pytest.approx(2.0, abs=0.01)


def test_one_late_message_is_no_jump(tmp_path: Path) -> None:
    assert clock_findings(tmp_path, lambda k: w.EPOCH + k * w.PERIOD + (2 * SECOND if k == 1000 else 0)) == []


def plain_jumps(stamp_ns: np.ndarray, log_ns: np.ndarray) -> list[int]:
    """The rule over whole arrays."""
    log_s, header_s = (log_ns - log_ns[0]) / 1e9, (stamp_ns - stamp_ns[0]) / 1e9
    limit = max(JUMP_S, JUMP_PERIODS * float(np.median(np.diff(log_s))))
    ahead = header_s - log_s
    steps = np.flatnonzero(np.abs(np.diff(ahead)) > limit) + 1
    if steps.size > ahead.size // 10:
        return []
    level = lambda start, stop: np.median(ahead[max(start, 0) : stop])  # noqa: E731
    return [k for k in steps.tolist() if abs(level(k, k + 10) - level(k - 10, k)) > limit]


@pytest.mark.parametrize("period_ms", [2.0, 25.0, 26.0, 100.0])
@pytest.mark.parametrize("count", [11, 40_000])
def test_jumps_are_those_of_whole_arrays(period_ms: float, count: int) -> None:
    rng = np.random.default_rng(count)
    log_ns = w.EPOCH + np.cumsum(rng.normal(period_ms, 0.3, count) * 1e6).astype(np.int64)
    stamp_ns = log_ns - 10**6
    found = []
    for sizes in ([], [0.6], [3.0, -2.5, 0.6], list(rng.normal(0, 2, count // 9))):
        moved = stamp_ns.copy()
        for size in sizes:
            moved[int(rng.integers(1, count)) :] += round(size * 1e9)
        expected = plain_jumps(moved, log_ns)
        found.append(len(expected))
        assert clock_checks._jumps(clock_checks._Clocks(moved, log_ns)).tolist() == expected
    assert count < 100 or max(found) >= 2


def test_simulated_time(tmp_path: Path) -> None:
    (finding,) = clock_findings(tmp_path, lambda k: 5 * SECOND + k * w.PERIOD // 2)
    assert finding.is_fact
    assert "0.5 times" in finding.text


@pytest.mark.parametrize("kind", ["mcap-zstd", "bag-none", "csv"])
def test_the_cache_gives_back_what_was_read(kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    if kind == "csv":
        path = tmp_path / "log.csv"
        path.write_text("t,q1,tau1\n" + "".join(f"{k / 100},{k},{-k}\n" for k in range(50)))
    else:
        path = w.write_any(tmp_path, kind, lambda encoding: w.motion(80, encoding=encoding))
    settings = LogConfig.of({"wrench": "/ft/wrench"})
    cache = tmp_path / "cache"
    first = read_log((path,), settings, robot_joints=None, cache=cache)

    def never(*_: object) -> None:
        raise AssertionError("it was read again")

    with monkeypatch.context() as patch:
        patch.setattr(reading, "_read", never)
        again = read_log((path,), settings, robot_joints=None, cache=cache)
        with pytest.raises(AssertionError, match="read again"):
            read_log((path,), LogConfig.of({"time": "log"}), robot_joints=None, cache=cache)
    for field in fields(first):
        one, two = getattr(first, field.name), getattr(again, field.name)
        if isinstance(one, np.ndarray):
            np.testing.assert_array_equal(one, two)
        elif field.name == "wrench" and one is not None:
            np.testing.assert_array_equal(one.wrench, two.wrench)
            np.testing.assert_array_equal(one.time_s, two.time_s)
        else:
            assert one == two
    for stored in cache.iterdir():
        stored.write_bytes(b"damaged")
    assert read_log((path,), settings, robot_joints=None, cache=cache).source == first.source
    path.write_bytes(path.read_bytes() + b"\n")
    assert read_log((path,), settings, robot_joints=None, cache=cache).source.sha256 != first.source.sha256
