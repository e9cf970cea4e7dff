"""Logs for measurements: 500 Hz, seven joints and a wrench, written once into a cache folder."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from mcap.writer import CompressionType, IndexType, Writer
from rosbags.rosbag1 import Writer as Bag1Writer
from rosbags.rosbag2 import Writer as Bag2Writer
from rosbags.typesys import Stores, get_typestore

RATE_HZ = 500
EPOCH = 1_700_000_000_000_000_000
JOINT_STATE, WRENCH = "sensor_msgs/msg/JointState", "geometry_msgs/msg/WrenchStamped"
NAMES = [f"panda_joint{j + 1}" for j in range(7)]
ROS1, ROS2 = get_typestore(Stores.ROS1_NOETIC), get_typestore(Stores.ROS2_HUMBLE)
TOPICS = {"/joint_states": JOINT_STATE, "/ft_sensor/wrench": WRENCH}
MESSAGE = (CompressionType.ZSTD, CompressionType.LZ4, CompressionType.NONE)


def cache_dir() -> Path:
    """Where the logs are kept: ``COLLAUDIT_BENCH_DIR``, or a folder of the system's temporary one."""
    path = Path(os.environ.get("COLLAUDIT_BENCH_DIR") or Path(tempfile.gettempdir()) / "collaudit-bench")
    path.mkdir(parents=True, exist_ok=True)
    return path


def signals(minutes: float) -> tuple[np.ndarray[Any, Any], np.ndarray[Any, Any]]:
    """(n, 21) position, velocity, effort and (n, 6) wrench, noisy as encoders and drives are."""
    count = round(minutes * 60 * RATE_HZ)
    rng = np.random.default_rng(3)
    t = np.arange(count)[:, None] / RATE_HZ
    phase = 0.4 * t + np.arange(7)
    joints = np.hstack([np.sin(phase), 0.4 * np.cos(phase), 20 * np.sin(phase + 1)])
    joints += rng.normal(0, 1e-4, joints.shape)
    return joints, rng.normal(0, 1, (count, 6))


def _objects(store: Any) -> tuple[Any, Any]:
    types = store.types
    stamp = types["builtin_interfaces/msg/Time"](sec=0, nanosec=0)
    extra = {"seq": 0} if store is ROS1 else {}
    header = types["std_msgs/msg/Header"](stamp=stamp, frame_id="base", **extra)
    zeros = np.zeros(7)
    joints = types[JOINT_STATE](header=header, name=NAMES, position=zeros, velocity=zeros, effort=zeros)
    vector = types["geometry_msgs/msg/Vector3"](x=0.0, y=0.0, z=0.0)
    wrench = types["geometry_msgs/msg/Wrench"](force=vector, torque=vector)
    return joints, types[WRENCH](header=header, wrench=wrench)


Made = tuple[np.ndarray[Any, Any], np.ndarray[Any, Any]]


