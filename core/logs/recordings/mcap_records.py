"""The records of an MCAP file: as the mcap package reads them, and found by walking over the file once.

Record layout: https://mcap.dev/spec. The data section is walked rather than the summary, so that files without a
summary, with a wrong one or cut short are read the same way; nothing that it claims is trusted.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from io import BytesIO
from typing import Any

import numpy as np
from mcap import records
from mcap.data_stream import ReadDataStream

from collaudit.core.logs.storage.chunked_file import ChunkRef, RandomFile
from collaudit.core.logs.storage.records import MAX_SCHEMA_BYTES, Channel, DamageNotes, ros_type
from collaudit.core.numeric.arrays import IntArray

MAGIC = b"\x89MCAP0\r\n"
FOOTER, SCHEMA, CHANNEL, MESSAGE, CHUNK, MESSAGE_INDEX, CHUNK_INDEX, STATISTICS = 2, 3, 4, 5, 6, 7, 8, 11
#: Bytes of a message's record before its payload.
MESSAGE_HEAD = 31
#: A schema, channel or other small record is not read beyond this.
MAX_SMALL = 2 * MAX_SCHEMA_BYTES
_MAX_SUMMARY = 256 << 20
#: Footer and closing magic.
_TAIL = 9 + 20 + 8
_HEAD = struct.Struct("<BQ")
_KINDS: dict[int, Any] = {
    FOOTER: records.Footer, SCHEMA: records.Schema, CHANNEL: records.Channel, CHUNK_INDEX: records.ChunkIndex,
    STATISTICS: records.Statistics,
}  # fmt: skip


class _Body(BytesIO):
    """The bytes of one record; to read beyond them is an error."""

    def read(self, size: int | None = -1) -> bytes:
        data = super().read(size)
        if size is not None and len(data) < size:
            raise EOFError
        return data


def parsed(op: int, body: bytes) -> Any:
    """A record of the mcap package; None where its body is malformed."""
    try:
        return _KINDS[op].read(ReadDataStream(_Body(body)))
    except (struct.error, UnicodeDecodeError, EOFError):
        return None


def record_places(data: bytes) -> Iterator[tuple[int, int, int]]:
    """(op, offset of the record, length of its body) of records that follow each other, up to one that is cut short."""
    start, end = 0, len(data)
    unpack = _HEAD.unpack_from
    while start + 9 <= end:
        op, length = unpack(data, start)
        if start + 9 + length > end:
            return
        yield op, start, length
        start += 9 + length


def summary_of(file: RandomFile) -> bytes:
    """The summary section of a file; empty without."""
    tail = file.read(max(file.size - _TAIL, 0), _TAIL)
    if len(tail) < _TAIL or tail[-8:] != MAGIC or tail[0] != FOOTER:
        return b""
    start = parsed(FOOTER, tail[9:-8]).summary_start
    size = file.size - _TAIL - start
    return file.read(start, size) if start >= len(MAGIC) and 0 < size <= _MAX_SUMMARY else b""


@dataclass(slots=True)
class McapIndex:
    """What is known of a file.

    Attributes:
        schemas, channels: by number, as the mcap package has them.
        chunks: in the order of the file or of its summary.
        counts: channel to messages.
        damage: what was wrong.
        stamps_ns: first and last time of recording, of the file and of its chunks, as its summary states them.
    """

    schemas: dict[int, Any] = field(default_factory=dict)
    channels: dict[int, Any] = field(default_factory=dict)
    chunks: list[ChunkRef] = field(default_factory=list)
    counts: dict[int, int] = field(default_factory=dict)
    damage: DamageNotes = field(default_factory=DamageNotes)
    stamps_ns: list[int] = field(default_factory=list)

    def record(self, op: int, body: bytes) -> None:
        """Take note of a schema, channel or statistics record; a malformed one is damage."""
        found = parsed(op, body)
        if found is None:
            self.damage.note(f"a record of kind {op} is malformed")
        elif op == STATISTICS:
            self.stamps_ns += [found.message_start_time, found.message_end_time]
            self.counts |= found.channel_message_counts
        else:
            (self.schemas if op == SCHEMA else self.channels).setdefault(found.id, found)

    def lacks_schemas(self) -> bool:
        """Whether channels refer to schemas that were not met yet: they may stand only inside chunks."""
        return any(one.schema_id and one.schema_id not in self.schemas for one in self.channels.values())

    def reader_channels(self) -> tuple[Channel, ...]:
        """The channels as readers hand them on; one without a schema keeps an empty type."""
        out = []
        for number, one in sorted(self.channels.items()):
            schema = self.schemas.get(one.schema_id) or records.Schema(0, b"", "", "")
            kind = ros_type(schema.name)
            claimed = self.counts.get(number, 0)
            out.append(Channel(number, one.topic, kind, one.message_encoding, schema.encoding, schema.data, claimed))
        return tuple(out)


def read_summary(file: RandomFile) -> McapIndex | None:
    """Channels, chunks and statistics as the summary states them, or None when there is no usable one.

    What it says of a chunk is compared with the chunk when it is read, its counts with the messages that are found.

    Args:
        file: an MCAP file, its magic already seen.
    """
    data = summary_of(file)
    index = McapIndex()
    for op, at, length in record_places(data):
        body = data[at + 9 : at + 9 + length]
        if op in (SCHEMA, CHANNEL, STATISTICS):
            index.record(op, body)
        elif op == CHUNK_INDEX:
            stated = parsed(op, body)
            chunk = None if stated is None else _chunk(stated, file.size)
            if chunk is None:
                return None
            index.chunks.append(chunk)
            if chunk.index:  # a chunk without messages states zeros
                index.stamps_ns += [stated.message_start_time, stated.message_end_time]
    return index if index.channels and index.counts and not index.damage else None


def _chunk(stated: Any, file_size: int) -> ChunkRef | None:
    """A chunk by its index record; the arrays of its message indexes are not located, only their channels."""
    at, size = stated.chunk_start_offset, stated.compressed_size
    data_at = at + 9 + 40 + len(stated.compression)
    if data_at + size > file_size or not stated.compression.isascii():
        return None
    end = at + stated.chunk_length
    whole = data_at + size == end and end + stated.message_index_length <= file_size
    extent = stated.chunk_length + stated.message_index_length if whole else 0
    held = tuple((number, 0, 0) for number in stated.message_index_offsets)
    return ChunkRef(at, data_at, size, stated.uncompressed_size, stated.compression, held, extent=extent)


_WINDOW = 1 << 13
#: Bytes of a chunk's record before its data, and more.
_CHUNK_HEAD = 128
_WIDE_WINDOW = 1 << 20
#: Bytes from the start of a message record up to the end of its log time.
LEAST_HEAD = 23
_LENGTH = struct.Struct("<Q").unpack_from


def scan(file: RandomFile) -> McapIndex:
    """Walk over the top-level records of a file.

    Args:
        file: an MCAP file, its magic already seen.

    Returns:
        Channels, chunks and loose messages up to the end or to the first damage.
    """
    return Scan(file).run()


def chunk_at(file: RandomFile, pos: int) -> ChunkRef | None:
    """The chunk that begins at a byte, as its own head states it; None where none does, or the file ends inside it."""
    walk = Scan(file)
    walk.width = _CHUNK_HEAD
    return walk.index.chunks[0] if walk.step(pos) is not None and walk.index.chunks else None


class Scan:
    """A walk over top-level records."""

    def __init__(self, file: RandomFile) -> None:
        self.file = file
        self.index = McapIndex()
        self.window = b""
        self.base = 0
        self.width = _WINDOW
        self.finished = False
        self.runs: list[IntArray] = []
        self.end = 0

    def run(self) -> McapIndex:
        """What it finds up to the end or to the first damage."""
        pos = len(MAGIC)
        while not self.finished and pos < self.file.size:
            nxt = self.step(pos)
            if nxt is None:
                break
            pos = nxt
        self._end_run()
        if not self.finished and not self.index.damage:
            cut = "it was cut short or is still being written"
            self.index.damage.note(f"it ends at byte {self.file.size} without a footer: {cut}")
        return self.index

    def view(self, pos: int, size: int) -> bytes:
        """``size`` bytes at ``pos``, through a window that is read ahead."""
        start = pos - self.base
        if start < 0 or start + size > len(self.window):
            self.window = self.file.read(pos, max(self.width, size))
            self.base = pos
            start = 0
        return self.window[start : start + size]

    def step(self, pos: int) -> int | None:
        """Take note of the record at ``pos``; where the next one begins, None at the end or at damage."""
        head = self.view(pos, 9)
        if len(head) < 9:
            self.index.damage.note(f"it ends at byte {self.file.size}, inside a record")
            return None
        op, length = int(head[0]), int.from_bytes(head[1:9], "little")
        if op == 0:
            self.index.damage.note(f"there is no record at byte {pos}")
            return None
        end = pos + 9 + length
        if op == CHUNK:
            return self.chunk(pos, length)
        if end > self.file.size:
            self.index.damage.note(f"it ends at byte {self.file.size}, inside a record that should reach byte {end}")
            return None
        if op == MESSAGE:
            return self.messages(pos)
        if op == MESSAGE_INDEX:
            self._message_index(pos, length)
        elif op == FOOTER:
            self._footer(end)
        elif op in (SCHEMA, CHANNEL, STATISTICS):
            if length <= MAX_SMALL:
                self.index.record(op, self.view(pos + 9, length))
            else:
                self.index.damage.note(f"a record of kind {op} at byte {pos} is {length} bytes long")
        return end

    def _footer(self, end: int) -> None:
        self.finished = True
        if self.file.read(end, 8) != MAGIC:
            self.index.damage.note("its closing magic is missing", lost=False)

    def chunk(self, pos: int, length: int) -> int | None:
        """Note a chunk; one that the file ends in is noted with the bytes that are there."""
        self._end_run()
        head = self.view(pos + 9, min(length, 64))
        try:
            size, crc, name = struct.unpack_from("<QII", head, 16)
            compression = head[32 : 32 + name].decode("ascii")
            (records,) = struct.unpack_from("<Q", head, 32 + name)
        except (struct.error, UnicodeDecodeError):
            self.index.damage.note(f"the chunk at byte {pos} has a malformed head")
            return None
        data_at = pos + 9 + 40 + name
        end = pos + 9 + length
        complete = end <= self.file.size and data_at + records <= end
        have = records if complete else max(0, min(records, self.file.size - data_at))
        self.index.chunks.append(ChunkRef(pos, data_at, have, size, compression, crc=crc))
        if not complete:
            self.index.damage.note(f"it ends at byte {self.file.size}, inside the chunk at byte {pos}")
            return None
        return end

    def _message_index(self, pos: int, length: int) -> None:
        head = self.view(pos + 9, 6)
        if len(head) < 6 or length < 6 or not self.index.chunks or self.index.chunks[-1].loose is not None:
            return
        number, size = struct.unpack("<HI", head)
        last = self.index.chunks[-1]
        entry = (number, pos + 15, min(size, length - 6) // 16 * 16)
        self.index.chunks[-1] = replace(last, index=(*last.index, entry))

    def messages(self, pos: int) -> int:
        """Note the messages that follow each other from ``pos``, as far as the window reaches."""
        self.width = _WIDE_WINDOW
        self.view(pos, MESSAGE_HEAD)
        base = self.base
        starts, after = message_run(self.window, pos - base)
        if starts.shape[0] and base + after > self.file.size:  # it is refused as any other record would be
            after = int(starts[-1])
            starts = starts[:-1]
        lengths = np.append(starts[1:], after)[: starts.shape[0]] - starts - 9
        whole = lengths >= 22
        for at, length in zip(starts[~whole].tolist(), lengths[~whole].tolist(), strict=True):
            self.index.damage.note(f"the message at byte {base + at} is only {length} bytes long")
        if whole.any():
            if self.runs and base + after - int(self.runs[0][0]) > _WIDE_WINDOW:
                self._end_run()
            self.runs.append(base + starts[whole])
            self.end = base + after
        return max(base + after, pos + 9)

    def _end_run(self) -> None:
        """Note the messages since the last chunk as one, whatever small records lie between them."""
        if self.runs:
            at = np.concatenate(self.runs)
            start, size = int(at[0]), self.end - int(at[0])
            self.index.chunks.append(ChunkRef(start, start, size, size, "", loose=at - start))
            self.runs = []


def message_run(window: bytes, at: int) -> tuple[IntArray, int]:
    """The messages that follow each other from one place.

    Args:
        window: a part of the file.
        at: where a record begins in it.

    Returns:
        (n,) offsets of the message records up to the first other record, or to one of which fewer than
        ``LEAST_HEAD`` bytes lie in the window; and the offset after the last, which may lie beyond the window.
    """
    out: list[int] = []
    last = len(window) - LEAST_HEAD
    while at <= last and window[at] == MESSAGE:
        out.append(at)
        at += 9 + _LENGTH(window, at + 1)[0]
    return np.array(out, dtype=np.int64), at
