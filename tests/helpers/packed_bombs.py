"""Small files that honestly hold very much: each writes one of at most 9 MB, as its format packs it."""

from __future__ import annotations

import sqlite3
from pathlib import Path

import log_writers as w
import lz4.frame
import numpy as np
import zstandard

#: What a chunk of 8 MB truly holds.
HELD = 1_900_000_000


def mcap_of_chunks(path: Path, data: bytes, size: int, count: int = 1, packing: str = "lz4") -> Path:
    """An MCAP file of equal chunks."""

    def record(op: int, body: bytes) -> bytes:
        return bytes([op]) + len(body).to_bytes(8, "little") + body

    def text(value: str) -> bytes:
        return len(value).to_bytes(4, "little") + value.encode()

    definition = w.definition(w.JOINT_STATE, "cdr")
    schema = (1).to_bytes(2, "little") + text(w.JOINT_STATE) + text("ros2msg") + text(definition)
    channel = (1).to_bytes(2, "little") * 2 + text("/joint_states") + text("cdr") + (0).to_bytes(4, "little")
    times = bytes(16) + size.to_bytes(8, "little") + bytes(4) + text(packing) + len(data).to_bytes(8, "little")
    magic = b"\x89MCAP0\r\n"
    head = record(1, text("ros2") + text("")) + record(3, schema) + record(4, channel)
    tail = record(15, bytes(4)) + record(2, bytes(20))
    path.write_bytes(magic + head + count * record(6, times + data) + tail + magic)
    return path


def lz4_zeros() -> bytes:
    """8 MB that truly hold 1.9 GB of zeros."""
    context = lz4.frame.LZ4FrameCompressor()
    block = bytes(50_000_000)
    parts = [context.begin(HELD), *(context.compress(block) for _ in range(HELD // len(block))), context.flush()]
    return b"".join(parts)


def zstd_zeros(held: int = HELD, noise: int = 8_000_000) -> bytes:
    """So many bytes of noise and then zeros, so that no ratio looks odd."""
    packer = zstandard.ZstdCompressor(level=1).compressobj(size=held)
    block = bytes(10_000_000)
    parts = [packer.compress(np.random.default_rng(1).bytes(noise))]
    left = held - noise
    while left > 0:
        parts.append(packer.compress(block[:left]))
        left -= len(block)
    return b"".join([*parts, packer.flush()])


def packed_zeros(path: Path) -> Path:
    return mcap_of_chunks(path, lz4_zeros(), HELD)


def packed_zeros_zstd(path: Path) -> Path:
    return mcap_of_chunks(path, zstd_zeros(), HELD, packing="zstd")


def packed_bag(path: Path) -> Path:
    """A ROS 1 bag of one chunk."""

    def record(fields: dict[bytes, bytes], data: bytes) -> bytes:
        said = b"".join(
            (len(name) + 1 + len(value)).to_bytes(4, "little") + name + b"=" + value for name, value in fields.items()
        )
        return len(said).to_bytes(4, "little") + said + len(data).to_bytes(4, "little") + data

    data = lz4_zeros()
    head = {b"op": b"\x03", b"index_pos": bytes(8), b"conn_count": bytes(4), b"chunk_count": bytes(4)}
    chunk = {b"op": b"\x05", b"compression": b"lz4", b"size": HELD.to_bytes(4, "little")}
    path = path.with_suffix(".bag")
    path.write_bytes(b"#ROSBAG V2.0\n" + record(head, b" " * 4000) + record(chunk, data))
    return path


def packed_db3(path: Path) -> Path:
    """A bag folder whose messages are compressed one by one: three of 230 MB each."""
    said = [w.joint_state(["joint1", "joint2"], [0, 0], [0, 0], [0, 0], stamp_ns=w.EPOCH + k) for k in range(3)]
    folder = w.write_folder(path.with_suffix(""), said, packing="message-zstd")
    db = sqlite3.connect(w.storage_file(folder))
    with db:
        db.execute("UPDATE messages SET data = ?", (zstd_zeros(230_000_000, 900_000),))
    db.close()
    return folder


def packed_xz(path: Path) -> Path:
    import lzma

    path = path.with_suffix(".csv.xz")
    with lzma.open(path, "wb", preset=0) as stream:
        stream.write(b"t,q1,q2,dq1,dq2,tau1,tau2\n")
        for _ in range(12):
            stream.write(b"0,0,0,0,0,0,0\n" * 1_000_000)
    return path


def packed_messages(path: Path) -> Path:
    """240 MB of joint states of 500 joints, all alike, in a megabyte."""
    said = w.joint_state([f"joint{j}" for j in range(500)], np.zeros(500), np.zeros(500), np.zeros(500))
    body = (1).to_bytes(2, "little") + bytes(4) + said.log_ns.to_bytes(8, "little") * 2 + w.encode(said, "cdr")
    one = bytes([5]) + len(body).to_bytes(8, "little") + body
    data = one * (120_000_000 // len(one))
    return mcap_of_chunks(path, lz4.frame.compress(data), len(data), 2)


def packed_text(path: Path) -> Path:
    import gzip

    path = path.with_suffix(".csv.gz")
    rows = gzip.compress(b"0,0,0,0,0,0,0\n" * 1_000_000, 6)
    path.write_bytes(gzip.compress(b"t,q1,q2,dq1,dq2,tau1,tau2\n") + 12 * rows)
    return path


def packed_columns(path: Path) -> Path:
    import pyarrow as pa
    import pyarrow.parquet as pq

    path = path.with_suffix(".parquet")
    zeros = pa.array(np.zeros(4_000_000))
    pq.write_table(pa.table(dict.fromkeys(("t", "q1", "q2", "dq1", "dq2", "tau1", "tau2"), zeros)), path)
    return path
