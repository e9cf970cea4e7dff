"""Reading ROS 1 bags (format 2.0) as batches of raw messages.

Record layout: https://wiki.ros.org/Bags/Format/2.0. The file is walked from its start rather than by its
index, and so are its chunks: unindexed and still-active bags are read the same way as closed ones.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from collaudit.core.errors import LogError
from collaudit.core.logs.storage.bounded_reading import ChunkedFile, ChunkRef, unpack
from collaudit.core.logs.storage.readers import (
    NS_PER_S,
    ByteArray,
    Channel,
    Located,
    gather,
    ros_type,
)
from collaudit.core.numeric.arrays import IntArray
from collaudit.core.numeric.parallel import ordered_map

MAGIC = b"#ROSBAG V2.0\n"
MSG, BAG_HEADER, CHUNK, CHUNK_INFO, CONNECTION = b"\x02", b"\x03", b"\x05", b"\x06", b"\x07"
_WINDOW = 1 << 12
_MAX_HEADER = 1 << 20
_U32 = struct.Struct("<I")
Fields = dict[bytes, bytes]


def fields_of(header: bytes) -> Fields:
    """Name to value of a record header; empty when it is malformed."""
    out: Fields = {}
    at = 0
    while at + 4 <= len(header):
        (size,) = _U32.unpack_from(header, at)
        name, equals, value = header[at + 4 : at + 4 + size].partition(b"=")
        if not equals or at + 4 + size > len(header):
            return {}
        out[name] = value
        at += 4 + size
    return out if at == len(header) else {}


def locate_bag(data: bytes, problem: str | None = None) -> Located:
    """Find every message of a chunk.

    Args:
        data: the chunk's records.
        problem: what is known to be wrong with it.
    """
    view = np.frombuffer(data, dtype=np.uint8)
    places = np.array(list(_records(data)), dtype=np.int64).reshape(-1, 3)
    alike, found = _like_the_first(view, places)
    rows, others, known = [found], [], int((places[alike, 2] - places[alike, 0]).sum())
    for at, body, after in places[~alike].tolist():
        fields = fields_of(data[at + 4 : body - 4])
        if fields.get(b"op") == CONNECTION:
            others.append((fields, data[body:after]))
        elif (said := _channel_and_time(fields)) is not None:
            rows.append(np.array([[body, after - body, *said]]))
        else:
            continue
        known += after - at
    if problem is None and known < len(data):
        problem = f"{len(data) - known} of its bytes are no record"
    messages = np.concatenate(rows)
    start, length, channel, log_ns = np.ascontiguousarray(messages[np.argsort(messages[:, 0])].T)
    return Located(view, start, length, channel, log_ns, others, problem)


def _records(data: bytes) -> Iterator[tuple[int, int, int]]:
    """(offset of the record, of its body, and after it) of records one after the other, up to one that is cut."""
    start, size = 0, len(data)
    unpack_from = _U32.unpack_from
    while start + 8 <= size:
        body = start + 8 + unpack_from(data, start)[0]
        after = body + unpack_from(data, body - 4)[0] if body <= size else body
        if after > size:
            return
        yield start, body, after
        start = after


def _channel_and_time(fields: Fields) -> tuple[int, int] | None:
    """Connection and time, ns, of a message's header; None of another record."""
    conn, stamp = fields.get(b"conn", b""), fields.get(b"time", b"")
    if fields.get(b"op") != MSG or len(conn) != 4 or len(stamp) != 8:
        return None
    seconds, nanoseconds = struct.unpack("<II", stamp)
    return _U32.unpack(conn)[0], seconds * NS_PER_S + nanoseconds


def _like_the_first(view: ByteArray, places: IntArray) -> tuple[np.ndarray[tuple[int], np.dtype[np.bool_]], IntArray]:
    """Which records have a header as the first message's but for connection and time; (m, 4) as of a chunk's rows.

    Args:
        view: the chunk's records.
        places: (n, 3) as of :func:`_records`.
    """
    width = places[:, 1] - places[:, 0]
    header, alike = b"", np.zeros(width.size, dtype=np.bool_)
    for at, body, _ in places[:100].tolist():  # connections come before the messages
        header = view[at : body - 4].tobytes()
        if _channel_and_time(fields_of(header[4:])) is not None:
            alike = width == body - at
            break
    rows = gather(view, places[alike, 0], len(header))
    conn, time = (header.find(mark) + len(mark) for mark in (b"\t\0\0\0conn=", b"\r\0\0\0time="))
    fixed = np.ones(len(header), dtype=np.bool_)
    fixed[conn : conn + 4] = fixed[time : time + 8] = False
    same = (rows[:, fixed] == np.frombuffer(header, np.uint8)[fixed]).all(axis=1)
    alike[alike] = same
    found, rows = places[alike], rows[same]
    connection, seconds, rest = (
        (np.ascontiguousarray(rows[:, at : at + 4]).view("<u4")[:, 0].astype(np.int64) for at in (conn, time, time + 4))
        if rows.size
        else np.empty((3, 0), dtype=np.int64)
    )
    return alike, np.stack([found[:, 1], found[:, 2] - found[:, 1], connection, seconds * NS_PER_S + rest], axis=1)


