"""A file whose messages lie in chunks: what MCAP files and ROS 1 bags share.

A file is read at places, without trusting what it says about itself.
"""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from collaudit.core.errors import LogError
from collaudit.core.logs.storage.readers import Batch, Channel, DamageNotes, Located
from collaudit.core.logs.storage.reading_bounds import ReadingBounds
from collaudit.core.numeric.parallel import Progress, ordered_map


@dataclass(slots=True)
class ChunkRef:
    """One chunk, or messages outside chunks: where its records lie, what they claim, what indexes them.

    Attributes:
        at: byte of the chunk record; that of the records themselves outside chunks.
        data_at, data_size: its compressed records.
        size: claimed size when decompressed.
        compression: "", ``none``, ``zstd``, ``lz4`` or ``bz2``.
        crc: claimed CRC-32 of the decompressed records; 0 when there is none.
        index: (channel, byte, size) of each message index array.
    """

    at: int
    data_at: int
    data_size: int
    size: int
    compression: str
    crc: int = 0
    index: list[tuple[int, int, int]] = field(default_factory=list)


class ChunkedFile:
    """A file read at places, chunk by chunk; damage is noted.

    Attributes:
        path, size: of the file.
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
        try:
            self._file = path.open("rb", buffering=0)
        except OSError as error:
            raise LogError(f"cannot be opened: {error.strerror}", where=str(path)) from error
        self.path = path
        self.size = os.fstat(self._file.fileno()).st_size
        self.chunks: list[ChunkRef] = []
        self.counts: dict[int, int] = {}
        self.damage = DamageNotes()
        self.bounds = ReadingBounds(self.size, path.name)

    def refs(self, wanted: frozenset[int]) -> Sequence[ChunkRef]:
        """The chunks that may hold messages of some channels: all, where their indexes do not tell."""
        return self.chunks

    def load(self, ref: ChunkRef) -> Located:
        """Read and decompress a chunk, and find its messages; runs in a thread."""
        raise NotImplementedError

    def read(self, start: int, count: int) -> bytes:
        """Up to ``count`` bytes from ``start``; fewer only at the end of the file."""
        try:
            return os.pread(self._file.fileno(), max(0, min(count, self.size - start)), start)
        except OSError as error:
            raise LogError(f"cannot be read: {error.strerror}", where=str(self.path)) from error

    def close(self) -> None:
        """Release the file."""
        self._file.close()

    def batches(self, keys: frozenset[int] | None = None, progress: Progress | None = None) -> Iterator[Batch]:
        """Raw messages by chunk; damage met on the way is added to :attr:`damage`."""
        topics = {channel.key: channel.topic for channel in self.channels}
        wanted = frozenset(topics) if keys is None else keys
        refs = self.refs(wanted)
        self.bounds.take_bytes(sum(ref.size for ref in refs if ref.compression not in ("", "none")))
        found: Counter[int] = Counter()
        for ref, located in zip(refs, ordered_map(self.load, refs), strict=True):
            if located.problem is not None:
                read = f"{located.start.shape[0]} of its messages were read"
                self.damage.note(f"the chunk at byte {ref.at} is damaged: {located.problem}; {read}")
            for batch in located.by_channel():
                found[batch.key] += batch.start.shape[0]
                if batch.key not in topics:
                    self.damage.note(f"messages on channel {batch.key}, which it does not define, were left out")
                elif batch.key in wanted:
                    yield batch
            if progress is not None:
                progress(ref.data_at + ref.data_size, self.size)
        for key in sorted(wanted & set(self.counts) & set(topics)):
            if self.counts[key] != found[key]:
                said = f"{self.counted} {self.counts[key]} messages on {topics[key]}, {found[key]} were found"
                self.damage.note(said)
