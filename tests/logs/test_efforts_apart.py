"""Efforts on a topic of their own, joined by time; messages whose stamps tell nothing, spaced at a stated rate."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import log_writers as w
import numpy as np
import pytest

from collaudit.core.config.schema import LogConfig
from collaudit.core.data.joint_log import JointLog
from collaudit.core.errors import LogError
from collaudit.core.logs.log_description import describe
from collaudit.core.logs.log_reading import read_log

NAMES = ("a", "b", "c")
COUNT = 300


def at(time_s: float) -> np.ndarray:
    return np.sin(time_s + np.arange(3))


def apart(path: Path, *, every: int = 1, faster: int = 1, turned: bool = False, stamp: bool = True) -> Path:
    """Positions on one topic, efforts (five times these) on another: every nth, or n times as often."""
    said = []
    for k in range(COUNT * faster):
        ns = k * w.PERIOD // faster
        stamps = {"stamp_ns": w.EPOCH + ns if stamp else 0, "log_ns": w.EPOCH + ns + 200_000}
        if k % faster == 0:
            said.append(w.joint_state(NAMES, at(ns / 1e9), stamp_ns=w.EPOCH + ns, log_ns=w.EPOCH + ns + 150_000))
        if k % every == 0:
            order = [2, 0, 1] if turned else [0, 1, 2]
            names = [NAMES[j] for j in order]
            said.append(w.joint_state(names, [], [], 5 * at(ns / 1e9)[order], topic="/joint_torques", **stamps))
    return w.write_mcap(path, said)


def read(path: Path, **stated: Any) -> JointLog:
    return read_log((path,), LogConfig.of(stated), robot_joints=NAMES)


@pytest.mark.parametrize(
    ("form", "rows"),
    [
        ({}, COUNT),
        ({"turned": True}, COUNT),
        ({"every": 5}, COUNT // 5),
        ({"faster": 2}, COUNT),
        ({"stamp": False}, COUNT),
    ],
    ids=["as often", "other order", "slower", "faster", "no stamps"],
)
def test_efforts_are_joined_by_time_and_name(tmp_path: Path, form: dict[str, Any], rows: int) -> None:
    log = read(apart(tmp_path / "x.mcap", **form), efforts="/joint_torques")
    assert log.effort is not None and abs(log.time_s.size - rows) <= 1
    known = np.isfinite(log.effort).all(axis=1) & np.isfinite(log.position_rad).all(axis=1)
    assert known.mean() > 0.95
    np.testing.assert_allclose(log.effort[known], 5 * log.position_rad[known], atol=5e-3)


@pytest.mark.parametrize("form", [{}, {"every": 5}, {"turned": True}])
def test_the_line_that_joins_them_is_offered(tmp_path: Path, form: dict[str, Any]) -> None:
    path = apart(tmp_path / "x.mcap", **form)
    with pytest.raises(LogError, match="hold no efforts") as caught:
        read(path)
    assert '[log] efforts = "/joint_torques"' in (caught.value.hint or "")


def test_joints_of_another_name_are_not_paired(tmp_path: Path) -> None:
    said = [w.joint_state(NAMES, at(0.002 * k), stamp_ns=w.EPOCH + k * w.PERIOD) for k in range(50)]
    others = {"topic": "/torques"}
    said += [w.joint_state("xyz", [], [], [1, 2, 3], stamp_ns=w.EPOCH + k * w.PERIOD, **others) for k in range(50)]
    with pytest.raises(LogError, match="no efforts of the joints"):
        read(w.write_mcap(tmp_path / "x.mcap", said), efforts="/torques")


def test_commanded_efforts_are_joined_only_with_their_kind(tmp_path: Path) -> None:
    said = []
    for k in range(50):
        said.append(w.joint_state(NAMES, at(0.002 * k), stamp_ns=w.EPOCH + k * w.PERIOD))
        said.append(w.joint_state(NAMES, [], [], at(0.0), stamp_ns=w.EPOCH + k * w.PERIOD, topic="/effort_command"))
    path = w.write_mcap(tmp_path / "x.mcap", said)
    with pytest.raises(LogError, match="measured by their names"):
        read(path, efforts="/effort_command")
    assert read(path, efforts="/effort_command", effort_kind="motor-torque").effort is not None
    assert read(path).effort is None, "a hint never proposes what is commanded"


def test_efforts_in_messages_of_an_own_type(tmp_path: Path) -> None:
    kind = "std_msgs/msg/Float64MultiArray"
    types = w.ROS2.types
    layout = types["std_msgs/msg/MultiArrayLayout"](dim=[], data_offset=0)
    said = []
    for k in range(COUNT):
        ns = w.EPOCH + k * w.PERIOD
        said.append(w.joint_state(NAMES, at(0.002 * k), stamp_ns=ns))
        said.append(w.Said("/torques", kind, ns + 1000, types[kind](layout=layout, data=5 * at(0.002 * k))))
    path = w.write_mcap(tmp_path / "x.mcap", said)
    log = read(path, efforts="/torques", fields={"names": list(NAMES), "effort": "data"})
    assert log.effort is not None
    known = np.isfinite(log.effort).all(axis=1)
    assert known.mean() > 0.95
    np.testing.assert_allclose(log.effort[known], 5 * log.position_rad[known], atol=5e-2)


def bursts(path: Path, size: int, *, hole: tuple[int, int] = (0, 0), rate_hz: float = 500.0) -> Path:
    """Messages with zero stamps, received by ``size`` at a time; those of the hole are missing."""
    said = []
    for k in range(3000):
        received = w.EPOCH + round(1e9 * (k // size + 1) * size / rate_hz)
        if not hole[0] <= k < hole[1]:
            said.append(w.joint_state(NAMES, at(k / rate_hz), [], 5 * at(k / rate_hz), stamp_ns=0, log_ns=received))
    return w.write_mcap(path, said, chunk_size=1 << 18)


@pytest.mark.parametrize("size", [10, 50, 200])
def test_bursts_are_spaced_at_the_stated_rate(tmp_path: Path, size: int) -> None:
    path = bursts(tmp_path / "x.mcap", size)
    with pytest.raises(LogError, match="no stamp tells") as caught:
        read(path)
    assert "[log] rate_hz = " in (caught.value.hint or "")
    log = read(path, rate_hz=500.0)
    np.testing.assert_allclose(log.time_s, np.arange(3000) / 500.0, atol=1e-9)
    assert log.source.time_source == "rate"


@pytest.mark.parametrize("wrong", [50.0, 1000.0, 300.0])
def test_a_wrong_rate_is_refused_with_the_one_seen(tmp_path: Path, wrong: float) -> None:
    with pytest.raises(LogError, match="is not the rate") as caught:
        read(bursts(tmp_path / "x.mcap", 50), rate_hz=wrong)
    assert "a second" in str(caught.value.found)


@pytest.mark.parametrize("size", [10, 50])
def test_a_hole_among_bursts_is_not_spaced_away(tmp_path: Path, size: int) -> None:
    with pytest.raises(LogError, match="messages are missing"):
        read(bursts(tmp_path / "x.mcap", size, hole=(1000, 1300)), rate_hz=500.0)


def test_inspect_shows_which_topic_has_what(tmp_path: Path) -> None:
    topics = {topic.name: topic for topic in describe((apart(tmp_path / "x.mcap"),)).topics}
    assert (topics["/joint_states"].has_position, topics["/joint_states"].has_effort) == (True, False)
    assert (topics["/joint_torques"].has_position, topics["/joint_torques"].has_effort) == (False, True)
