"""The records of an MCAP file as the mcap package reads them, and what they say of the file together."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass, field
from io import BytesIO
from typing import Any

from mcap import records
from mcap.data_stream import ReadDataStream

from collaudit.core.logs.storage.chunked_file import ChunkRef, RandomFile
from collaudit.core.logs.storage.records import MAX_SCHEMA_BYTES, Channel, DamageNotes, ros_type

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
