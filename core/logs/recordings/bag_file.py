"""Reading ROS 1 bags (format 2.0) as batches of raw messages.

Record layout: https://wiki.ros.org/Bags/Format/2.0. The file is walked from its start rather than by its
index, so that unindexed and still-active bags are read the same way as closed ones; a chunk is read by its index
data, proven against the bytes.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from collaudit.core.errors import LogError
from collaudit.core.logs.storage.chunked_file import Chunk, ChunkedFile, ChunkRef
from collaudit.core.logs.storage.decompression import unpack
from collaudit.core.logs.storage.records import (
    NS_PER_S,
    ByteArray,
    Channel,
    Located,
    MessageReader,
    ascending,
    follow_each_other,
    gather,
    ros_type,
)
from collaudit.core.numeric.arrays import IntArray
from collaudit.core.numeric.parallel import ordered_map

MAGIC = b"#ROSBAG V2.0\n"
MSG, BAG_HEADER, INDEX, CHUNK, CHUNK_INFO, CONNECTION = 2, 3, 4, 5, 6, 7
_WINDOW = 1 << 12
_MAX_HEADER = 1 << 20
_U32 = struct.Struct("<I")


def fields_of(header: bytes) -> dict[bytes, bytes]:
    """Name to value of a record header; empty when it is malformed."""
    out: dict[bytes, bytes] = {}
    at = 0
    while at + 4 <= len(header):
        (size,) = _U32.unpack_from(header, at)
        name, equals, value = header[at + 4 : at + 4 + size].partition(b"=")
        if not equals or at + 4 + size > len(header):
            return {}
        out[name] = value
        at += 4 + size
    return out if at == len(header) else {}


def locate_bag(data: bytes, index_offsets: IntArray) -> Located:
    """Find every message of a chunk; the offsets may be empty or wrong (then the chunk is walked).

    Args:
        data: the chunk's records.
        index_offsets: (m,) record offsets from its index data, any order.
    """
    offsets = ascending(index_offsets)
    columns = _by_index(data, offsets) if offsets.shape[0] else None
    connections: list[tuple[bytes, bytes]] = []
    rest = 0
    if columns is None or not follow_each_other(offsets, columns[:, 0] + columns[:, 1], len(data)):
        columns, connections, rest = _walked(data)
    start, length, connection, log_ns = (np.ascontiguousarray(columns[:, number]) for number in range(4))
    return Located(start, length, connection, log_ns, connections, rest)


def _walked(data: bytes) -> tuple[IntArray, list[tuple[bytes, bytes]], int]:
    """What a chunk holds, record by record: messages as of `_by_index`, connections, and bytes that are neither."""
    rows: list[tuple[int, int, int, int]] = []
    connections: list[tuple[bytes, bytes]] = []
    rest = len(data)
    for at, body, after in _records(data):
        header = data[at + 4 : body - 4]
        fields = fields_of(header)
        op, conn, stamp = (fields.get(name, b"") for name in (b"op", b"conn", b"time"))
        if op == b"\x07":
            connections.append((header, data[body:after]))
        elif op == b"\x02" and len(conn) == 4 and len(stamp) == 8:
            seconds, nanoseconds = struct.unpack("<II", stamp)
            rows.append((body, after - body, _U32.unpack(conn)[0], seconds * NS_PER_S + nanoseconds))
        else:
            continue
        rest -= after - at
    return np.array(rows, dtype=np.int64).reshape(-1, 4), connections, rest


def _records(data: bytes) -> Iterator[tuple[int, int, int]]:
    """(offset of the record, of its body, and after it) of records one after the other, up to one that is cut."""
    start = 0
    while start + 8 <= len(data):
        body = start + 8 + _U32.unpack_from(data, start)[0]
        after = body + _U32.unpack_from(data, body - 4)[0] if body <= len(data) else body
        if after > len(data):
            return
        yield start, body, after
        start = after


def _by_index(data: bytes, offsets: IntArray) -> IntArray | None:
    """(n, 4) start, length, connection, time of the messages at offsets; None unless all have headers like the first.

    They agree in all bytes but the connection and the time.
    """
    first = int(offsets[0])
    header = data[first + 4 : first + 4 + int.from_bytes(data[first : first + 4], "little")]
    fields = fields_of(header)
    conn, time = (header.find(mark) + len(mark) for mark in (b"\t\0\0\0conn=", b"\r\0\0\0time="))
    named = fields.get(b"conn") == header[conn : conn + 4] and fields.get(b"time") == header[time : time + 8]
    width = len(header) + 8
    if not named or fields.get(b"op") != b"\x02" or first < 0 or offsets[-1] + width > len(data):
        return None
    rows = gather(np.frombuffer(data, dtype=np.uint8), offsets, width)
    conn, time = conn + 4, time + 4
    fixed = np.ones(width - 4, dtype=np.bool_)
    fixed[conn : conn + 4] = fixed[time : time + 8] = False
    if ((rows[:, : width - 4] != rows[0, : width - 4]) & fixed).any():
        return None
    log_ns = _u32(rows, time) * NS_PER_S + _u32(rows, time + 4)
    return np.stack([offsets + width, _u32(rows, width - 4), _u32(rows, conn), log_ns], axis=1)


def _u32(rows: ByteArray, at: int) -> IntArray:
    out: IntArray = np.ascontiguousarray(rows[:, at : at + 4]).view("<u4")[:, 0].astype(np.int64)
    return out


class BagFile(ChunkedFile):
    """A ROS 1 bag (see :class:`collaudit.core.logs.storage.records.MessageReader`)."""

    format = "ros1-bag"

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        self._check_version()
        self.connections: dict[int, Channel] = {}
        self._indexed = False
        pos: int | None = len(MAGIC)
        while pos is not None and pos < self.file.size:
            pos = self._record(pos)
        if not self._indexed or not self.connections:
            for chunk in ordered_map(self.load, list(self.chunks)):
                for header, body in chunk.located.others:
                    self._connection(fields_of(header), body)
        self.channels = tuple(channel for _, channel in sorted(self.connections.items()))

    def _check_version(self) -> None:
        head = self.file.read(0, 24)
        if head.startswith(MAGIC):
            return
        where = str(self.file.path)
        self.close()
        raise LogError(
            "is a ROS 1 bag of a version that is not read",
            where=where,
            found=head.split(b"\n")[0].decode("ascii", errors="replace"),
            expected=MAGIC.decode("ascii").strip(),
            hint="write it again as version 2.0 with the tools of ROS 1: `rosbag fix OLD.bag NEW.bag`",
        )

    def _record(self, pos: int) -> int | None:
        """Take note of the record at ``pos``; where the next one begins, or None when the walk must end."""
        window = self.file.read(pos, _WINDOW)
        if len(window) < 4:
            self.damage.note(f"it ends at byte {self.file.size}, inside a record")
            return None
        header_size = int.from_bytes(window[:4], "little")
        if header_size > _MAX_HEADER or pos + 8 + header_size > self.file.size:
            self.damage.note(f"the record at byte {pos} is malformed or cut short")
            return None
        if len(window) < 8 + header_size:
            window = self.file.read(pos, 8 + header_size)
        fields = fields_of(window[4 : 4 + header_size])
        op = fields.get(b"op", b"")
        if len(op) != 1:
            self.damage.note(f"the record at byte {pos} is malformed")
            return None
        data_at = pos + 8 + header_size
        end = data_at + int.from_bytes(window[4 + header_size : 8 + header_size], "little")
        whole = end <= self.file.size
        if whole or op[0] == CHUNK:
            self._take(pos, op[0], fields, data_at, min(end, self.file.size) - data_at)
        if not whole:
            self.damage.note(f"it ends at byte {self.file.size}, inside the record at byte {pos}")
        return end if whole else None

    def _take(self, pos: int, op: int, fields: dict[bytes, bytes], data_at: int, data_size: int) -> None:
        try:
            if op == CHUNK:
                size, compression = _U32.unpack(fields[b"size"])[0], fields[b"compression"].decode("ascii")
                self.chunks.append(ChunkRef(pos, data_at, data_size, size, compression))
            elif op == INDEX and self.chunks and fields.get(b"ver") == b"\x01\x00\x00\x00":
                entry = (_U32.unpack(fields.get(b"conn", bytes(4)))[0], data_at, data_size // 12 * 12)
                self.chunks[-1] = replace(self.chunks[-1], index=(*self.chunks[-1].index, entry))
            elif op == CONNECTION:
                self._connection(fields, self.file.read(data_at, min(data_size, _MAX_HEADER * 2)))
            elif op == BAG_HEADER:
                self._header(fields)
            elif op == MSG:
                self.damage.note(f"the message at byte {pos} lies outside a chunk and was left out")
            elif op == CHUNK_INFO:
                for connection, count in struct.iter_unpack("<II", self.file.read(data_at, data_size // 8 * 8)):
                    self.counts[connection] = self.counts.get(connection, 0) + count
        except (struct.error, KeyError, UnicodeDecodeError):
            self.damage.note(f"the record at byte {pos} is malformed")

    def _header(self, fields: dict[bytes, bytes]) -> None:
        if fields.get(b"encryptor"):
            where = str(self.file.path)
            self.close()
            raise LogError("is encrypted and cannot be read", where=where)
        (index,) = struct.unpack("<Q", fields[b"index_pos"])
        self._indexed = 0 < index <= self.file.size
        if index == 0:
            self.damage.note("it has no index: it was not closed, or is still being written")
        elif not self._indexed:  # cut between two records, where no record is cut
            self.damage.note(f"it ends at byte {self.file.size}, before its index at byte {index}")

    def _connection(self, fields: dict[bytes, bytes], data: bytes) -> None:
        try:
            (key,) = _U32.unpack(fields[b"conn"])
            inner = fields_of(data)
            topic = (fields.get(b"topic") or inner[b"topic"]).decode("utf-8")
            kind = ros_type(inner[b"type"].decode("utf-8"))
        except (struct.error, KeyError, UnicodeDecodeError):
            self.damage.note("a connection record is malformed")
            return
        schema = inner.get(b"message_definition", b"")
        self.connections.setdefault(key, Channel(key, topic, kind, "ros1", "ros1msg", schema))

    def load(self, ref: ChunkRef) -> Chunk:
        """Read and decompress a chunk, and find its messages; runs in a thread."""
        raw = self.file.read(ref.data_at, ref.data_size)
        data, problem = unpack(ref.compression, raw, ref.size, self.bounds.chunk_bytes)
        parts = [self.file.read(at, size) for _, at, size in ref.index]
        whole = b"".join(part[: len(part) // 12 * 12] for part in parts)
        offsets = np.frombuffer(whole, dtype="<u4").reshape(-1, 3)[:, 2].astype(np.int64)
        return Chunk(ref, data, locate_bag(data, offsets), problem)


#: How the table of formats opens a file.
open_bag: Callable[[Path], MessageReader] = BagFile
