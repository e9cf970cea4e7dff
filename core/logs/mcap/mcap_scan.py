"""The records of an MCAP file as they lie in it, found by walking over it once; nothing it claims is trusted.

Record layout: https://mcap.dev/spec. The data section is walked rather than the summary, so that files
without a summary, with a wrong one or cut short are read the same way.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np

from collaudit.core.logs.mcap.mcap_run import MESSAGE, message_run
from collaudit.core.logs.messages.growing_columns import Growing
from collaudit.core.logs.storage.file_reading import RandomFile
from collaudit.core.logs.storage.noted_file import MAX_DAMAGE
from collaudit.core.logs.storage.records import MAX_SCHEMA_BYTES, Channel, Damage, ros_type
from collaudit.core.numeric.arrays import IntArray

MAGIC = b"\x89MCAP0\r\n"
HEADER, FOOTER, SCHEMA, CHANNEL, CHUNK, MESSAGE_INDEX = 1, 2, 3, 4, 6, 7
CHUNK_INDEX, STATISTICS, DATA_END = 8, 11, 15
HEAD = struct.Struct("<BQ")
MESSAGE_HEAD = 31
_WINDOW = 1 << 13
_WIDE_WINDOW = 1 << 20
_MAX_SMALL = 2 * MAX_SCHEMA_BYTES


@dataclass(frozen=True, slots=True)
class ChunkRef:
    """One chunk: where its compressed records lie, what they claim, and where its message indexes lie.

    Attributes:
        at: byte of the chunk record.
        data_at, data_size: its compressed records.
        size: claimed size when decompressed.
        crc: claimed CRC-32 of the decompressed records; 0 when there is none.
        compression: "", ``zstd`` or ``lz4``.
        index: (channel, byte, size) of each message index array.
        complete: False when the file ends inside it.
        extent: bytes of the chunk and its message indexes as the file's summary states them; 0 where it was walked.
    """

    at: int
    data_at: int
    data_size: int
    size: int
    crc: int
    compression: str
    index: tuple[tuple[int, int, int], ...] = ()
    complete: bool = True
    extent: int = 0


class Loose:
    """Messages outside chunks: offset of the record and length of its body, (n,) each, in the order of the file."""

    def __init__(self) -> None:
        self._at, self._size = Growing(0), Growing(0)

    def add(self, at: IntArray, size: IntArray) -> None:
        """Take in some messages, in the order of the file."""
        for column, values in ((self._at, at), (self._size, size)):
            column.add(values, 0.0)

    @property
    def at(self) -> IntArray:
        """Offsets of the records."""
        return np.asarray(self._at.so_far(), dtype=np.int64)

    @property
    def size(self) -> IntArray:
        """Lengths of their bodies."""
        return np.asarray(self._size.so_far(), dtype=np.int64)


@dataclass(slots=True)
class McapIndex:
    """What a walk over the file found."""

    schemas: dict[int, tuple[str, str, bytes]] = field(default_factory=dict)
    channels: dict[int, tuple[int, str, str]] = field(default_factory=dict)
    chunks: list[ChunkRef] = field(default_factory=list)
    loose: Loose = field(default_factory=Loose)
    counts: dict[int, int] = field(default_factory=dict)
    damage: list[Damage] = field(default_factory=list)
    profile: str = ""
    span_ns: tuple[int, int] | None = None
    chunk_spans_ns: list[tuple[int, int]] = field(default_factory=list)

    def record(self, op: int, body: bytes) -> None:
        """Take note of a schema, channel, header or statistics record; a malformed one is damage."""
        try:
            if op == SCHEMA:
                self._schema(body)
            elif op == CHANNEL:
                self._channel(body)
            elif op == HEADER:
                self.profile = _text(body, 0)[0]
            elif op == STATISTICS:
                self._statistics(body)
        except (struct.error, UnicodeDecodeError, IndexError):
            self.damage.append(Damage(f"a record of kind {op} is malformed"))

    def _schema(self, body: bytes) -> None:
        (number,) = struct.unpack_from("<H", body)
        name, at = _text(body, 2)
        encoding, at = _text(body, at)
        (size,) = struct.unpack_from("<I", body, at)
        data = body[at + 4 : at + 4 + size]
        if len(data) < size:
            raise IndexError
        self.schemas.setdefault(number, (name, encoding, data))

    def _channel(self, body: bytes) -> None:
        number, schema = struct.unpack_from("<HH", body)
        topic, at = _text(body, 4)
        encoding, _ = _text(body, at)
        self.channels.setdefault(number, (schema, topic, encoding))

    def _statistics(self, body: bytes) -> None:
        first, last, size = struct.unpack_from("<QQI", body, 26)
        self.span_ns = (first, last)
        for at in range(46, min(46 + size, len(body) - 9), 10):
            number, count = struct.unpack_from("<HQ", body, at)
            self.counts[number] = count

    def lacks_schemas(self) -> bool:
        """Whether channels refer to schemas that were not met yet: they may stand only inside chunks."""
        return any(schema and schema not in self.schemas for schema, _, _ in self.channels.values())

    def channel(self, number: int) -> Channel | None:
        """A channel as readers hand it on; one without a schema keeps an empty type."""
        if number not in self.channels:
            return None
        schema, topic, encoding = self.channels[number]
        name, schema_encoding, data = self.schemas.get(schema, ("", "", b""))
        return Channel(number, topic, ros_type(name), encoding, schema_encoding, data)


def _text(body: bytes, at: int) -> tuple[str, int]:
    (size,) = struct.unpack_from("<I", body, at)
    stop = at + 4 + size
    if stop > len(body):
        raise IndexError
    return body[at + 4 : stop].decode("utf-8"), stop


def chunk_records(data: bytes, start: int = 0, stop: int | None = None) -> Iterator[tuple[int, int, int]]:
    """(op, offset of the record, length of its body) of the records that lie wholly between two offsets."""
    end = len(data) if stop is None else stop
    unpack = HEAD.unpack_from
    while start + 9 <= end:
        op, length = unpack(data, start)
        if start + 9 + length > end:
            return
        yield op, start, length
        start += 9 + length


def scan(file: RandomFile) -> McapIndex:
    """Walk over the top-level records of a file.

    Args:
        file: an MCAP file, its magic already seen.

    Returns:
        Channels, chunks and loose messages up to the end or to the first damage.
    """
    return Scan(file).run()


class Scan:
    """A walk over top-level records; ``known`` chunks, by their byte, are noted as they are stated and jumped over."""

    def __init__(self, file: RandomFile, known: Mapping[int, ChunkRef] | None = None) -> None:
        self.file = file
        self.known = known or {}
        self.index = McapIndex()
        self.window = b""
        self.base = 0
        self.width = _WINDOW
        self.finished = False

    def run(self) -> McapIndex:
        """What it finds up to the end or to the first damage."""
        pos = len(MAGIC)
        while not self.finished and pos < self.file.size:
            nxt = self.step(pos)
            if nxt is None:
                break
            pos = nxt
        if not self.finished and not self.index.damage:
            self.index.damage.append(
                Damage(f"it ends at byte {self.file.size} without a footer: it was cut short or is still being written")
            )
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
        if pos in self.known:
            self.index.chunks.append(self.known[pos])
            return pos + self.known[pos].extent
        head = self.view(pos, 9)
        if len(head) < 9:
            self._stop(f"it ends at byte {self.file.size}, inside a record")
            return None
        op, length = int(head[0]), int.from_bytes(head[1:9], "little")
        if op == 0:
            self._stop(f"there is no record at byte {pos}")
            return None
        end = pos + 9 + length
        if op == CHUNK:
            return self.chunk(pos, length)
        if end > self.file.size:
            self._stop(f"it ends at byte {self.file.size}, inside a record that should reach byte {end}")
            return None
        if op == MESSAGE:
            return self.messages(pos)
        if op == MESSAGE_INDEX:
            self._message_index(pos, length)
        elif op == FOOTER:
            self._footer(end)
        elif op in (SCHEMA, CHANNEL, HEADER, STATISTICS):
            if length <= _MAX_SMALL:
                self.index.record(op, self.view(pos + 9, length))
            else:
                self.index.damage.append(Damage(f"a record of kind {op} at byte {pos} is {length} bytes long"))
        return end

    def _stop(self, text: str) -> None:
        if len(self.index.damage) < MAX_DAMAGE:
            self.index.damage.append(Damage(text))

    def _footer(self, end: int) -> None:
        self.finished = True
        if self.file.read(end, 8) != MAGIC:
            self.index.damage.append(Damage("its closing magic is missing", lost=False))

    def chunk(self, pos: int, length: int) -> int | None:
        """Note a chunk; one that the file ends in is noted with the bytes that are there."""
        head = self.view(pos + 9, min(length, 64))
        try:
            size, crc, name = struct.unpack_from("<QII", head, 16)
            compression = head[32 : 32 + name].decode("ascii")
            (records,) = struct.unpack_from("<Q", head, 32 + name)
        except (struct.error, UnicodeDecodeError):
            self._stop(f"the chunk at byte {pos} has a malformed head")
            return None
        data_at = pos + 9 + 40 + name
        end = pos + 9 + length
        complete = end <= self.file.size and data_at + records <= end
        have = records if complete else max(0, min(records, self.file.size - data_at))
        self.index.chunks.append(ChunkRef(pos, data_at, have, size, crc, compression, complete=complete))
        if not complete:
            self._stop(f"it ends at byte {self.file.size}, inside the chunk at byte {pos}")
            return None
        return end

    def _message_index(self, pos: int, length: int) -> None:
        head = self.view(pos + 9, 6)
        if len(head) < 6 or length < 6 or not self.index.chunks:
            return
        number, size = struct.unpack("<HI", head)
        last = self.index.chunks[-1]
        entry = (number, pos + 15, min(size, length - 6) // 16 * 16)
        self.index.chunks[-1] = ChunkRef(
            last.at, last.data_at, last.data_size, last.size, last.crc, last.compression, (*last.index, entry)
        )

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
            self._stop(f"the message at byte {base + at} is only {length} bytes long")
        self.index.loose.add(base + starts[whole], lengths[whole])
        return max(base + after, pos + 9)
