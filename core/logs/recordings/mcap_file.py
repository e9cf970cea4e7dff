"""Reading MCAP files as batches of raw messages: by the message index of each chunk, proven against the bytes.

What is in a huge file is told by its summary section, without walking over it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import numpy as np
from zlib_ng import zlib_ng

from collaudit.core.logs.recordings.mcap_records import (
    CHANNEL,
    MESSAGE,
    MESSAGE_HEAD,
    SCHEMA,
    McapIndex,
    chunk_at,
    read_summary,
    record_places,
    scan,
)
from collaudit.core.logs.signals.impossible_values import plausible_ns
from collaudit.core.logs.storage.chunked_file import Chunk, ChunkedFile, ChunkRef, RandomFile
from collaudit.core.logs.storage.decompression import unpack
from collaudit.core.logs.storage.records import (
    ByteArray,
    Located,
    MessageReader,
    Overview,
    ascending,
    follow_each_other,
    gather,
)
from collaudit.core.numeric.arrays import IntArray
from collaudit.core.numeric.parallel import ordered_map

_HEAD = np.dtype([("op", "u1"), ("length", "<u8"), ("channel", "<u2"), ("seq", "<u4"), ("log", "<u8"), ("pub", "<u8")])
#: Bytes of a message's body before its payload.
_LEAST = 22
#: What chunks hold (mcap.dev/spec). So many other records are passed over, and so many schemas and channels taken.
_OF_CHUNKS = (SCHEMA, CHANNEL, MESSAGE)
_MOST_FOREIGN, _MOST_OTHERS = 10_000, 1 << 18


def locate(data: bytes, index_offsets: IntArray) -> Located:
    """Find every message of a chunk.

    The offsets of the message indexes are used when each is the start of a message and nothing lies between these;
    else the chunk is walked record by record, so that a message missing from the index is found all the same.

    Args:
        data: the chunk's records.
        index_offsets: (m,) offsets from its message indexes, any order; may be empty or wrong.
    """
    view = np.frombuffer(data, dtype=np.uint8)
    offsets = ascending(index_offsets)
    others: list[tuple[int, int, int]] = []
    rest = 0
    if not _are_all(view, offsets):
        offsets, others, rest = _walked(data)
    heads = _heads_of(view, offsets)
    return Located(
        start=offsets + MESSAGE_HEAD,
        length=heads["length"].astype(np.int64) - _LEAST,
        channel=heads["channel"].astype(np.int64),
        log_ns=heads["log"].astype(np.int64),
        others=others,
        rest=rest,
    )


def _heads_of(view: ByteArray, offsets: IntArray) -> np.ndarray[tuple[int], np.dtype[np.void]]:
    heads: np.ndarray[tuple[int], np.dtype[np.void]] = gather(view, offsets, MESSAGE_HEAD).view(_HEAD).ravel()
    return heads


def _are_all(view: ByteArray, offsets: IntArray) -> bool:
    """Whether a message begins at each offset, and the chunk holds nothing else."""
    size = view.shape[0]
    if not offsets.shape[0] or offsets[0] < 0 or offsets[-1] + MESSAGE_HEAD > size:
        return False
    heads = _heads_of(view, offsets)
    lengths = heads["length"].astype(np.int64)
    whole = bool((heads["op"] == MESSAGE).all()) and int(lengths.min()) >= _LEAST
    return whole and follow_each_other(offsets, offsets + 9 + lengths, size)


def _walked(data: bytes) -> tuple[IntArray, list[tuple[int, int, int]], int]:
    """What a chunk holds, record by record: offsets of messages, schemas and channels, and bytes that are no record."""
    found: list[int] = []
    others: list[tuple[int, int, int]] = []
    rest, foreign = len(data), 0
    for op, at, length in record_places(data):
        if op not in _OF_CHUNKS:
            foreign += 1
            if op == 0 or foreign > _MOST_FOREIGN:  # no record begins so: the rest is none, however long
                break
        if op == MESSAGE and length < _LEAST:
            continue
        rest -= 9 + length
        if op == MESSAGE:
            found.append(at)
        elif op in (SCHEMA, CHANNEL) and len(others) < _MOST_OTHERS:
            others.append((op, at, length))
    return np.array(found, dtype=np.int64), others, rest


class McapFile(ChunkedFile):
    """An MCAP file (see :class:`collaudit.core.logs.storage.records.MessageReader`)."""

    counted = "its statistics count"

    def __init__(self, path: Path, index: McapIndex | None = None) -> None:
        super().__init__(path)
        self.index = scan(self.file) if index is None else index
        self.chunks, self.damage, self.counts = self.index.chunks, self.index.damage, self.index.counts
        blind = not self.index.channels and any(not chunk.index for chunk in self.chunks)
        for chunk in ordered_map(self.load, list(self.chunks)) if blind or self._incomplete() else ():
            for op, at, length in chunk.located.others:
                self.index.record(op, chunk.data[at + 9 : at + 9 + length])
            if not blind and not self._incomplete():
                break
        self.channels = self.index.reader_channels()
        encodings = {channel.encoding for channel in self.channels}
        self.format = "mcap-ros1" if "ros1" in encodings else "mcap-ros2" if "cdr" in encodings else "mcap"

    def _incomplete(self) -> bool:
        """Whether channels or schemas, as far as is known, stand only inside chunks."""
        named = {number for chunk in self.chunks for number, _, _ in chunk.index}
        return bool(named - set(self.index.channels)) or self.index.lacks_schemas()

    def refs(self, wanted: frozenset[int]) -> Sequence[ChunkRef]:
        """The chunks whose message indexes name one of the channels, and those that have none."""
        return [ref for ref in self.chunks if not ref.index or any(number in wanted for number, _, _ in ref.index)]

    def load(self, ref: ChunkRef) -> Chunk:
        """Read and decompress a chunk, and find its messages; runs in a thread."""
        if ref.extent:
            found = chunk_at(self.file, ref.at)
            if found is None or replace(found, crc=0) != replace(ref, index=(), extent=0):
                nothing = locate(b"", np.empty(0, np.int64))
                return Chunk(ref, b"", nothing, "it is not what the summary says of it")
            ref = found
        raw = self.file.read(ref.data_at, ref.data_size)
        data, problem = unpack(ref.compression, raw, ref.size, self.bounds.chunk_bytes)
        if problem is None and ref.crc and zlib_ng.crc32(data) != ref.crc:
            problem, data = "its check sum is wrong", b""
        located = locate(data, self._indexed_offsets(ref) if ref.loose is None else ref.loose)
        return Chunk(ref, data, located, problem)

    def _indexed_offsets(self, ref: ChunkRef) -> IntArray:
        """Where its message indexes say that messages lie."""
        parts = [self.file.read(at, size) for _, at, size in ref.index]
        pairs = np.frombuffer(b"".join(part[: len(part) // 16 * 16] for part in parts), dtype="<u8").reshape(-1, 2)
        offsets: IntArray = np.minimum(pairs[:, 1], np.uint64(1 << 62)).astype(np.int64)
        return offsets


#: How the table of formats opens a file.
open_mcap: Callable[[Path], MessageReader] = McapFile


def overview_of(path: Path) -> Overview | None:
    """Counts and times as a file's summary states them, and a reader of one chunk of each channel.

    Args:
        path: an MCAP file.

    Returns:
        None when the file has no usable summary, or schemas that stand in none of these chunks.
    """
    with closing(RandomFile(path)) as file:
        index = read_summary(file)
    if index is None:
        return None
    text = (
        f"Only the summary and the first chunk of each topic were read, of {len(index.chunks)} chunks: rates are means "
        "over the whole log; gaps, clocks and damage inside the chunks were not looked for."
    )
    reader = McapFile(path, _first_chunks(index))
    if reader.index.lacks_schemas():
        reader.close()
        return None
    stamps = np.array(index.stamps_ns, dtype=np.uint64).astype(np.int64)
    good, garbage = plausible_ns(stamps, path.name)
    if garbage:
        text += " Times that are none of this recording stand in the summary; the length leaves them out."
    return Overview(reader, index.counts, (int(good.min()), int(good.max())), text)


def _first_chunks(index: McapIndex) -> McapIndex:
    """An index of the first chunk that holds each channel, and no others."""
    chosen: dict[int, ChunkRef] = {}
    left = set(index.channels)
    for chunk in index.chunks:
        held = {number for number, _, _ in chunk.index}
        if held & left or not held:
            chosen[chunk.at] = chunk
            left -= held
        if not left or len(chosen) > 16:
            break
    return McapIndex(index.schemas, index.channels, list(chosen.values()))
