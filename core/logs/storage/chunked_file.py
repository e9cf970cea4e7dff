"""A file whose messages lie in chunks: what MCAP files and ROS 1 bags share.

A file is read at places, without trusting what it says about itself.
"""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from collaudit.core.errors import LogError
from collaudit.core.logs.storage.reading_bounds import ReadingBounds
from collaudit.core.logs.storage.records import Batch, Channel, DamageNotes, Located
from collaudit.core.numeric.arrays import IntArray
from collaudit.core.numeric.parallel import ordered_map
from collaudit.core.numeric.stage_progress import Progress

#: Nothing of a file is decompressed into more than this at once, unless the configuration says so.
MAX_CHUNK_BYTES = 128_000_000
#: A chunk that claims to be larger than this, and more than ``MAX_RATIO`` times its bytes, is refused.
FREE_CHUNK_BYTES = 64 << 20
MAX_RATIO = 1000
#: A table may become this large, or so many times its file.
FREE_TABLE_BYTES, TABLE_RATIO = 128_000_000, 25


class RandomFile:
    """A file read at offsets; short reads at its end are the caller's to notice.

    Attributes:
        path, size: of the file.
    """

    def __init__(self, path: Path) -> None:
        try:
            self._fd = os.open(path, os.O_RDONLY | getattr(os, "O_CLOEXEC", 0))
        except OSError as error:
            raise LogError(f"cannot be opened: {error.strerror}", where=str(path)) from error
        self.path = path
        self.size = os.fstat(self._fd).st_size

    def read(self, start: int, count: int) -> bytes:
        """Up to ``count`` bytes from ``start``; fewer only at the end of the file."""
        count = max(0, min(count, self.size - start))
        parts: list[bytes] = []
        while count > 0:
            try:
                part = os.pread(self._fd, count, start)
            except OSError as error:
                raise LogError(f"cannot be read: {error.strerror}", where=str(self.path)) from error
            if not part:
                break
            parts.append(part)
            start += len(part)
            count -= len(part)
        return parts[0] if len(parts) == 1 else b"".join(parts)

    def close(self) -> None:
        """Close it; a second time does nothing."""
        if self._fd >= 0:
            os.close(self._fd)
            self._fd = -1


def plausible_size(compressed: int, claimed: int, most: int = MAX_CHUNK_BYTES) -> bool:
    """Whether a chunk of ``compressed`` bytes may be trusted to hold ``claimed`` bytes; ``most`` are allowed."""
    return claimed <= most and (claimed <= FREE_CHUNK_BYTES or claimed <= MAX_RATIO * max(compressed, 1))


def plausible_table(file_bytes: int, claimed: int) -> bool:
    """Whether a file of so many bytes may be read as a table of ``claimed`` bytes: all of it is in memory at once."""
    return claimed <= max(FREE_TABLE_BYTES, TABLE_RATIO * file_bytes)


@dataclass(frozen=True, slots=True)
class ChunkRef:
    """One chunk, or a run of messages outside chunks: where its records lie, what they claim, what indexes them.

    Attributes:
        at: byte of the chunk record.
        data_at, data_size: its compressed records.
        size: claimed size when decompressed.
        compression: "", ``none``, ``zstd``, ``lz4`` or ``bz2``.
        index: (channel, byte, size) of each message index array.
        crc: claimed CRC-32 of the decompressed records; 0 when there is none.
        extent: bytes of the chunk and its message indexes as the file's summary states them, which of ``index`` says
            the channels alone; 0 where it was walked.
        loose: offsets of the messages of a run outside chunks; None of a chunk.
    """

    at: int
    data_at: int
    data_size: int
    size: int
    compression: str
    index: tuple[tuple[int, int, int], ...] = ()
    crc: int = 0
    extent: int = 0
    loose: IntArray | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Chunk:
    """A chunk's decompressed records, where its messages lie in them, and what was wrong with it."""

    ref: ChunkRef
    data: bytes
    located: Located
    problem: str | None


class ChunkedFile:
    """A file read chunk by chunk; damage is noted.

    Attributes:
        file: the opened file.
        chunks: in the order of the file.
        channels: what it holds.
        counts: channel to how many messages its index claims.
        damage: what was found wrong so far, each place once.
        bounds: how much may be read; the defaults while it is opened.
        counted: begins what is said of claims that do not hold.
    """

    counted = "its index counts"
    channels: tuple[Channel, ...]

    def __init__(self, path: Path) -> None:
        self.file = RandomFile(path)
        self.chunks: list[ChunkRef] = []
        self.counts: dict[int, int] = {}
        self.damage = DamageNotes()
        self.bounds = ReadingBounds(self.file.size, path.name)

    def refs(self, wanted: frozenset[int]) -> Sequence[ChunkRef]:
        """The chunks that may hold messages of some channels: all, where their indexes do not tell."""
        return self.chunks

    def load(self, ref: ChunkRef) -> Chunk:
        """Read and decompress a chunk, and find its messages; runs in a thread."""
        raise NotImplementedError

    def close(self) -> None:
        """Release the file."""
        self.file.close()

    def batches(self, keys: frozenset[int] | None = None, progress: Progress | None = None) -> Iterator[Batch]:
        """Raw messages by chunk; damage met on the way is added to :attr:`damage`."""
        topics = {channel.key: channel.topic for channel in self.channels}
        wanted = frozenset(topics) if keys is None else keys
        refs = self.refs(wanted)
        self.bounds.take_bytes(sum(ref.size for ref in refs if ref.compression not in ("", "none")))
        found: Counter[int] = Counter()
        for chunk in ordered_map(self.load, refs):
            self._judge(chunk)
            for batch in chunk.located.by_channel(np.frombuffer(chunk.data, dtype=np.uint8)):
                found[batch.key] += batch.start.shape[0]
                if batch.key not in topics:
                    self.damage.note(f"messages on channel {batch.key}, which it does not define, were left out")
                elif batch.key in wanted:
                    yield batch
            if progress is not None:
                progress(chunk.ref.data_at + chunk.ref.data_size, self.file.size)
        for key in sorted(wanted & set(self.counts) & set(topics)):
            if self.counts[key] != found[key]:
                self.damage.note(
                    f"{self.counted} {self.counts[key]} messages on {topics[key]}, {found[key]} were found"
                )

    def _judge(self, chunk: Chunk) -> None:
        """Note what is wrong with a chunk."""
        located = chunk.located
        if chunk.problem is not None:
            kept = f"{located.start.shape[0]} messages before the damage were read"
            self.damage.note(f"the chunk at byte {chunk.ref.at} is damaged: {chunk.problem}; {kept}")
        elif located.rest:
            self.damage.note(f"the chunk at byte {chunk.ref.at} has {located.rest} bytes that are no record")
