"""One simulated run in every form that messages can take: compressed, encoded and defined otherwise, the same log.

An audit is a function of the log that was read, so equal numbers, to the last bit, are an equal audit.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import log_writers as w
import numpy as np
import pytest
from foxglove_messages import foxglove_states
from mcap.reader import make_reader
from mcap.writer import Writer

from collaudit.core import api
from collaudit.core.config import load_config
from collaudit.core.data.joint_log import JointLog

COUNT = 3000
JOINTS = "/joint_states"
Saids = list[w.Said]
IDL = """module sensor_msgs { module msg { struct JointState {
  std_msgs::msg::Header header;
  sequence<string> name;
  sequence<double> position;
  sequence<double> velocity;
  sequence<double> effort;
}; }; };
"""
HEADER = """#include "builtin_interfaces/msg/Time.idl"
module std_msgs { module msg { struct Header { builtin_interfaces::msg::Time stamp; string frame_id; }; }; };
"""
TIME = "module builtin_interfaces { module msg { struct Time { int32 sec; uint32 nanosec; }; }; };\n"
RULE = "=" * 80
DEFINITION = (
    f'{RULE}\nIDL: {w.JOINT_STATE}\n#include "std_msgs/msg/Header.idl"\n{IDL}'
    f"{RULE}\nIDL: std_msgs/msg/Header\n{HEADER}{RULE}\nIDL: builtin_interfaces/msg/Time\n{TIME}"
)


@pytest.fixture(scope="module")
def run(hits: Path) -> Saids:
    """The first messages of the simulated run, joint states and wrench."""
    out = []
    with hits.open("rb") as stream:
        for schema, channel, message in make_reader(stream).iter_messages(log_time_order=False):
            assert schema is not None
            out.append(
                w.Said(channel.topic, schema.name, message.log_time, w.ROS2.deserialize_cdr(message.data, schema.name))
            )
            if len(out) == COUNT:
                break
    return out


def opened(log: Path, hits: Path) -> JointLog:
    """What is read with the configuration of the simulated run."""
    return api.open_log(log, load_config(hits.with_suffix(".toml")))


def check_alike(found: JointLog, reference: JointLog) -> None:
    """All but what names the file."""
    assert found.wrench is not None and reference.wrench is not None
    facts = replace(found.source, name=reference.source.name, format=reference.source.format)
    assert facts == reference.source
    for own, its in ((found, reference), (found.wrench, reference.wrench)):
        for name in (each.name for each in fields(its) if each.name not in ("source", "wrench")):
            np.testing.assert_equal(getattr(own, name), getattr(its, name), err_msg=name)


@pytest.fixture(scope="module")
def reference(run: Saids, hits: Path, tmp_path_factory: pytest.TempPathFactory) -> JointLog:
    found = opened(w.write_mcap(tmp_path_factory.mktemp("plain") / "log.mcap", run), hits)
    assert len(found.time_s) > COUNT / 3 and found.effort_unit == "Nm"
    return found


def joints_as(path: Path, run: Saids, encoding: str) -> Path:
    """The joint states in another encoding or by another definition, the wrench as before."""
    kind, schema = foxglove_states()
    forms: dict[str, tuple[str, str, str, bytes, Callable[[Any], bytes]]] = {
        "json": (w.JOINT_STATE, "jsonschema", "json", b"{}", as_json),
        "foxglove-json": ("foxglove.JointStates", "jsonschema", "json", b"{}", as_foxglove_json),
        "protobuf": ("foxglove.JointStates", "protobuf", "protobuf", schema, lambda value: as_protobuf(kind, value)),
        "idl": (w.JOINT_STATE, "ros2idl", "cdr", DEFINITION.encode(), as_cdr),
        "no-definition": (w.JOINT_STATE, "", "cdr", b"", as_cdr),
    }
    name, schema_encoding, message_encoding, definition, packed = forms[encoding]
    with path.open("wb") as stream:
        writer = Writer(stream, repeat_schemas=False)
        writer.start(profile="ros2")
        number = writer.register_schema(name, schema_encoding, definition)
        joints = writer.register_channel(JOINTS, message_encoding, number)
        number = writer.register_schema(w.WRENCH, "ros2msg", w.definition(w.WRENCH, "cdr").encode())
        wrench = writer.register_channel("/ft_sensor/wrench", "cdr", number)
        for said in run:
            mine = said.topic == JOINTS
            data = packed(said.value) if mine else w.encode(said, "cdr")
            writer.add_message(joints if mine else wrench, said.log_ns, data, said.log_ns)
        writer.finish()
    return path


def as_cdr(value: Any) -> bytes:
    return bytes(w.ROS2.serialize_cdr(value, w.JOINT_STATE))


def as_json(value: Any) -> bytes:
    stamp = {"sec": value.header.stamp.sec, "nanosec": value.header.stamp.nanosec}
    arrays = {key: getattr(value, key).tolist() for key in ("position", "velocity", "effort")}
    return json.dumps({"header": {"stamp": stamp}, "name": value.name, **arrays}).encode()


def joints_of(value: Any) -> list[dict[str, Any]]:
    rows = zip(value.name, value.position.tolist(), value.velocity.tolist(), value.effort.tolist(), strict=True)
    return [dict(zip(("name", "position", "velocity", "effort"), row, strict=True)) for row in rows]


def as_foxglove_json(value: Any) -> bytes:
    stamp = {"sec": value.header.stamp.sec, "nsec": value.header.stamp.nanosec}
    return json.dumps({"timestamp": stamp, "joints": joints_of(value)}).encode()


def as_protobuf(kind: Any, value: Any) -> bytes:
    message = kind(joints=joints_of(value))
    message.timestamp.seconds, message.timestamp.nanos = value.header.stamp.sec, value.header.stamp.nanosec
    data: bytes = message.SerializeToString()
    return data


@pytest.mark.parametrize("encoding", ["json", "foxglove-json", "protobuf", "idl", "no-definition"])
def test_encodings_and_definitions(encoding: str, run: Saids, reference: JointLog, hits: Path, tmp_path: Path) -> None:
    check_alike(opened(joints_as(tmp_path / "log.mcap", run, encoding), hits), reference)


@pytest.mark.parametrize("storage", ["sqlite3", "mcap"])
@pytest.mark.parametrize("packing", ["", "message-zstd", "message-lz4", "file-zstd", "file-lz4"])
def test_bags_by_compression(
    storage: str, packing: str, run: Saids, reference: JointLog, hits: Path, tmp_path: Path
) -> None:
    folder = w.write_folder(tmp_path / "bag", run, storage=storage, packing=packing)
    check_alike(opened(folder, hits), reference)


@pytest.mark.parametrize("how", [{"little": False}, {"chunked": False}, {"compression": "lz4"}, {"summary": False}])
def test_mcap_forms(how: dict[str, Any], run: Saids, reference: JointLog, hits: Path, tmp_path: Path) -> None:
    check_alike(opened(w.write_mcap(tmp_path / "log.mcap", run, **how), hits), reference)
