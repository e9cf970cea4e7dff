"""Signals by field paths of the configuration, of any JSON or protobuf channel; what a JSON message may not hold."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import log_writers as w
import numpy as np
import pytest
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from mcap.writer import Writer

from collaudit.core.config.schema import LogConfig
from collaudit.core.data.joint_log import JointLog
from collaudit.core.errors import ConfigError, LogError
from collaudit.core.logs.log_description import describe
from collaudit.core.logs.log_reading import read_log

COUNT = 30
FIELDS = {
    "names": "arm[*].id", "position": "arm[*].q", "effort": "arm[*].tau", "stamp": "at.s,at.ns",
    "wrench": "load.f,load.m",
}  # fmt: skip


def steady(k: int) -> int:
    return w.EPOCH + k * w.PERIOD


def body(k: int) -> dict[str, Any]:
    arm = [{"id": "a", "q": k / 10, "tau": 2.0 * k}, {"id": "b", "q": 1.0, "tau": -1.0}]
    return {"at": {"s": 7, "ns": k * w.PERIOD}, "arm": arm, "load": {"f": [k, 1.0, 2.0], "m": [3.0, 4.0, 5.0]}}


def protobuf() -> tuple[Any, bytes]:
    """A message class of the shape of ``body``, and its definition."""
    file = descriptor_pb2.FileDescriptorProto(name="robot.proto", package="my", syntax="proto3")
    field = descriptor_pb2.FieldDescriptorProto
    one, many = field.LABEL_OPTIONAL, field.LABEL_REPEATED
    parts: dict[str, Sequence[tuple[str, int, int, str]]] = {
        "Stamp": [("s", field.TYPE_INT64, one, ""), ("ns", field.TYPE_INT64, one, "")],
        "Joint": [("id", field.TYPE_STRING, one, ""), ("q", field.TYPE_DOUBLE, one, ""),
                  ("tau", field.TYPE_FLOAT, one, "")],
        "Load": [("f", field.TYPE_DOUBLE, many, ""), ("m", field.TYPE_FLOAT, many, "")],
        "Robot": [
            ("at", field.TYPE_MESSAGE, one, ".my.Stamp"),
            ("arm", field.TYPE_MESSAGE, many, ".my.Joint"),
            ("load", field.TYPE_MESSAGE, one, ".my.Load"),
        ],
    }  # fmt: skip
    for name, fields in parts.items():
        message = file.message_type.add(name=name)
        for number, (key, kind, label, inner) in enumerate(fields, 1):
            message.field.add(name=key, number=number, type=kind, label=label, type_name=inner or None)
    files = descriptor_pb2.FileDescriptorSet(file=[file])
    pool = descriptor_pool.DescriptorPool()
    pool.Add(file)
    return message_factory.GetMessageClass(pool.FindMessageTypeByName("my.Robot")), files.SerializeToString()


def write(path: Path, encoding: str, data: Callable[[int], bytes], definition: bytes, topics: Sequence[str]) -> Path:
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        schema = writer.register_schema("my.Robot", "protobuf" if encoding == "protobuf" else "jsonschema", definition)
        channels = [writer.register_channel(topic, encoding, schema) for topic in topics]
        for k in range(COUNT):
            for channel in channels:
                writer.add_message(channel, steady(k), data(k), steady(k))
        writer.finish()
    return path


def settings(**fields: str | None) -> LogConfig:
    wrench = None if fields.get("wrench", "") is None else "/load"
    return LogConfig.of({"joint_states": "/robot", "wrench": wrench, "fields": {**FIELDS, **fields}, "time": "header"})


@pytest.mark.parametrize("encoding", ["json", "protobuf"])
def test_joints_and_wrench_by_field_path(encoding: str, tmp_path: Path) -> None:
    kind, definition = protobuf()
    as_text: Callable[[int], bytes] = lambda k: json.dumps(body(k)).encode()  # noqa: E731
    as_message: Callable[[int], bytes] = lambda k: kind(**body(k)).SerializeToString()  # noqa: E731
    data = as_text if encoding == "json" else as_message
    path = write(tmp_path / "x.mcap", encoding, data, b"{}" if encoding == "json" else definition, ["/robot", "/load"])
    log: JointLog = read_log((path,), settings(), robot_joints=None)
    steps = np.arange(COUNT)
    assert log.joint_names == ("a", "b") and log.source.time_source == "header"
    np.testing.assert_array_equal(log.position_rad, np.column_stack([steps / 10, np.ones(COUNT)]))
    assert log.effort is not None and log.wrench is not None
    np.testing.assert_array_equal(log.effort[:, 0], 2.0 * steps)
    np.testing.assert_array_equal(log.wrench.wrench[:, 0], steps)
    np.testing.assert_array_equal(log.wrench.wrench[3, 1:], [1, 2, 3, 4, 5])
    np.testing.assert_allclose(log.wrench.time_s, log.time_s)
    notes = [topic.note for topic in describe((path,), settings()).topics]
    assert all("[log.fields]" in note for note in notes)


def test_paths_need_a_topic_and_fields_that_are_there(tmp_path: Path) -> None:
    path = write(tmp_path / "x.mcap", "json", lambda k: json.dumps(body(k)).encode(), b"{}", ["/robot", "/load"])
    with pytest.raises(ConfigError, match="joint_states"):
        read_log((path,), LogConfig.of({"fields": FIELDS}), robot_joints=None)
    with pytest.raises(LogError, match="decoded"):
        read_log((path,), settings(position="arm[*].nothing", effort=None), robot_joints=None)
    log = read_log((path,), settings(wrench="load.f"), robot_joints=None)
    (said,) = [one for one in log.findings if one.code == "log-wrench"]
    assert "3 of the six numbers" in said.text


@pytest.mark.parametrize(
    "odd",
    ['"0.5"', "[[1, 2], [3, 4]]", '{"value": 1}', "1" + "0" * 400, "[]"],
    ids=["text", "table", "object", "huge", "empty"],
)
def test_odd_json_is_left_out_and_said(odd: str, tmp_path: Path) -> None:
    """None of it becomes a number in silence."""

    def data(k: int) -> bytes:
        return json.dumps(body(k)).replace("0.5", odd).encode() if k == 5 else json.dumps(body(k)).encode()

    path = write(tmp_path / "x.mcap", "json", data, b"{}", ["/robot"])
    log = read_log((path,), settings(wrench=None), robot_joints=None)
    assert "log-left-out" in {one.code for one in log.findings}
    np.testing.assert_array_equal(log.position_rad[:, 0], np.delete(np.arange(COUNT), 5) / 10)


@pytest.mark.parametrize("odd", ["NaN", "Infinity", "null", "-Infinity"])
def test_json_that_is_no_number_is_a_missing_value(odd: str, tmp_path: Path) -> None:
    path = write(
        tmp_path / "x.mcap", "json", lambda k: json.dumps(body(k)).replace("0.5", odd).encode(), b"{}", ["/robot"]
    )
    position = read_log((path,), settings(wrench=None), robot_joints=None).position_rad
    assert position.shape == (COUNT, 2)
    assert not np.isfinite(position[5, 0]) and np.isfinite(np.delete(position, 5, axis=0)).all()


@pytest.mark.parametrize(("seconds", "usable"), [("1e3", True), ("9" * 30, False), ('"7"', True), ("NaN", True)])
def test_odd_json_stamps(seconds: str, usable: bool, tmp_path: Path) -> None:
    """No whole number is no stamp, and the time of recording serves; one beyond all times is refused."""

    def data(k: int) -> bytes:
        return json.dumps(body(k)).replace('"s": 7', f'"s": {seconds}').encode()

    path = write(tmp_path / "x.mcap", "json", data, b"{}", ["/robot"])
    config = settings(wrench=None).changed({"time": "auto"})
    if usable:
        assert read_log((path,), config, robot_joints=None).source.time_source == "log"
    else:
        with pytest.raises(LogError, match="beyond"):
            read_log((path,), config, robot_joints=None)


def test_a_second_torque_by_its_field_path(tmp_path: Path) -> None:
    def data(k: int) -> bytes:
        message = body(k)
        for joint in message["arm"]:
            joint["sensor"] = 0.5 * joint["tau"]
        return json.dumps(message).encode()

    path = write(tmp_path / "x.mcap", "json", data, b"{}", ["/robot", "/load"])
    log = read_log((path,), settings(joint_torque="arm[*].sensor"), robot_joints=None)
    assert log.effort is not None
    assert log.joint_torque_nm is not None
    np.testing.assert_allclose(log.joint_torque_nm, 0.5 * log.effort)
