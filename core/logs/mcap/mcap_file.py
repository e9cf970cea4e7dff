"""Reading MCAP files as batches of raw messages."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from zlib_ng import zlib_ng

from collaudit.core.logs.mcap.mcap_chunk import Located, locate
from collaudit.core.logs.mcap.mcap_records import ChunkRef, McapIndex
from collaudit.core.logs.mcap.mcap_scan import scan
from collaudit.core.logs.mcap.stated_index import looked_up, ranged_index
from collaudit.core.logs.storage.decompression import unpack
from collaudit.core.logs.storage.file_reading import RandomFile
from collaudit.core.logs.storage.noted_file import NotedFile
from collaudit.core.logs.storage.records import Batch, MessageReader, Progress
from collaudit.core.numeric.arrays import IntArray
from collaudit.core.numeric.parallel import ordered_map

#: Chunks are unpacked ahead of who reads them, as many as fit the second-level caches of two cores and not more than so
#: many: what had to come from memory again took a tenth of the time of reading.
_AHEAD_BYTES, _AHEAD = 1 << 22, 8


@dataclass(frozen=True, slots=True, eq=False)
class _Chunk:
    """A chunk's decompressed records, its messages by channel, and what was wrong with it."""

    ref: ChunkRef
    data: bytes
    located: Located
    batches: list[Batch]
    problem: str | None


class McapFile(NotedFile):
    """An MCAP file (see :class:`collaudit.core.logs.storage.records.MessageReader`)."""

    def __init__(self, path: Path, index: McapIndex | None = None) -> None:
        self.file = RandomFile(path)
        self.index = self._indexed() if index is None else index
        self.damage = self.index.damage
        self._read_counts: dict[int, int] = {}
        self._summed = any(chunk.crc for chunk in self.index.chunks)
        self._unsummed: list[int] = []
        if self._hidden_channels() or self.index.lacks_schemas():
            for chunk in ordered_map(self._load, list(self.index.chunks)):
                self._records(chunk)
                if not self._hidden_channels(after_all=True) and not self.index.lacks_schemas():
                    break
        self.channels = self.index.reader_channels()
        encodings = {channel.encoding for channel in self.channels}
        known = "mcap-ros1" if "ros1" in encodings else "mcap-ros2" if "cdr" in encodings else "mcap"
        self.format = known

    def _indexed(self) -> McapIndex:
        """By a walk over all of it; over one with holes by its summary, where that is usable."""
        ranged = None if self.file.partial is None else ranged_index(self.file)
        if ranged is None:
            self.file.expect([(0, self.file.size)])
        return scan(self.file) if ranged is None else ranged

    def _hidden_channels(self, *, after_all: bool = False) -> bool:
        """Whether channels stand only inside chunks."""
        chunks = self.index.chunks
        named = {number for chunk in chunks for number, _, _ in chunk.index}
        blind = any(not chunk.index and chunk.loose is None for chunk in chunks)
        summarised = bool(self.index.channels) and not after_all
        return bool(named - set(self.index.channels)) or (blind and not summarised)

    def _load(self, ref: ChunkRef) -> _Chunk:
        """Read and decompress a chunk, and find its messages; runs in a thread."""
        if ref.extent:
            found = looked_up(self.file, ref)
            if found is None:
                nothing = locate(b"", np.empty(0, np.int64))
                return _Chunk(ref, b"", nothing, [], "it is not what the summary says of it")
            ref = found
        raw = self.file.read(ref.data_at, ref.data_size)
        unpacked = unpack(ref.compression, raw, ref.size if ref.compression else len(raw), self._most())
        problem = unpacked.problem
        data = unpacked.data
        if problem is None and ref.complete:
            if len(data) != ref.size:
                problem = f"it holds {len(data)} bytes and claims {ref.size}"
            elif ref.crc and zlib_ng.crc32(data) != ref.crc:
                problem, data = "its check sum is wrong", b""
        located = locate(data, self._indexed_offsets(ref) if ref.loose is None else ref.loose)
        return _Chunk(ref, data, located, list(located.by_channel(np.frombuffer(data, dtype=np.uint8))), problem)

    def _indexed_offsets(self, ref: ChunkRef) -> IntArray:
        """Where its message indexes say that messages lie."""
        parts = [self.file.read(at, size) for _, at, size in ref.index]
        pairs = np.frombuffer(b"".join(part[: len(part) // 16 * 16] for part in parts), dtype="<u8").reshape(-1, 2)
        offsets: IntArray = np.minimum(pairs[:, 1], np.uint64(1 << 62)).astype(np.int64)
        return offsets

    def _records(self, chunk: _Chunk) -> None:
        for op, at, length in chunk.located.others:
            self.index.record(op, chunk.data[at + 9 : at + 9 + length])

    def batches(self, keys: frozenset[int] | None = None, progress: Progress | None = None) -> Iterator[Batch]:
        """Raw messages by chunk; damage met on the way is added to :attr:`damage`."""
        wanted = keys if keys is not None else frozenset(self.index.channels)
        chunks = [ref for ref in self.index.chunks if _may_hold(ref, wanted)]
        self._read_counts, self._unsummed = {}, []
        self._take_chunks([ref.size for ref in chunks if ref.compression])
        self.file.expect([(ref.at, ref.extent) for ref in chunks if ref.extent])
        largest = max((ref.size for ref in chunks), default=1)
        for chunk in ordered_map(self._load, chunks, min(_AHEAD, max(1, _AHEAD_BYTES // max(1, largest)))):
            self._judge(chunk)
            yield from (batch for batch in chunk.batches if self._counted(batch) in wanted)
            if progress is not None:
                progress(chunk.ref.data_at + chunk.ref.data_size, self.file.size)
        for at in self._unsummed if self._summed else ():
            self._note(f"the chunk at byte {at} has no check sum, unlike the others", lost=False)
        self._compare_counts(wanted)

    def _judge(self, chunk: _Chunk) -> None:
        located = chunk.located
        self._summed = self._summed or bool(chunk.ref.crc)
        if chunk.problem is not None:
            kept = f"{located.start.shape[0]} messages before the damage were read"
            self._note(f"the {chunk.ref.kind} at byte {chunk.ref.at} is damaged: {chunk.problem}; {kept}")
        elif chunk.ref.loose is None and chunk.ref.complete and not chunk.ref.crc:
            self._unsummed.append(chunk.ref.at)
        if chunk.problem is None and located.rest:
            self._note(f"the chunk at byte {chunk.ref.at} has {located.rest} bytes that are no record")

    def _counted(self, batch: Batch) -> int:
        """The channel of some messages, after they are counted."""
        number = batch.key
        self._read_counts[number] = self._read_counts.get(number, 0) + batch.start.shape[0]
        if number not in self.index.channels:
            self._note(f"messages on channel {number}, which it does not define, were left out")
        return number

    def _compare_counts(self, wanted: frozenset[int]) -> None:
        for number in sorted(wanted & set(self.index.counts)):
            claimed, found = self.index.counts[number], self._read_counts.get(number, 0)
            if claimed != found:
                topic = self.index.channels[number].topic if number in self.index.channels else number
                self._note(f"its statistics count {claimed} messages on {topic}, {found} were found")


def _may_hold(ref: ChunkRef, wanted: frozenset[int]) -> bool:
    return not ref.index or any(number in wanted for number, _, _ in ref.index)


#: How the table of formats opens a file.
open_mcap: Callable[[Path], MessageReader] = McapFile
