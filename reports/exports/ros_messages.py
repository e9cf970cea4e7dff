"""ROS 2 messages as CDR bytes, many of one shape at a time.

The definitions hold the fields of the published ROS 2 interfaces ``sensor_msgs/JointState``,
``trajectory_msgs/JointTrajectory``, ``diagnostic_msgs/DiagnosticArray`` and ``rcl_interfaces/Log``, in their order.
CDR (XTypes 1.3, plain, little endian): four bytes of encapsulation, then every number at a multiple of its size,
counted from there.
"""

from __future__ import annotations

import struct
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

_RULE = "=" * 80
_HEADER = (
    f"{_RULE}\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n"
    f"{_RULE}\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n"
)

#: Type name to definition, with those it is made of.
DEFINITIONS = {
    "sensor_msgs/msg/JointState": (
        "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort\n" + _HEADER
    ),
    "trajectory_msgs/msg/JointTrajectory": (
        "std_msgs/Header header\nstring[] joint_names\ntrajectory_msgs/JointTrajectoryPoint[] points\n"
        + _HEADER
        + f"{_RULE}\nMSG: trajectory_msgs/JointTrajectoryPoint\nfloat64[] positions\nfloat64[] velocities\n"
        "float64[] accelerations\nfloat64[] effort\nbuiltin_interfaces/Duration time_from_start\n"
        f"{_RULE}\nMSG: builtin_interfaces/Duration\nint32 sec\nuint32 nanosec\n"
    ),
    "diagnostic_msgs/msg/DiagnosticArray": (
        "std_msgs/Header header\ndiagnostic_msgs/DiagnosticStatus[] status\n"
        + _HEADER
        + f"{_RULE}\nMSG: diagnostic_msgs/DiagnosticStatus\nbyte OK=0\nbyte WARN=1\nbyte ERROR=2\nbyte STALE=3\n"
        "byte level\nstring name\nstring message\nstring hardware_id\ndiagnostic_msgs/KeyValue[] values\n"
        f"{_RULE}\nMSG: diagnostic_msgs/KeyValue\nstring key\nstring value\n"
    ),
    "rcl_interfaces/msg/Log": (
        "byte DEBUG=10\nbyte INFO=20\nbyte WARN=30\nbyte ERROR=40\nbyte FATAL=50\n"
        "builtin_interfaces/Time stamp\nuint8 level\nstring name\nstring msg\nstring file\nstring function\n"
        "uint32 line\n"
        f"{_RULE}\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n"
    ),
}
OK, WARN, ERROR, STALE = 0, 1, 2, 3
LOG_INFO, LOG_WARN, LOG_ERROR = 20, 30, 40

_NANO = 1_000_000_000


class _Cdr:
    """Bytes that grow, every field at its place."""

    def __init__(self) -> None:
        self.data = bytearray(b"\x00\x01\x00\x00")

    def number(self, kind: str, value: float) -> None:
        size = struct.calcsize(f"<{kind}")
        self.data += bytes(-(len(self.data) - 4) % size) + struct.pack(f"<{kind}", value)

    def text(self, value: str) -> None:
        raw = value.encode("utf-8", "backslashreplace").replace(b"\x00", b"\\x00") + b"\x00"
        self.number("I", len(raw))
        self.data += raw

    def stamp(self, stamp_ns: int) -> None:
        self.number("i", stamp_ns // _NANO)
        self.number("I", stamp_ns % _NANO)


def joint_states(stamps_ns: NDArray[np.int64], names: Sequence[str], effort: NDArray[np.float64]) -> NDArray[np.uint8]:
    """One ``JointState`` a stamp, with efforts alone.

    Args:
        stamps_ns: (n,) times.
        names: of j joints.
        effort: (n, j) values.

    Returns:
        (n, size) bytes: all have the same size.
    """
    cdr = _Cdr()
    cdr.stamp(0)
    cdr.text("")
    cdr.number("I", len(names))
    for name in names:
        cdr.text(name)
    for _ in ("position", "velocity"):
        cdr.number("I", 0)
    cdr.number("I", len(names))
    if names:
        cdr.number("d", 0.0)
        del cdr.data[-8:]
    start = len(cdr.data)
    out = np.zeros((len(stamps_ns), start + 8 * len(names)), np.uint8)
    out[:, :start] = np.frombuffer(bytes(cdr.data), np.uint8)
    seconds, rest = np.divmod(stamps_ns, _NANO)
    out[:, 4:8] = seconds.astype("<i4")[:, None].view(np.uint8)
    out[:, 8:12] = rest.astype("<u4")[:, None].view(np.uint8)
    out[:, start:] = np.ascontiguousarray(effort, "<f8").view(np.uint8).reshape(len(stamps_ns), 8 * effort.shape[1])
    return out


def joint_trajectory(
    names: Sequence[str], times_s: NDArray[np.float64], position: NDArray[np.float64], velocity: NDArray[np.float64]
) -> bytes:
    """A ``JointTrajectory`` of (n,) times from its start, s, with positions and velocities (n, j)."""
    cdr = _Cdr()
    cdr.stamp(0)
    cdr.text("")
    cdr.number("I", len(names))
    for name in names:
        cdr.text(name)
    cdr.number("I", len(times_s))
    for time, *rows in zip(times_s.tolist(), position.tolist(), velocity.tolist(), strict=True):
        for row in (*rows, [], []):
            cdr.number("I", len(row))
            for value in row:
                cdr.number("d", value)
        cdr.stamp(round(time * _NANO))
    return bytes(cdr.data)


def diagnostics(stamp_ns: int, statuses: Sequence[tuple[int, str, str, Mapping[str, str]]]) -> bytes:
    """A ``DiagnosticArray``: level, name, message and values of each status."""
    cdr = _Cdr()
    cdr.stamp(stamp_ns)
    cdr.text("")
    cdr.number("I", len(statuses))
    for level, name, message, values in statuses:
        cdr.number("B", level)
        for text in (name, message, ""):
            cdr.text(text)
        cdr.number("I", len(values))
        for key, value in values.items():
            cdr.text(key)
            cdr.text(value)
    return bytes(cdr.data)


def log_message(stamp_ns: int, level: int, name: str, text: str) -> bytes:
    """A ``Log`` message of collaudit about something of that name."""
    cdr = _Cdr()
    cdr.stamp(stamp_ns)
    cdr.number("B", level)
    for value in (name, text, "", ""):
        cdr.text(value)
    cdr.number("I", 0)
    return bytes(cdr.data)
