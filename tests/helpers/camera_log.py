"""An indexed MCAP in which a camera takes most of the room, from a table of the small arm."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
from mcap.writer import IndexType, Writer

_TIME = "MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n"
_HEADER = f"MSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n{'=' * 80}\n{_TIME}"
_STATES = (
    f"std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort\n{'=' * 80}\n"
)
_START_NS = 1_700_000_000_000_000_000
_IMAGE_BYTES = 1 << 20

_BEFORE = b"\x00\x01\x00\x00"


def write_camera_log(out: Path, table: Path, images: int, *, summary: bool = True) -> None:
    """Joint states of a table (t, q1, q2, dq1, dq2, tau1, tau2), and images of 1 MB in chunks of their own."""
    rows = np.loadtxt(table, delimiter=",", skiprows=1)
    image = np.random.default_rng(0).integers(0, 256, _IMAGE_BYTES, dtype=np.uint8).tobytes()
    with out.open("wb") as file:
        bare = {} if summary else {"index_types": IndexType.NONE, "repeat_schemas": False, "use_statistics": False}
        writer = Writer(file, chunk_size=_IMAGE_BYTES, **bare)
        writer.start("ros2", "tests")
        states = writer.register_schema("sensor_msgs/msg/JointState", "ros2msg", (_STATES + _HEADER).encode())
        joints = writer.register_channel("/joint_states", "cdr", states)
        camera = writer.register_channel("/camera", "cdr", 0)
        for row in rows:
            at = _START_NS + round(row[0] * 1e9)
            writer.add_message(joints, at, _joint_state(at, row), at)
        for k in range(images):
            writer.add_message(camera, _START_NS + k, image, _START_NS + k)
        writer.finish()


def _joint_state(at_ns: int, row: np.ndarray) -> bytes:
    """CDR of one message; alignment counts from after the first four bytes."""
    out = bytearray(_BEFORE + struct.pack("<iI", *divmod(at_ns, 10**9)) + struct.pack("<I", 1) + b"\0\0\0\0")
    out += struct.pack("<I", 2)
    for name in (b"joint1\0", b"joint2\0"):
        out += struct.pack("<I", len(name)) + name + b"\0"
    for values in (row[1:3], row[3:5], row[5:7]):
        out += struct.pack("<I", 2)
        out += b"\0" * (-(len(out) - 4) % 8)
        out += struct.pack("<2d", *values)
    return bytes(out)