def messages(minutes: float, encoding: str, made: Made | None = None) -> Iterator[tuple[str, int, bytes]]:
    """(topic, log time, bytes): one serialised template of each type, its stamp and numbers filled in.

    ``made`` takes the place of :func:`signals`.
    """
    store = ROS1 if encoding == "ros1" else ROS2
    write: Callable[..., Any] = store.serialize_ros1 if encoding == "ros1" else store.serialize_cdr
    templates = [bytearray(write(o, k)) for o, k in zip(_objects(store), (JOINT_STATE, WRENCH), strict=True)]
    joints, wrench = signals(minutes) if made is None else made
    stamp_at = 4
    rng = np.random.default_rng(5)
    jitter = rng.integers(0, 100_000, joints.shape[0])
    blocks = joints.reshape(-1, 3, 7)
    starts = [len(templates[0]) - 3 * 56 - 2 * _gap(encoding) + k * (56 + _gap(encoding)) for k in range(3)]
    for k in range(joints.shape[0]):
        stamp = EPOCH + k * 2_000_000
        halves = (stamp // 10**9).to_bytes(4, "little") + (stamp % 10**9).to_bytes(4, "little")
        for template, values, topic in zip(templates, (blocks[k], wrench[k]), TOPICS, strict=True):
            template[stamp_at : stamp_at + 8] = halves
            if topic == "/joint_states":
                for start, part in zip(starts, values, strict=True):
                    template[start : start + 56] = part.tobytes()
            else:
                template[-48:] = values.tobytes()
            yield topic, stamp + 200_000 + int(jitter[k]), bytes(template)


def _gap(encoding: str) -> int:
    """Bytes between two arrays of doubles: their count, and in CDR its padding."""
    return 4 if encoding == "ros1" else 8


def mcap_log(minutes: float, compression: CompressionType, *, chunked: bool = True) -> Path:
    """An MCAP of so many minutes."""
    label = compression.name.lower() if chunked else "unchunked"
    path = cache_dir() / f"log-{minutes:g}min-{label}.mcap"
    if not path.exists():
        written(path, lambda part: mcap_file(part, messages(minutes, "cdr"), compression, chunked=chunked))
    return path


def mcap_file(
    path: Path, its: Iterator[tuple[str, int, bytes]], compression: CompressionType, *, chunked: bool = True
) -> None:
    """Write messages in CDR into an MCAP."""
    with path.open("wb") as stream:
        writer = Writer(stream, compression=compression, use_chunking=chunked, index_types=IndexType.ALL)
        writer.start(profile="ros2")
        channels = {}
        for topic, kind in TOPICS.items():
            text = ROS2.generate_msgdef(kind, ros_version=2)[0]
            channels[topic] = writer.register_channel(
                topic, "cdr", writer.register_schema(kind, "ros2msg", text.encode())
            )
        for topic, log_ns, data in its:
            writer.add_message(channels[topic], log_ns, data, log_ns)
        writer.finish()


def bag_log(minutes: float, compression: str) -> Path:
    """A ROS 1 bag of so many minutes; ``compression`` is "", ``LZ4`` or ``BZ2``."""
    path = cache_dir() / f"log-{minutes:g}min-{compression.lower() or 'none'}.bag"
    if not path.exists():
        written(path, lambda part: _bag(part, minutes, compression))
    return path


def _bag(path: Path, minutes: float, compression: str) -> None:
    writer = Bag1Writer(path)
    if compression:
        writer.set_compression(Bag1Writer.CompressionFormat[compression])
    with writer:
        connections = {topic: writer.add_connection(topic, kind, typestore=ROS1) for topic, kind in TOPICS.items()}
        for topic, log_ns, data in messages(minutes, "ros1"):
            writer.write(connections[topic], log_ns, data)


def db3_log(minutes: float) -> Path:
    """A ROS 2 bag folder with sqlite3 storage of so many minutes."""
    path = cache_dir() / f"log-{minutes:g}min-db3"
    if not path.exists():
        written(path, lambda part: _db3(part, minutes))
    return path


def _db3(path: Path, minutes: float) -> None:
    with Bag2Writer(path, version=9) as writer:
        connections = {topic: writer.add_connection(topic, kind, typestore=ROS2) for topic, kind in TOPICS.items()}
        for topic, log_ns, data in messages(minutes, "cdr"):
            writer.write(connections[topic], log_ns, data)


def csv_log(minutes: float) -> Path:
    """A CSV of 28 columns: time, position, velocity, effort, wrench."""
    path = cache_dir() / f"log-{minutes:g}min.csv"
    if not path.exists():
        written(path, lambda part: _csv(part, minutes))
    return path


def _csv(path: Path, minutes: float) -> None:
    import pandas as pd

    joints, wrench = signals(minutes)
    columns = [f"{kind}{j + 1}" for kind in ("q", "dq", "tau") for j in range(7)]
    frame = pd.DataFrame(joints, columns=columns)
    frame.insert(0, "t", np.arange(joints.shape[0]) / RATE_HZ)
    for number, name in enumerate(("fx", "fy", "fz", "mx", "my", "mz")):
        frame[name] = wrench[:, number]
    frame.to_csv(path, index=False)


def written(path: Path, make: Callable[[Path], None]) -> None:
    """Write beside and move into place, so that an interrupted run leaves nothing half-written behind."""
    part = path.with_name(f"part-{os.getpid()}-{path.name}")
    make(part)
    part.rename(path)
