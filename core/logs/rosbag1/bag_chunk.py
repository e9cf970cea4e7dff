"""Where the messages of one decompressed ROS 1 chunk lie: by its index data, proven against the bytes."""

from __future__ import annotations

import struct
from dataclasses import dataclass

import numpy as np

from collaudit.core.logs.storage.message_places import ascending, gather
from collaudit.core.logs.storage.records import NS_PER_S, ByteArray
from collaudit.core.numeric.arrays import IntArray

_U32 = struct.Struct("<I")
_MSG_DATA = 2


@dataclass(frozen=True, slots=True, eq=False)
class BagLocated:
    """Messages of a chunk in the order they lie in it.

    Attributes:
        start, length: (n,) payload offsets and sizes.
        connection: (n,) connection numbers.
        log_ns: (n,) recording times.
        connections: (header, data) of the connection records.
        rest: bytes that are no whole record.
    """

    start: IntArray
    length: IntArray
    connection: IntArray
    log_ns: IntArray
    connections: tuple[tuple[bytes, bytes], ...]
    rest: int


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


@dataclass(slots=True)
class _Found:
    rows: list[tuple[int, int, int, int]]
    connections: list[tuple[bytes, bytes]]
    rest: int = 0

    def walk(self, data: bytes, start: int, stop: int) -> None:
        """Read the records between two offsets one by one."""
        while start + 8 <= stop:
            (header_size,) = _U32.unpack_from(data, start)
            body = start + 8 + header_size
            if body > stop:
                break
            (size,) = _U32.unpack_from(data, body - 4)
            if body + size > stop:
                break
            header = data[start + 4 : body - 4]
            self._record(fields_of(header), header, data, body, size)
            start = body + size
        self.rest += stop - start

    def _record(self, fields: dict[bytes, bytes], header: bytes, data: bytes, at: int, size: int) -> None:
        op, conn, stamp = fields.get(b"op"), fields.get(b"conn", b""), fields.get(b"time", b"")
        if op == b"\x07":
            self.connections.append((header, data[at : at + size]))
        elif op == b"\x02" and len(conn) == 4 and len(stamp) == 8:
            seconds, rest = struct.unpack("<II", stamp)
            self.rows.append((at, size, _U32.unpack(conn)[0], seconds * NS_PER_S + rest))
        else:
            self.rest += len(header) + 8 + size


def _template(data: bytes, offset: int) -> tuple[int, ByteArray, ByteArray, int, int] | None:
    """The header of one message: size, bytes, mask of the bytes all share, places of ``conn`` and ``time``."""
    if offset < 0 or offset + 4 > len(data):
        return None
    (size,) = _U32.unpack_from(data, offset)
    header = data[offset + 4 : offset + 4 + size]
    fields = fields_of(header)
    if fields.get(b"op") != bytes([_MSG_DATA]) or len(fields.get(b"conn", b"")) != 4:
        return None
    if len(fields.get(b"time", b"")) != 8:
        return None
    conn, time = _place(header, b"conn", 4), _place(header, b"time", 8)
    mask = np.ones(size + 4, dtype=np.uint8)
    mask[conn : conn + 4] = 0
    mask[time : time + 8] = 0
    return size, np.frombuffer(data[offset : offset + 4 + size], np.uint8), mask, conn, time


def _place(header: bytes, name: bytes, size: int) -> int:
    """Offset of a field's value from the start of its record."""
    at = 0
    while at + 4 <= len(header):
        (length,) = _U32.unpack_from(header, at)
        if header[at + 4 : at + 5 + len(name)] == name + b"=" and length == len(name) + 1 + size:
            return 4 + at + 5 + len(name)
        at += 4 + length
    return 4


def locate_bag(data: bytes, index_offsets: IntArray) -> BagLocated:
    """Find every message of a chunk; the offsets may be empty or wrong (then the chunk is walked).

    Args:
        data: the chunk's records.
        index_offsets: (m,) record offsets from its index data, any order.
    """
    view = np.frombuffer(data, dtype=np.uint8)
    offsets = ascending(index_offsets)
    found = _Found([], [])
    fast = _by_index(data, view, offsets) if offsets.shape[0] else None
    if fast is None:
        found.walk(data, 0, len(data))
        columns = np.array(found.rows, dtype=np.int64).reshape(-1, 4)
    else:
        columns, starts, stops = fast
        for start, stop in zip(starts, stops, strict=True):
            found.walk(data, start, stop)
        if found.rows:
            columns = np.concatenate([columns, np.array(found.rows, dtype=np.int64)])
            columns = columns[np.argsort(columns[:, 0], kind="stable")]
    parts = [np.ascontiguousarray(columns[:, number]) for number in range(4)]
    return BagLocated(parts[0], parts[1], parts[2], parts[3], tuple(found.connections), found.rest)


def _by_index(data: bytes, view: ByteArray, offsets: IntArray) -> tuple[IntArray, list[int], list[int]] | None:
    """(n, 4) start, length, connection, time of the indexed messages and the gaps between; None when it is wrong."""
    template = _template(data, int(offsets[0]))
    if template is None:
        return None
    size, expected, mask, conn, time = template
    width = size + 8
    if offsets[-1] + width > len(data):
        return None
    rows = gather(view, offsets, width)
    if ((rows[:, : size + 4] != expected) & (mask != 0)).any():
        return None
    length = _u32(rows, size + 4)
    start = offsets + width
    ends = start + length
    if ends[-1] > len(data) or (ends[:-1] > offsets[1:]).any():
        return None
    log_ns = _u32(rows, time) * NS_PER_S + _u32(rows, time + 4)
    edges = np.concatenate([[0], ends])
    stops = np.concatenate([offsets, [len(data)]])
    gaps = np.flatnonzero(edges < stops)
    columns = np.stack([start, length, _u32(rows, conn), log_ns], axis=1)
    return columns, edges[gaps].tolist(), stops[gaps].tolist()


def _u32(rows: ByteArray, at: int) -> IntArray:
    out: IntArray = np.ascontiguousarray(rows[:, at : at + 4]).view("<u4")[:, 0].astype(np.int64)
    return out
