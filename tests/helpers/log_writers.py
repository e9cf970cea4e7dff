"""Tiny logs of every format for tests, written by the mcap and rosbags packages."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import lz4.frame
import numpy as np
from mcap.writer import CompressionType, IndexType, Writer
from rosbags.rosbag1 import Writer as Bag1Writer
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin
from rosbags.rosbag2 import Writer as Bag2Writer
from rosbags.typesys import Stores, get_typestore

ROS2 = get_typestore(Stores.ROS2_HUMBLE)
ROS1 = get_typestore(Stores.ROS1_NOETIC)
JOINT_STATE = "sensor_msgs/msg/JointState"
WRENCH = "geometry_msgs/msg/WrenchStamped"
EPOCH = 1_700_000_000_000_000_000
PERIOD = 2_000_000
COMPRESSION = {"": CompressionType.NONE, "zstd": CompressionType.ZSTD, "lz4": CompressionType.LZ4}


@dataclass(frozen=True)
class Said:
    """One message: topic, type, recording time and the object to serialise."""

    topic: str
    type: str
    log_ns: int
    value: Any


def store_of(encoding: str) -> Any:
    return ROS1 if encoding == "ros1" else ROS2


def encode(said: Said, encoding: str, *, little: bool = True, store: Any = None) -> bytes:
    store = store or store_of(encoding)
    if encoding == "ros1":
        return bytes(store.serialize_ros1(said.value, said.type))
    return bytes(store.serialize_cdr(said.value, said.type, little_endian=little))


def header(store: Any, stamp_ns: int, frame: str = "") -> Any:
    stamp = store.types["builtin_interfaces/msg/Time"](sec=stamp_ns // 10**9, nanosec=stamp_ns % 10**9)
    kind = store.types["std_msgs/msg/Header"]
    return kind(seq=0, stamp=stamp, frame_id=frame) if store is ROS1 else kind(stamp=stamp, frame_id=frame)


def joint_state(
    names: Sequence[str],
    position: Sequence[float],
    velocity: Sequence[float] = (),
    effort: Sequence[float] = (),
    *,
    stamp_ns: int = EPOCH,
    log_ns: int | None = None,
    frame: str = "",
    topic: str = "/joint_states",
    encoding: str = "cdr",
) -> Said:
    store = store_of(encoding)
    arrays = [np.asarray(values, dtype=np.float64) for values in (position, velocity, effort)]
    value = store.types[JOINT_STATE](
        header=header(store, stamp_ns, frame),
        name=list(names),
        position=arrays[0],
        velocity=arrays[1],
        effort=arrays[2],
    )
    return Said(topic, JOINT_STATE, stamp_ns if log_ns is None else log_ns, value)


def wrench(values: Sequence[float], *, stamp_ns: int = EPOCH, topic: str = "/ft/wrench", encoding: str = "cdr") -> Said:
    store = store_of(encoding)
    vector = store.types["geometry_msgs/msg/Vector3"]
    force, torque = (vector(*(float(x) for x in part)) for part in (values[:3], values[3:]))
    inner = store.types["geometry_msgs/msg/Wrench"](force=force, torque=torque)
    value = store.types[WRENCH](header=header(store, stamp_ns, "ft"), wrench=inner)
    return Said(topic, WRENCH, stamp_ns, value)


def motion(
    count: int, *, joints: int = 6, encoding: str = "cdr", with_wrench: bool = True, jitter_ns: int = 3000
) -> list[Said]:
    """A smooth motion at 500 Hz with wrench messages between; stamps steady, recording times jittering."""
    rng = np.random.default_rng(7)
    out = []
    for k in range(count):
        stamp = EPOCH + k * PERIOD
        t = k * PERIOD / 1e9
        phase = t + np.arange(joints)
        out.append(
            joint_state(
                [f"joint{j + 1}" for j in range(joints)],
                np.sin(phase),
                np.cos(phase),
                3 * np.sin(2 * phase) + rng.normal(0, 0.1, joints),
                stamp_ns=stamp,
                log_ns=stamp + 150_000 + int(rng.integers(0, max(jitter_ns, 1))),
                frame="base",
                encoding=encoding,
            )
        )
        if with_wrench:
            out.append(wrench(np.arange(6) + t, stamp_ns=stamp + PERIOD // 2, encoding=encoding))
    return out


def definition(type_name: str, encoding: str, store: Any = None) -> str:
    version = 1 if encoding == "ros1" else 2
    return str((store or store_of(encoding)).generate_msgdef(type_name, ros_version=version)[0])


def write_mcap(
    path: Path,
    messages: Iterable[Said],
    *,
    encoding: str = "cdr",
    compression: str = "zstd",
    chunk_size: int = 1 << 12,
    chunked: bool = True,
    summary: bool = True,
    message_index: bool = True,
    little: bool = True,
    store: Any = None,
) -> Path:
    index = IndexType.ALL if summary else IndexType.NONE
    if message_index:
        index |= IndexType.MESSAGE
    else:
        index &= ~IndexType.MESSAGE
    with path.open("wb") as stream:
        writer = Writer(
            stream,
            chunk_size=chunk_size,
            compression=COMPRESSION[compression],
            index_types=index,
            use_chunking=chunked,
            use_statistics=summary,
            use_summary_offsets=summary,
            repeat_channels=summary,
            repeat_schemas=summary,
        )
        writer.start(profile="ros1" if encoding == "ros1" else "ros2")
        channels: dict[str, int] = {}
        for said in messages:
            if said.topic not in channels:
                name = said.type.replace("/msg/", "/") if encoding == "ros1" else said.type
                schema = writer.register_schema(
                    name, encoding="ros1msg" if encoding == "ros1" else "ros2msg",
                    data=definition(said.type, encoding, store).encode(),
                )  # fmt: skip
                channels[said.topic] = writer.register_channel(said.topic, encoding, schema)
            data = encode(said, encoding, little=little, store=store)
            writer.add_message(channels[said.topic], said.log_ns, data, said.log_ns)
        writer.finish()
    return path


def write_bag(path: Path, messages: Iterable[Said], *, compression: str = "", chunk_size: int = 1 << 12) -> Path:
    writer = Bag1Writer(path)
    writer.chunk_threshold = chunk_size
    if compression:
        writer.set_compression(Bag1Writer.CompressionFormat[compression.upper()])
    connections: dict[str, Any] = {}
    with writer:
        for said in messages:
            if said.topic not in connections:
                connections[said.topic] = writer.add_connection(said.topic, said.type, typestore=ROS1)
            writer.write(connections[said.topic], said.log_ns, encode(said, "ros1"))
    return path


def write_folder(path: Path, messages: Iterable[Said], *, storage: str = "sqlite3", packing: str = "") -> Path:
    """A bag folder; ``packing`` is rosbag2's compression: ``message-zstd``, ``file-lz4`` …"""
    plugin = StoragePlugin.SQLITE3 if storage == "sqlite3" else StoragePlugin.MCAP
    mode, _, method = packing.partition("-")
    connections: dict[str, Any] = {}
    writer = Bag2Writer(path, version=9, storage_plugin=plugin)
    if method == "zstd":
        writer.set_compression(CompressionMode[mode.upper()], CompressionFormat.ZSTD)
    with writer:
        for said in messages:
            if said.topic not in connections:
                connections[said.topic] = writer.add_connection(said.topic, said.type, typestore=ROS2)
            data = encode(said, "cdr")
            packed = lz4.frame.compress(data) if packing == "message-lz4" else data
            writer.write(connections[said.topic], said.log_ns, packed)
    if method == "lz4":  # the rosbags package writes zstd alone
        _state_lz4(path, mode)
    return path


