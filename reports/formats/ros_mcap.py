"""ROS 2 messages as CDR bytes by rosbags, many of one shape at a time, and as one MCAP file by its library's writer."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import IO, Any

import numpy as np
from mcap.writer import CompressionType, Writer
from numpy.typing import NDArray
from rosbags.typesys import Stores, get_typestore
from rosbags.typesys.store import Typestore

from collaudit.core.numeric.parallel import Progress
from collaudit.reports.values.visible_text import visible

_CHUNK_BYTES = 4 << 20
#: Messages between two steps of progress.
_STEP = 20_000
JOINT_STATE, TRAJECTORY = "sensor_msgs/msg/JointState", "trajectory_msgs/msg/JointTrajectory"
DIAGNOSTICS, LOG = "diagnostic_msgs/msg/DiagnosticArray", "rcl_interfaces/msg/Log"
OK, WARN, ERROR, STALE = 0, 1, 2, 3
LOG_INFO, LOG_WARN, LOG_ERROR = 20, 30, 40
_NANO = 1_000_000_000
#: Where the bytes of a message's stamp lie, behind those that tell its encoding.
_STAMP = slice(4, 12)


@dataclass(frozen=True, slots=True, eq=False)
class Channel:
    """A topic and its messages in order of time.

    Attributes:
        topic: its name.
        type: name of the message type.
        stamps_ns: (n,) log times.
        messages: (n, size) bytes of messages of one size, or n messages of any.
        encoding: of the messages.
        schema: how the schema is written, and its bytes; None for the published definition of ROS 2.
    """

    topic: str
    type: str
    stamps_ns: NDArray[np.int64]
    messages: NDArray[np.uint8] | Sequence[bytes]
    encoding: str = "cdr"
    schema: tuple[str, bytes] | None = None


def write_mcap(
    out: IO[bytes],
    channels: Sequence[Channel],
    facts: Mapping[str, str],
    library: str,
    progress: Progress | None = None,
) -> None:
    """Write channels as one MCAP file with index and summary; the same input gives the same bytes.

    Args:
        out: an empty file.
        channels: what it holds, ROS 2 messages in CDR.
        facts: kept as metadata.
        library: what is named as the writer.
        progress: called with messages written and in all.
    """
    writer = Writer(out, chunk_size=_CHUNK_BYTES, compression=CompressionType.ZSTD)
    writer.start(profile="ros2", library=library)
    known: dict[tuple[str, str, bytes], int] = {}
    ids = []
    for channel in channels:
        written, content = channel.schema or ("ros2msg", _definition(channel.type))
        key = (channel.type, written, content)
        if content and key not in known:
            known[key] = writer.register_schema(*key)
        ids.append(writer.register_channel(channel.topic, channel.encoding, known.get(key, 0)))  # 0: has no schema
    stamps = np.concatenate([channel.stamps_ns for channel in channels])
    counts = [len(channel.stamps_ns) for channel in channels]
    number = np.repeat(np.arange(len(channels)), counts)
    place = np.concatenate([np.arange(count) for count in counts])
    for done, k in enumerate(np.argsort(stamps, kind="stable").tolist()):
        if progress is not None and done % _STEP == 0:
            progress(done, len(stamps))
        which, row, time_ns = int(number[k]), int(place[k]), int(stamps[k])
        writer.add_message(ids[which], time_ns, bytes(channels[which].messages[row]), time_ns, row)
    if progress is not None:
        progress(1, 1)
    writer.add_metadata("collaudit", dict(facts))
    writer.finish()  # type: ignore[no-untyped-call]


def _definition(kind: str) -> bytes:
    """The published definition of a type; empty where there is none."""
    return b"" if kind not in _store().types else _store().generate_msgdef(kind, ros_version=2)[0].encode()


@cache
def _store() -> Typestore:
    """The published definitions of a long-lived ROS 2."""
    return get_typestore(Stores.ROS2_JAZZY)


def joint_states(
    stamps_ns: NDArray[np.int64],
    names: Sequence[str],
    effort: NDArray[np.floating[Any]],
    velocity: NDArray[np.floating[Any]] | None = None,
    position: NDArray[np.floating[Any]] | None = None,
) -> NDArray[np.uint8]:
    """One ``JointState`` a stamp.

    Args:
        stamps_ns: (n,) times.
        names: of j joints.
        effort, velocity, position: (n, j) values; the last two both or neither.

    Returns:
        (n, size) bytes: all have the same size, stamp and values at the same places.
    """
    given = [values for values in (effort, velocity, position) if values is not None]
    zeros = [np.zeros(0 if values is None else len(names)) for values in (position, velocity, effort)]
    one = _serialised(JOINT_STATE, _header(0), [visible(name) for name in names], *zeros)
    out = np.tile(np.frombuffer(one, np.uint8), (len(stamps_ns), 1))
    out[:, _STAMP] = np.stack(np.divmod(stamps_ns, _NANO), axis=1).astype("<u4").view(np.uint8)
    width, end = 8 * len(names), len(one)
    for values in given:  # from the last back; before each its length, in eight bytes
        out[:, end - width : end] = np.ascontiguousarray(values, "<f8").view(np.uint8).reshape(len(stamps_ns), width)
        end -= width + 8
    return out


def joint_trajectory(
    names: Sequence[str], times_s: NDArray[np.float64], position: NDArray[np.float64], velocity: NDArray[np.float64]
) -> bytes:
    """A ``JointTrajectory`` of (n,) times from its start, s, with positions and velocities (n, j)."""
    none = np.empty(0)
    points = [
        _made("trajectory_msgs/msg/JointTrajectoryPoint", q, v, none, none, _time("Duration", round(time * _NANO)))
        for time, q, v in zip(times_s.tolist(), position, velocity, strict=True)
    ]
    return _serialised(TRAJECTORY, _header(0), [visible(name) for name in names], points)


def diagnostics(stamp_ns: int, statuses: Sequence[tuple[int, str, str, Mapping[str, str]]]) -> bytes:
    """A ``DiagnosticArray``: level, name, message and values of each status."""
    made = []
    for level, name, message, values in statuses:
        pairs = [_made("diagnostic_msgs/msg/KeyValue", key, value) for key, value in values.items()]
        made.append(_made("diagnostic_msgs/msg/DiagnosticStatus", level, visible(name), message, "", pairs))
    return _serialised(DIAGNOSTICS, _header(stamp_ns), made)


def log_message(stamp_ns: int, level: int, name: str, text: str) -> bytes:
    """A ``Log`` message of collaudit about something of that name."""
    return _serialised(LOG, _time("Time", stamp_ns), level, name, text, "", "", 0)


def _serialised(kind: str, *fields: Any) -> bytes:
    return bytes(_store().serialize_cdr(_made(kind, *fields), kind))


def _made(kind: str, *fields: Any) -> Any:
    """A message of a type, its fields in their order."""
    return _store().types[kind](*fields)


def _header(stamp_ns: int) -> Any:
    return _made("std_msgs/msg/Header", _time("Time", stamp_ns), "")


def _time(kind: str, stamp_ns: int) -> Any:
    return _made(f"builtin_interfaces/msg/{kind}", *divmod(stamp_ns, _NANO))