class BagFile(ChunkedFile):
    """A ROS 1 bag (see :class:`collaudit.core.logs.storage.readers.MessageReader`)."""

    format = "ros1-bag"

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        self.connections: dict[int, Channel] = {}
        self._indexed = False
        try:
            self._check_version()
            self._walk(len(MAGIC))
        except LogError:
            self.close()
            raise
        if not self._indexed or not self.connections:
            for located in ordered_map(self.load, list(self.chunks)):
                for fields, body in located.others:
                    self._connection(fields, body)
        self.channels = tuple(channel for _, channel in sorted(self.connections.items()))

    def _check_version(self) -> None:
        head = self.read(0, 24)
        if not head.startswith(MAGIC):
            raise LogError(
                "is a ROS 1 bag of a version that is not read",
                where=str(self.path),
                found=head.split(b"\n")[0].decode("ascii", errors="replace"),
                expected=MAGIC.decode("ascii").strip(),
                hint="write it again as version 2.0 with the tools of ROS 1: `rosbag fix OLD.bag NEW.bag`",
            )

    def _walk(self, pos: int) -> None:
        """Note the records from a byte on, up to the end or to damage."""
        while pos < self.size:
            window = self.read(pos, _WINDOW)
            size = _U32.unpack_from(window)[0] if len(window) >= 4 else _MAX_HEADER
            if 8 + size > len(window) and size < _MAX_HEADER:
                window = self.read(pos, 8 + size)
            if 8 + size > len(window):
                self.damage.note(f"the record at byte {pos} is malformed, or the file ends inside it")
                return
            at = pos + 8 + size
            end = at + _U32.unpack_from(window, 4 + size)[0]
            fields = fields_of(window[4 : 4 + size])
            try:
                self._take(pos, fields, at, min(end, self.size) - at)
            except (struct.error, KeyError, UnicodeDecodeError):
                self.damage.note(f"the record at byte {pos} is malformed")
                if b"op" not in fields:
                    return
            if end > self.size:
                self.damage.note(f"it ends at byte {self.size}, inside the record at byte {pos}")
            pos = end

    def _take(self, pos: int, fields: Fields, at: int, size: int) -> None:
        """Note a record whose body is, as far as it is there, so many bytes from ``at`` on."""
        op = fields[b"op"]
        if op == CHUNK:
            claimed, compression = _U32.unpack(fields[b"size"])[0], fields[b"compression"].decode("ascii")
            self.chunks.append(ChunkRef(pos, at, size, claimed, compression))
        elif op == CONNECTION:
            self._connection(fields, self.read(at, min(size, 2 * _MAX_HEADER)))
        elif op == BAG_HEADER:
            self._header(fields)
        elif op == MSG:
            self.damage.note(f"the message at byte {pos} lies outside a chunk and was left out")
        elif op == CHUNK_INFO:
            for connection, count in struct.iter_unpack("<II", self.read(at, size // 8 * 8)):
                self.counts[connection] = self.counts.get(connection, 0) + count

    def _header(self, fields: Fields) -> None:
        if fields.get(b"encryptor"):
            raise LogError("is encrypted and cannot be read", where=str(self.path))
        (index,) = struct.unpack("<Q", fields[b"index_pos"])
        self._indexed = 0 < index <= self.size
        if index == 0:
            self.damage.note("it has no index: it was not closed, or is still being written")
        elif not self._indexed:  # cut between two records, where no record is cut
            self.damage.note(f"it ends at byte {self.size}, before its index at byte {index}")

    def _connection(self, fields: Fields, body: bytes) -> None:
        """Note a channel; the first of a number holds."""
        try:
            (key,) = _U32.unpack(fields[b"conn"])
            inner = fields_of(body)
            topic = (fields.get(b"topic") or inner[b"topic"]).decode("utf-8")
            kind = ros_type(inner[b"type"].decode("utf-8"))
        except (struct.error, KeyError, UnicodeDecodeError):
            self.damage.note("a connection record is malformed")
            return
        schema = inner.get(b"message_definition", b"")
        self.connections.setdefault(key, Channel(key, topic, kind, "ros1", "ros1msg", schema))

    def load(self, ref: ChunkRef) -> Located:
        """Read and decompress a chunk, and find its messages; runs in a thread."""
        raw = self.read(ref.data_at, ref.data_size)
        return locate_bag(*unpack(ref.compression, raw, ref.size, self.bounds.chunk_bytes))
