"""Reading MCAP files as batches of raw messages: by the message index of each chunk, proven against the bytes.

Record layout: https://mcap.dev/spec; records are parsed by the mcap package. The data section is walked rather than the
summary, so that files without a summary, with a wrong one or cut short are read the same way; nothing that it claims is
trusted. Only what is in a huge file is told by its summary, without walking over it.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from mcap import records
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.reader import make_reader
from mcap.summary import Summary
from zlib_ng import zlib_ng

from collaudit.core.logs.signals.sample_clock import plausible_ns
from collaudit.core.logs.storage.bounded_reading import ChunkedFile, ChunkRef, unpack
from collaudit.core.logs.storage.readers import (
    MAX_SCHEMA_BYTES,
    ByteArray,
    Channel,
    Located,
    Overview,
    gather,
    ros_type,
)
from collaudit.core.numeric.arrays import IntArray
from collaudit.core.numeric.parallel import ordered_map

MAGIC = b"\x89MCAP0\r\n"
FOOTER, SCHEMA, CHANNEL, MESSAGE, CHUNK, MESSAGE_INDEX, STATISTICS = 2, 3, 4, 5, 6, 7, 11
_KINDS: dict[int, Any] = {SCHEMA: records.Schema, CHANNEL: records.Channel, STATISTICS: records.Statistics}
_MALFORMED = (McapError, struct.error, UnicodeDecodeError)
_HEAD = struct.Struct("<BQ")
_MESSAGE = np.dtype(
    [("op", "u1"), ("length", "<u8"), ("channel", "<u2"), ("seq", "<u4"), ("log", "<u8"), ("pub", "<u8")]
)
#: Bytes of a message's body before its payload.
_LEAST = 22
#: So many records of other kinds are passed over in a chunk, and so many schemas and channels taken.
_MOST_FOREIGN, _MOST_OTHERS = 10_000, 1 << 18
#: Bytes that are read to learn of a record, and of messages outside chunks at once.
_HEAD_BYTES, _WINDOW = 128, 1 << 20
#: A schema, channel or statistics record is not read beyond this.
_MAX_SMALL = 2 * MAX_SCHEMA_BYTES
#: Chunks that are read for an overview at most.
_FEW_CHUNKS = 16


def locate(data: bytes, index_offsets: IntArray, problem: str | None = None) -> Located:
    """Find every message of a chunk.

    The offsets of the message indexes are used when each is the start of a message and nothing lies between these;
    else the chunk is walked record by record, so that a message missing from the index is found all the same.

    Args:
        data: the chunk's records.
        index_offsets: (m,) offsets from its message indexes, any order; may be empty or wrong.
        problem: what is known to be wrong with it.
    """
    view = np.frombuffer(data, dtype=np.uint8)
    offsets = np.unique(index_offsets)
    heads = _heads_of_all(view, offsets)
    others: list[tuple[int, bytes]] = []
    if heads is None:
        offsets, others, rest = _walked(data)
        heads = gather(view, offsets, _MESSAGE.itemsize).view(_MESSAGE).ravel()
        problem = problem or (f"{rest} of its bytes are no record" if rest else None)
    lengths = heads["length"].astype(np.int64) - _LEAST
    channel, log_ns = (heads[name].astype(np.int64) for name in ("channel", "log"))
    return Located(view, offsets + _MESSAGE.itemsize, lengths, channel, log_ns, others, problem)


def _heads_of_all(view: ByteArray, offsets: IntArray) -> Any:
    """What the messages at such offsets begin with; None where one begins none, or the chunk holds anything else."""
    if not offsets.size or offsets[0] != 0 or offsets[-1] > view.size - _MESSAGE.itemsize:
        return None
    heads = gather(view, offsets, _MESSAGE.itemsize).view(_MESSAGE).ravel()
    lengths = heads["length"].astype(np.int64)
    together = np.array_equal(offsets + 9 + lengths, np.append(offsets[1:], view.size))
    return heads if together and bool((heads["op"] == MESSAGE).all()) and lengths.min() >= _LEAST else None


def _walked(data: bytes) -> tuple[IntArray, list[tuple[int, bytes]], int]:
    """What a chunk holds, record by record: offsets of messages, schemas and channels, and bytes that are no record."""
    found: list[int] = []
    others: list[tuple[int, bytes]] = []
    rest, foreign = len(data), 0
    end = 0
    while end + 9 <= len(data):
        at = end
        op, length = _HEAD.unpack_from(data, at)
        end = at + 9 + length
        if end > len(data):
            break
        if op == MESSAGE:
            if length < _LEAST:
                continue
            found.append(at)
        elif op not in (SCHEMA, CHANNEL):
            foreign += 1
            if op == 0 or foreign > _MOST_FOREIGN:  # no record begins so: the rest is none, however long
                break
        elif len(others) < _MOST_OTHERS:
            others.append((op, data[at + 9 : end]))
        rest -= end - at
    return np.array(found, dtype=np.int64), others, rest


class McapFile(ChunkedFile):
    """An MCAP file (see :class:`collaudit.core.logs.storage.readers.MessageReader`).

    Attributes:
        schemas, named: schemas and channels by number, as the mcap package has them.
    """

    counted = "its statistics count"

    def __init__(self, path: Path, summary: Summary | None = None, starts: Sequence[int] = ()) -> None:
        """With ``summary``, only the chunks that begin at ``starts`` are read."""
        super().__init__(path)
        self.schemas: dict[int, Any] = {} if summary is None else summary.schemas
        self.named: dict[int, Any] = {} if summary is None else summary.channels
        if summary is None:
            self._walk(len(MAGIC))
        for start in starts:
            self._walk(start, alone=True)
        self._look_into_chunks()
        self.channels = tuple(self._channel(number) for number in sorted(self.named))
        encodings = {channel.encoding for channel in self.channels}
        self.format = "mcap-ros1" if "ros1" in encodings else "mcap-ros2" if "cdr" in encodings else "mcap"

    def _walk(self, pos: int, *, alone: bool = False) -> None:
        """Note the records from a byte on, up to the end or to damage; ``alone``: one chunk and its message indexes."""
        chunk: ChunkRef | None = None
        while pos < self.size:
            head = self.read(pos, _HEAD_BYTES)
            if len(head) < 9:
                break
            op, length = _HEAD.unpack_from(head)
            end = pos + 9 + length
            if alone and op != (CHUNK if chunk is None else MESSAGE_INDEX):
                return
            if op == 0:
                self.damage.note(f"there is no record at byte {pos}")
                return
            if op == CHUNK:
                chunk = self._chunk(pos, min(end, self.size), head)
            if end > self.size:
                kind = "chunk" if op == CHUNK else "record"
                self.damage.note(f"it ends at byte {self.size}, inside the {kind} at byte {pos}")
                return
            if op == FOOTER:
                return
            if op == MESSAGE:
                chunk, end = None, self._outside_chunks(pos)
            elif op == MESSAGE_INDEX and chunk is not None and length >= 6:
                number, size = struct.unpack_from("<HI", head, 9)
                chunk.index.append((number, pos + 15, min(size, length - 6)))
            elif op in _KINDS:
                self._record(op, self.read(pos + 9, min(length, _MAX_SMALL)))
            pos = end
        self.damage.note(f"it ends at byte {self.size} without a footer: it was cut short or is still being written")

    def _chunk(self, pos: int, end: int, head: bytes) -> ChunkRef | None:
        """Note a chunk, of which the bytes up to ``end`` are there; None where its head is malformed."""
        try:
            size, crc, name = struct.unpack_from("<QII", head, 9 + 16)
            compression = head[41 : 41 + name].decode("ascii")
            (claimed,) = struct.unpack_from("<Q", head, 41 + name)
        except (struct.error, UnicodeDecodeError):
            self.damage.note(f"the chunk at byte {pos} has a malformed head")
            return None
        data_at = pos + 49 + name
        self.chunks.append(ChunkRef(pos, data_at, max(0, min(claimed, end - data_at)), size, compression, crc=crc))
        return self.chunks[-1]

    def _outside_chunks(self, pos: int) -> int:
        """Note the messages that follow each other from a byte on as a chunk, and where the next record begins.

        One that the file ends in is left to be refused as any other record is.
        """
        window = self.read(pos, _WINDOW)
        at = after = 0
        while pos + after <= self.size:
            at = after
            if at + 9 > len(window) or window[at] != MESSAGE:
                break
            after = at + 9 + _HEAD.unpack_from(window, at)[1]
        end = pos + at
        last = self.chunks[-1] if self.chunks else None
        if last is not None and last.at == last.data_at and end - last.at <= _WINDOW:  # small records lie between
            last.data_size = last.size = end - last.at
        else:
            self.chunks.append(ChunkRef(pos, pos, end - pos, end - pos, ""))
        return end

    def _record(self, op: int, body: bytes) -> None:
        """Take note of a schema, channel or statistics record; a malformed one is damage."""
        try:
            found = _KINDS[op].read(ReadDataStream(BytesIO(body)))
        except _MALFORMED:
            self.damage.note(f"a record of kind {op} is malformed")
            return
        if op == STATISTICS:
            self.counts |= found.channel_message_counts
        else:
            (self.schemas if op == SCHEMA else self.named).setdefault(found.id, found)

    def _look_into_chunks(self) -> None:
        """Learn of channels and schemas that stand only inside chunks."""
        blind = not self.named and any(not chunk.index for chunk in self.chunks)
        for located in ordered_map(self.load, list(self.chunks)) if blind or self.lacks_definitions() else ():
            for op, body in located.others:
                self._record(op, body)
            if not blind and not self.lacks_definitions():
                break

    def lacks_definitions(self) -> bool:
        """Whether a channel that the indexes name, or the schema of a channel, was not met yet."""
        indexed = {number for chunk in self.chunks for number, _, _ in chunk.index}
        schemas = {channel.schema_id for channel in self.named.values()} - {0}
        return bool(indexed - set(self.named) or schemas - set(self.schemas))

    def _channel(self, number: int) -> Channel:
        """A channel as readers hand it on; one without a schema keeps an empty type."""
        one = self.named[number]
        schema = self.schemas.get(one.schema_id) or records.Schema(0, b"", "", "")
        claimed = self.counts.get(number, 0)
        kind = ros_type(schema.name)
        return Channel(number, one.topic, kind, one.message_encoding, schema.encoding, schema.data, claimed)

    def refs(self, wanted: frozenset[int]) -> Sequence[ChunkRef]:
        """The chunks whose message indexes name one of the channels, and those that have none."""
        return [ref for ref in self.chunks if not ref.index or any(number in wanted for number, _, _ in ref.index)]

    def load(self, ref: ChunkRef) -> Located:
        """Read and decompress a chunk, and find its messages; runs in a thread."""
        data, problem = unpack(
            ref.compression, self.read(ref.data_at, ref.data_size), ref.size, self.bounds.chunk_bytes
        )
        if problem is None and ref.crc and zlib_ng.crc32(data) != ref.crc:
            problem, data = "its check sum is wrong", b""
        parts = [self.read(at, size // 16 * 16) for _, at, size in ref.index]
        pairs = np.frombuffer(b"".join(part[: len(part) // 16 * 16] for part in parts), dtype="<i8").reshape(-1, 2)
        return locate(data, pairs[:, 1], problem)


def overview_of(path: Path) -> Overview | None:
    """Counts and times as a file's summary states them, and a reader of one chunk of each channel.

    Args:
        path: an MCAP file.

    Returns:
        None when the file has no usable summary, or schemas that stand in none of these chunks.
    """
    try:
        with path.open("rb") as stream:
            summary = make_reader(stream).get_summary()
    except (*_MALFORMED, OSError, ValueError, MemoryError):
        return None
    statistics = None if summary is None else summary.statistics
    if summary is None or statistics is None or not summary.channels:
        return None
    counts = statistics.channel_message_counts
    reader = McapFile(path, summary, _first_chunks(summary))
    if reader.lacks_definitions() or reader.damage or not counts:
        reader.close()
        return None
    text = (
        f"Only the summary and the first chunk of each topic were read, of {len(summary.chunk_indexes)} chunks: rates "
        "are means over the whole log; gaps, clocks and damage inside the chunks were not looked for."
    )
    stated: list[Any] = [statistics, *(chunk for chunk in summary.chunk_indexes if chunk.message_index_offsets)]
    ends = [ns for one in stated for ns in (one.message_start_time, one.message_end_time)]
    good, garbage = plausible_ns(np.array(ends, dtype=np.uint64).astype(np.int64), path.name)
    if garbage:
        text += " Times that are none of this recording stand in the summary; the length leaves them out."
    return Overview(reader, counts, (int(good.min()), int(good.max())), text)


def _first_chunks(summary: Summary) -> list[int]:
    """Where the first chunk of each channel begins, as the summary states it."""
    chosen: list[int] = []
    left = set(summary.channels)
    for chunk in summary.chunk_indexes:
        held = set(chunk.message_index_offsets)
        if left and len(chosen) < _FEW_CHUNKS and (held & left or not held):
            chosen.append(chunk.chunk_start_offset)
            left -= held
    return chosen
