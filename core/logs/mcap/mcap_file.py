"""Reading MCAP files as batches of raw messages."""

from __future__ import annotations

import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from collaudit.core.logs.mcap.mcap_chunk import Located, heads_of, locate, located_of
from collaudit.core.logs.mcap.mcap_scan import CHANNEL, SCHEMA, ChunkRef, McapIndex, scan
from collaudit.core.logs.mcap.stated_index import looked_up, ranged_index
from collaudit.core.logs.storage.decompression import unpack
from collaudit.core.logs.storage.file_reading import RandomFile
from collaudit.core.logs.storage.noted_file import NotedFile
from collaudit.core.logs.storage.records import Batch, ByteArray, Channel, MessageReader, Progress
from collaudit.core.numeric.arrays import IntArray
from collaudit.core.numeric.parallel import ordered_map

_WINDOW = 1 << 20
#: Messages after which a turn of topics is looked for to begin again.
_LONGEST_TURN = 16
#: Chunks are unpacked ahead of who reads them, as many as fit the second-level caches of two cores and not more than so
#: many: what had to come from memory again took a tenth of the time of reading.
_AHEAD_BYTES, _AHEAD = 1 << 22, 8


@dataclass(frozen=True, slots=True, eq=False)
class _Chunk:
    """A chunk's decompressed records and where its messages lie; ``problem`` says what was wrong with it."""

    ref: ChunkRef
    data: bytes
    located: Located
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
        found = (self.index.channel(number) for number in sorted(self.index.channels))
        self.channels: tuple[Channel, ...] = tuple(channel for channel in found if channel is not None)
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
        blind = any(not chunk.index for chunk in chunks)
        summarised = bool(self.index.channels) and not after_all
        return bool(named - set(self.index.channels)) or (blind and not summarised)

    def _load(self, ref: ChunkRef) -> _Chunk:
        """Read and decompress a chunk, and find its messages; runs in a thread."""
        if ref.extent:
            found = looked_up(self.file, ref)
            if found is None:
                return _Chunk(ref, b"", locate(b"", np.empty(0, np.int64)), "it is not what the summary says of it")
            ref = found
        raw = self.file.read(ref.data_at, ref.data_size)
        unpacked = unpack(ref.compression, raw, ref.size if ref.compression else len(raw), self._most())
        problem = unpacked.problem
        data = unpacked.data
        if problem is None and ref.complete:
            if len(data) != ref.size:
                problem = f"it holds {len(data)} bytes and claims {ref.size}"
            elif ref.crc and zlib.crc32(data) != ref.crc:
                problem, data = "its check sum is wrong", b""
        parts = [self.file.read(at, size) for _, at, size in ref.index] if data else []
        pairs = np.frombuffer(b"".join(part[: len(part) // 16 * 16] for part in parts), dtype="<u8").reshape(-1, 2)
        offsets = np.minimum(pairs[:, 1], np.uint64(1 << 62)).astype(np.int64)
        return _Chunk(ref, data, locate(data, offsets), problem)

    def _records(self, chunk: _Chunk) -> None:
        for op, at, length in chunk.located.others:
            if op in (SCHEMA, CHANNEL):
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
            yield from self._split(np.frombuffer(chunk.data, dtype=np.uint8), chunk.located, wanted)
            if progress is not None:
                progress(chunk.ref.data_at + chunk.ref.data_size, self.file.size)
        yield from self._loose(wanted, progress)
        for at in self._unsummed if self._summed else ():
            self._note(f"the chunk at byte {at} has no check sum, unlike the others", lost=False)
        self._compare_counts(wanted)

    def _judge(self, chunk: _Chunk) -> None:
        located = chunk.located
        self._summed = self._summed or bool(chunk.ref.crc)
        if chunk.problem is not None:
            kept = f"{located.start.shape[0]} messages before the damage were read"
            self._note(f"the chunk at byte {chunk.ref.at} is damaged: {chunk.problem}; {kept}")
        elif chunk.ref.complete and not chunk.ref.crc:
            self._unsummed.append(chunk.ref.at)
        if chunk.problem is None and located.rest:
            self._note(f"the chunk at byte {chunk.ref.at} has {located.rest} bytes that are no record")

    def _split(self, data: ByteArray, located: Located, wanted: frozenset[int]) -> Iterator[Batch]:
        for number, mine in _by_channel(located.channel):
            start = located.start[mine]
            self._read_counts[number] = self._read_counts.get(number, 0) + start.shape[0]
            if number not in self.index.channels:
                self._note(f"messages on channel {number}, which it does not define, were left out")
            if number in wanted:
                rest = located.length[mine], located.log_ns[mine], located.publish_ns[mine]
                yield Batch(number, data, start, *rest)

    def _loose(self, wanted: frozenset[int], progress: Progress | None) -> Iterator[Batch]:
        """Messages outside chunks, read in windows of bounded size."""
        at, size = self.index.loose.at, self.index.loose.size

        def load(part: slice) -> tuple[int, ByteArray, Located | None]:
            """Where a window's messages begin, its bytes, and where they lie in it; runs in a thread."""
            base, stop = int(at[part][0]), int(at[part][-1] + 9 + size[part][-1])
            raw = np.frombuffer(self.file.read(base, stop - base), dtype=np.uint8)
            if stop - base > raw.shape[0]:
                return base, raw, None
            offsets = at[part] - base
            return base, raw, located_of(offsets, size[part], heads_of(raw, offsets))

        for base, raw, located in ordered_map(load, _windows(at, size)):
            if located is None:
                self._note(f"it lost bytes from {base + raw.shape[0]} on while it was read")
                return
            yield from self._split(raw, located, wanted)
            if progress is not None:
                progress(base + raw.shape[0], self.file.size)

    def _compare_counts(self, wanted: frozenset[int]) -> None:
        for number in sorted(wanted & set(self.index.counts)):
            claimed, found = self.index.counts[number], self._read_counts.get(number, 0)
            if claimed != found:
                topic = self.index.channels[number][1] if number in self.index.channels else number
                self._note(f"its statistics count {claimed} messages on {topic}, {found} were found")


def _by_channel(channel: IntArray) -> list[tuple[int, slice | IntArray]]:
    """Each channel met, in order of their numbers, with the places of its messages.

    Recorders mostly write the same topics in turn: their messages are then a slice each.
    """
    head = channel[: _LONGEST_TURN + 1].tolist()
    turn = head.index(head[0], 1) if head and head[0] in head[1:] else len(head)
    if len(set(head[:turn])) == turn and (channel[turn:] == channel[:-turn]).all():
        return [(head[place], slice(place, None, turn)) for place in sorted(range(turn), key=lambda place: head[place])]
    numbers = np.flatnonzero(np.bincount(channel)).tolist()
    return [(number, np.flatnonzero(channel == number)) for number in numbers]


def _windows(at: IntArray, size: IntArray) -> list[slice]:
    """Stretches of loose messages that lie within ``_WINDOW`` bytes of the file, or single ones that are longer."""
    ends = at + 9 + size
    out: list[slice] = []
    while (first := out[-1].stop if out else 0) < at.shape[0]:
        out.append(slice(first, max(int(np.searchsorted(ends, at[first] + _WINDOW)), first + 1)))
    return out


def _may_hold(ref: ChunkRef, wanted: frozenset[int]) -> bool:
    return not ref.index or any(number in wanted for number, _, _ in ref.index)


#: How the table of formats opens a file.
open_mcap: Callable[[Path], MessageReader] = McapFile
