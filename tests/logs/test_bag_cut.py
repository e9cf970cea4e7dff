"""A ROS 1 bag that ends between two records says that it is not whole."""

from __future__ import annotations

import struct
from pathlib import Path

import log_writers as w
import pytest

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


@pytest.mark.parametrize("compression", ["lz4", "bz2"])
def test_a_chunk_that_claims_fewer_bytes_than_it_holds_is_damage(tmp_path: Path, compression: str) -> None:
    bag = w.write_bag(tmp_path / "log.bag", w.motion(40, joints=3, encoding="ros1"), compression=compression)
    data = bytearray(bag.read_bytes())
    at = data.index(b"size=") + len("size=")
    (size,) = struct.unpack_from("<I", data, at)
    struct.pack_into("<I", data, at, size // 2)
    bag.write_bytes(data)
    log = read_log((bag,), LogConfig(), robot_joints=None)
    said = [finding.text for finding in log.findings if finding.code == "log-partial"]
    assert any(f"more than the {size // 2} bytes" in text for text in said), said