def _state_lz4(folder: Path, mode: str) -> None:
    metadata = folder / "metadata.yaml"
    text = metadata.read_text()
    text = text.replace("compression_format: ''", "compression_format: lz4")
    text = text.replace("compression_mode: ''", f"compression_mode: {mode.upper()}")
    if mode == "file":
        plain = storage_file(folder)
        packed = plain.with_name(plain.name + ".lz4")
        packed.write_bytes(lz4.frame.compress(plain.read_bytes()))
        plain.unlink()
        text = text.replace(plain.name, packed.name)
    metadata.write_text(text)


def storage_file(folder: Path) -> Path:
    """The only storage file of a bag folder."""
    (found,) = [path for path in folder.iterdir() if path.suffix in (".db3", ".mcap")]
    return found


def write_any(folder: Path, kind: str, messages_of: Any) -> Path:
    """A log of a kind such as ``mcap-zstd``, ``mcap-ros1``, ``bag-lz4``, ``db3``, ``folder-mcap``."""
    if kind == "mcap-ros1":
        return write_mcap(folder / "log.mcap", messages_of("ros1"), encoding="ros1")
    if kind == "mcap-unchunked":
        return write_mcap(folder / "log.mcap", messages_of("cdr"), chunked=False)
    if kind == "mcap-plain":
        return write_mcap(folder / "log.mcap", messages_of("cdr"), summary=False, message_index=False)
    if kind == "mcap-big-endian":
        return write_mcap(folder / "log.mcap", messages_of("cdr"), little=False)
    if kind.startswith("mcap"):
        compression = kind.removeprefix("mcap-").replace("none", "")
        return write_mcap(folder / "log.mcap", messages_of("cdr"), compression=compression)
    if kind.startswith("bag"):
        return write_bag(
            folder / "log.bag", messages_of("ros1"), compression=kind.removeprefix("bag-").replace("none", "")
        )
    if kind == "db3":
        return storage_file(write_folder(folder / "bag", messages_of("cdr")))
    return write_folder(folder / "bag", messages_of("cdr"), storage=kind.removeprefix("folder-"))


KINDS = (
    "mcap-zstd", "mcap-lz4", "mcap-none", "mcap-unchunked", "mcap-plain", "mcap-big-endian", "mcap-ros1",
    "bag-none", "bag-lz4", "bag-bz2", "db3", "folder-sqlite3", "folder-mcap",
)  # fmt: skip
