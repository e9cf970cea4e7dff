"""Writing MCAP: chunks of many messages of one size, without a step a message.

The container is that of the MCAP specification; its small records come from the ``mcap`` package, the messages and
their index, of which there are millions, are made as arrays.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import IO

import numpy as np
import zstandard
from mcap import records
from mcap.data_stream import RecordBuilder
from numpy.typing import NDArray

from collaudit.core.numeric.stage_progress import Progress

_MAGIC = b"\x89MCAP0\r\n"
_CHUNK_BYTES = 4 << 20
_MESSAGE, _INDEX = 0x05, 0x07
_HEAD = 31  # op code, length, channel, sequence, two times


@dataclass(frozen=True, slots=True, eq=False)
class Channel:
    """A topic and its messages in order of time.

    Attributes:
        topic: its name.
        type: name of the message type.
        definition: text of the type.
        stamps_ns: (n,) log times.
        messages: (n, size) bytes of messages of one size, or n messages of any.
    """

    topic: str
    type: str
    definition: str
    stamps_ns: NDArray[np.int64]
    messages: NDArray[np.uint8] | Sequence[bytes]


def write_mcap(
    out: IO[bytes],
    channels: Sequence[Channel],
    facts: Mapping[str, str],
    library: str,
    progress: Progress | None = None,
) -> None:
    """Write channels as one MCAP file with index and summary; the same input gives the same bytes.

    Args:
        out: an empty file.
        channels: what it holds, ROS 2 messages in CDR.
        facts: kept as metadata.
        library: what is named as the writer.
        progress: called with messages written and in all.
    """
    types = {channel.type: channel.definition for channel in channels}
    definitions = [
        records.Schema(id=k, name=name, encoding="ros2msg", data=text.encode())
        for k, (name, text) in enumerate(types.items(), start=1)
    ]
    ids = {schema.name: schema.id for schema in definitions}
    known = [
        records.Channel(id=k, topic=channel.topic, message_encoding="cdr", metadata={}, schema_id=ids[channel.type])
        for k, channel in enumerate(channels, start=1)
    ]
    place = out.write(_MAGIC + _built(records.Header(profile="ros2", library=library), *definitions, *known))
    chunks: list[records.ChunkIndex] = []
    written, every = 0, sum(len(channel.stamps_ns) for channel in channels)
    for part in _parts(channels):
        place += _write_chunk(out, place, part, chunks)
        written += sum(len(stamps) for _, stamps, _, _ in part)
        if progress is not None:
            progress(written, every)
    metadata = _built(records.Metadata(name="collaudit", metadata=dict(facts)))
    index = records.MetadataIndex(offset=place, length=len(metadata), name="collaudit")
    place += out.write(metadata + _built(records.DataEnd(data_section_crc=0)))
    summary = _built(*definitions, *known, *chunks, index, _statistics(channels, chunks, len(types)))
    footer = _built(records.Footer(summary_start=place, summary_offset_start=0, summary_crc=0))[:-4]
    out.write(summary + footer + zlib.crc32(summary + footer).to_bytes(4, "little") + _MAGIC)


def _built(*items: records.McapRecord) -> bytes:
    builder = RecordBuilder()
    for item in items:
        item.write(builder)
    built = builder.end()  # type: ignore[no-untyped-call]
    assert isinstance(built, bytes)
    return built


def _statistics(channels: Sequence[Channel], chunks: Sequence[records.ChunkIndex], schemas: int) -> records.Statistics:
    counts = {k: len(channel.stamps_ns) for k, channel in enumerate(channels, start=1)}
    filled = [channel.stamps_ns for channel in channels if len(channel.stamps_ns)]
    return records.Statistics(
        attachment_count=0,
        channel_count=len(channels),
        channel_message_counts=counts,
        chunk_count=len(chunks),
        message_count=sum(counts.values()),
        message_start_time=min((int(stamps[0]) for stamps in filled), default=0),
        message_end_time=max((int(stamps[-1]) for stamps in filled), default=0),
        metadata_count=1,
        schema_count=schemas,
    )


_Part = list[tuple[int, NDArray[np.int64], NDArray[np.uint8] | Sequence[bytes], int]]


def _parts(channels: Sequence[Channel]) -> Iterator[_Part]:
    """Stretches of time of some MB each: of every channel its number, stamps, messages and first sequence number."""
    filled = [channel for channel in channels if len(channel.stamps_ns)]
    if not filled:
        return
    size = sum(len(c.stamps_ns) * (len(c.messages[0]) + _HEAD) for c in filled)
    count = max(1, size // _CHUNK_BYTES)
    start = min(int(c.stamps_ns[0]) for c in filled)
    end = max(int(c.stamps_ns[-1]) for c in filled)
    edges = start + (np.arange(1, count, dtype=np.int64) * (end - start)) // count
    cuts = [np.concatenate([[0], np.searchsorted(c.stamps_ns, edges), [len(c.stamps_ns)]]) for c in channels]
    for k in range(count):
        part: _Part = []
        for number, (channel, cut) in enumerate(zip(channels, cuts, strict=True), start=1):
            span = slice(int(cut[k]), int(cut[k + 1]))
            if span.stop > span.start:
                part.append((number, channel.stamps_ns[span], channel.messages[span], span.start))
        if part:
            yield part


def _write_chunk(out: IO[bytes], place: int, part: _Part, chunks: list[records.ChunkIndex]) -> int:
    """Write a chunk and the index of its messages, note it in ``chunks``, and return the bytes written."""
    blocks, indexes, offset = [], [], 0
    for channel, stamps, messages, first in part:
        block, offsets = _records(channel, stamps, messages, first)
        blocks.append(block)
        indexes.append((channel, _index_record(channel, stamps, offsets + offset)))
        offset += len(block)
    raw = b"".join(blocks)
    packed = zstandard.ZstdCompressor(level=1).compress(raw)
    times = min(int(stamps[0]) for _, stamps, _, _ in part), max(int(stamps[-1]) for _, stamps, _, _ in part)
    chunk = _built(
        records.Chunk(
            compression="zstd",
            data=packed,
            message_start_time=times[0],
            message_end_time=times[1],
            uncompressed_crc=zlib.crc32(raw),
            uncompressed_size=len(raw),
        )
    )
    out.write(chunk)
    at, where = place + len(chunk), {}
    for channel, record in indexes:
        where[channel] = at
        at += out.write(record)
    chunks.append(
        records.ChunkIndex(
            chunk_length=len(chunk),
            chunk_start_offset=place,
            compression="zstd",
            compressed_size=len(packed),
            message_start_time=times[0],
            message_end_time=times[1],
            message_index_length=at - place - len(chunk),
            message_index_offsets=where,
            uncompressed_size=len(raw),
        )
    )
    return at - place


def _records(
    channel: int, stamps: NDArray[np.int64], messages: NDArray[np.uint8] | Sequence[bytes], first: int
) -> tuple[bytes, NDArray[np.int64]]:
    """Message records and where each begins."""
    sizes = np.array([len(message) for message in messages]) if not isinstance(messages, np.ndarray) else None
    count = len(stamps)
    head = np.zeros(count, dtype=[("op", "u1"), ("n", "<u8"), ("id", "<u2"), ("k", "<u4"), ("t", "<u8"), ("p", "<u8")])
    head["op"], head["id"], head["k"] = _MESSAGE, channel, np.arange(first, first + count)
    head["t"] = head["p"] = stamps
    if sizes is None:
        assert isinstance(messages, np.ndarray)
        size = messages.shape[1]
        head["n"] = _HEAD - 9 + size
        both = np.concatenate([head.view(np.uint8).reshape(count, _HEAD), messages], axis=1)
        return both.tobytes(), np.arange(count, dtype=np.int64) * (_HEAD + size)
    head["n"] = _HEAD - 9 + sizes
    block = b"".join(head[k].tobytes() + message for k, message in enumerate(messages))
    return block, np.concatenate([[0], np.cumsum(_HEAD + sizes)[:-1]]).astype(np.int64)


def _index_record(channel: int, stamps: NDArray[np.int64], offsets: NDArray[np.int64]) -> bytes:
    entries = np.empty(len(stamps), dtype=[("t", "<u8"), ("o", "<u8")])
    entries["t"], entries["o"] = stamps, offsets
    raw = entries.tobytes()
    return struct.pack("<BQHI", _INDEX, 6 + len(raw), channel, len(raw)) + raw
