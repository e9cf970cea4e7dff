"""A ROS 1 bag that ends between two records says that it is not whole."""

from __future__ import annotations

import struct
from pathlib import Path

import log_writers as w

from collaudit.core.config.schema import LogConfig
from collaudit.core.logs.log_reading import read_log


def record_ends(data: bytes) -> list[int]:
    """Where the records of a bag end, after its first line."""
    ends, at = [], data.index(b"\n") + 1
    while at < len(data):
        (header,) = struct.unpack_from("<I", data, at)
        (body,) = struct.unpack_from("<I", data, at + 4 + header)
        at += 8 + header + body
        ends.append(at)
    return ends


def test_a_bag_cut_between_records_is_partial(tmp_path: Path) -> None:
    whole = w.write_bag(tmp_path / "log.bag", w.motion(40, joints=3, encoding="ros1"), compression="lz4")
    data, samples = whole.read_bytes(), read_log((whole,), LogConfig(), robot_joints=None).time_s.size
    shorter = 0
    for end in record_ends(data)[2:-1]:
        cut = tmp_path / f"cut-{end}.bag"
        cut.write_bytes(data[:end])
        log = read_log((cut,), LogConfig(), robot_joints=None)
        if log.time_s.size < samples:
            shorter += 1
            assert "log-partial" in {finding.code for finding in log.findings}, end
    assert shorter >= 2
