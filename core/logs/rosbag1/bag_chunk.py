"""Where the messages of one decompressed ROS 1 chunk lie: by its index data, proven against the bytes."""

from __future__ import annotations

import struct
from dataclasses import dataclass

import numpy as np

from collaudit.core.logs.storage.message_places import Located, ascending, gaps_between, gather
from collaudit.core.logs.storage.records import NS_PER_S, ByteArray
from collaudit.core.numeric.arrays import IntArray

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


def locate_bag(data: bytes, index_offsets: IntArray) -> Located:
    """Find every message of a chunk; the offsets may be empty or wrong (then the chunk is walked).

    Args:
        data: the chunk's records.
        index_offsets: (m,) record offsets from its index data, any order.
    """
    offsets = ascending(index_offsets)
    columns = _by_index(data, offsets) if offsets.shape[0] else None
    gaps = None if columns is None else gaps_between(offsets, columns[:, 0] + columns[:, 1], len(data))
    found = _Found([], [])
    if columns is None or gaps is None:
        columns, gaps = np.empty((0, 4), dtype=np.int64), [(0, len(data))]
    for gap in gaps:
        found.walk(data, *gap)
    if found.rows:
        columns = np.concatenate([columns, np.array(found.rows, dtype=np.int64)])
        columns = columns[np.argsort(columns[:, 0], kind="stable")]
    start, length, connection, log_ns = (np.ascontiguousarray(columns[:, number]) for number in range(4))
    return Located(start, length, connection, log_ns, found.connections, found.rest)


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
