"""Messages that no publisher should write: none ends in a traceback, none becomes a wrong number in silence."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import log_writers as w
import numpy as np
import pytest
from mcap.writer import Writer

from collaudit.core.config.schema import LogConfig
from collaudit.core.data.joint_log import JointLog
from collaudit.core.errors import LogError
from collaudit.core.logs.log_description import describe
from collaudit.core.logs.log_reading import read_log

COUNT = 60
NAMES = ("joint1", "joint2")


def steady(k: int) -> int:
    return w.EPOCH + k * w.PERIOD


def state(k: int, names: Sequence[str] = NAMES, frame: str = "base") -> w.Said:
    wave = np.sin(0.01 * k + np.arange(len(names)))
    return w.joint_state(names, wave, np.zeros(len(names)), 2 * wave, stamp_ns=steady(k), frame=frame)


def write(path: Path, payloads: Sequence[bytes], **schema: Any) -> Path:
    """An MCAP of joint states of these bytes; ``schema`` overrides name, encoding, data or message encoding."""
    text = w.definition(w.JOINT_STATE, "cdr").encode()
    given = {"name": w.JOINT_STATE, "encoding": "ros2msg", "data": text, "messages": "cdr"} | schema
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        number = writer.register_schema(given["name"], given["encoding"], given["data"])
        channel = writer.register_channel("/joint_states", given["messages"], number)
        for k, payload in enumerate(payloads):
            writer.add_message(channel, steady(k), payload, steady(k))
        writer.finish()
    return path


def read(path: Path) -> JointLog:
    return read_log((path,), LogConfig(), robot_joints=None)


def good(count: int = COUNT) -> list[bytes]:
    return [w.encode(state(k), "cdr") for k in range(count)]


def skipped(log: JointLog) -> str:
    (said,) = [one.text for one in log.findings if one.code == "log-left-out"]
    return said


@pytest.mark.parametrize(
    "name",
    ["", "joint1\x00", "x" * 10_000, "NaN", "関節", "a\nb\x1b[31m"],
    ids=["empty", "nul", "long", "nan", "kanji", "control"],
)
def test_odd_joint_names_are_names(name: str, tmp_path: Path) -> None:
    path = write(tmp_path / "x.mcap", [w.encode(state(k, ("joint1", name)), "cdr") for k in range(COUNT)])
    log = read(path)
    assert log.joint_names == ("joint1", name)
    np.testing.assert_array_equal(log.position_rad[:, 1], np.sin(0.01 * np.arange(COUNT) + 1))
    assert describe((path,)).topics[0].joints == ("joint1", name)


def test_names_that_are_not_utf8_are_left_out_and_said(tmp_path: Path) -> None:
    payloads = good()
    payloads[7] = payloads[7].replace(b"joint2", b"joint\xff")
    log = read(write(tmp_path / "x.mcap", payloads))
    assert "not UTF-8" in skipped(log) and log.time_s.shape == (COUNT - 1,)
    everywhere = [payload.replace(b"joint2", b"joint\xff") for payload in payloads]
    with pytest.raises(LogError, match="UTF-8"):
        read(write(tmp_path / "y.mcap", everywhere))


def test_both_byte_orders_on_one_channel(tmp_path: Path) -> None:
    payloads = [w.encode(state(k), "cdr", little=k % 3 != 1) for k in range(COUNT)]
    log = read(write(tmp_path / "x.mcap", payloads))
    np.testing.assert_array_equal(log.position_rad, np.sin(0.01 * np.arange(COUNT)[:, None] + np.arange(2)))
    np.testing.assert_allclose(log.time_s, np.arange(COUNT) * w.PERIOD / 1e9, atol=1e-12)
    assert "log-left-out" not in {one.code for one in log.findings}


def test_sequences_that_change_their_length(tmp_path: Path) -> None:
    """More joints, fewer, none, and arrays that do not fit their names."""
    names = {0: NAMES, 1: ("joint1", "joint2", "joint3"), 2: ("joint2",)}
    said = [state(k, names[k // 20]) for k in range(COUNT)]
    for k in (5, 25):
        said[k].value.position = said[k].value.position[:1]
    said[45].value.name = []
    log = read(write(tmp_path / "x.mcap", [w.encode(one, "cdr") for one in said]))
    column = {name: log.position_rad[:, k] for k, name in enumerate(log.joint_names)}
    assert column.keys() == {"joint1", "joint2", "joint3"}
    assert "3 of 60 messages were left out" in skipped(log)
    at = np.round(log.time_s / (w.PERIOD / 1e9)).astype(int)
    assert sorted(set(range(COUNT)) - set(at.tolist())) == [5, 25, 45]
    np.testing.assert_array_equal(column["joint2"][at < 40], np.sin(0.01 * at[at < 40] + 1))
    np.testing.assert_array_equal(column["joint2"][at >= 40], np.sin(0.01 * at[at >= 40]))
    assert np.isnan(column["joint1"][at >= 40]).all() and np.isnan(column["joint3"][at < 20]).all()


@pytest.mark.parametrize(
    "schema",
    [
        {"encoding": "ros1msg"},
        {"encoding": "ros2idl"},
        {"encoding": "protobuf"},
        {"encoding": ""},
        {"data": b""},
        {"data": b"\xff\xfe\x00"},
        {"data": b"float64[] position\n"},
        {"data": b"float64[99999999999] position\n"},
        {"data": b"sensor_msgs/JointState again\n"},
        {"name": "geometry_msgs/msg/WrenchStamped"},
        {"messages": "ros1"},
        {"messages": "json"},
        {"messages": "protobuf"},
        {"messages": "cbor"},
    ],
    ids=str,
)
def test_wrong_definitions_and_encodings(schema: dict[str, Any], tmp_path: Path) -> None:
    """The log reads right all the same, or is refused in one clear error."""
    path = write(tmp_path / "x.mcap", good(), **schema)
    described = describe((path,))
    assert described.topics[0].count == COUNT
    try:
        log = read(path)
    except LogError as error:
        assert "x.mcap" in error.render()
        return
    np.testing.assert_array_equal(log.position_rad, np.sin(0.01 * np.arange(COUNT)[:, None] + np.arange(2)))


@pytest.mark.parametrize("value", [np.nan, np.inf, 1e308])
def test_numbers_that_are_none_stay_what_they_are(value: float, tmp_path: Path) -> None:
    said = [state(k) for k in range(COUNT)]
    said[9].value.position[1] = value
    log = read(write(tmp_path / "x.mcap", [w.encode(one, "cdr") for one in said]))
    kept = value if not np.isfinite(value) else np.nan  # 1e308 rad is a number, and no position
    np.testing.assert_array_equal(log.position_rad[9, 1], kept)
    assert any("message 10" in f.text for f in log.findings if f.code == "log-nan") == np.isfinite(value)
    assert np.isfinite(np.delete(log.position_rad, 9, axis=0)).all()
