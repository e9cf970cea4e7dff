"""A file whose messages lie in chunks: what MCAP files and ROS 1 bags share."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from collaudit.core.logs.storage.file_reading import MAX_CHUNK_BYTES, RandomFile
from collaudit.core.logs.storage.message_places import Located
from collaudit.core.logs.storage.reading_bounds import ReadingBounds
from collaudit.core.logs.storage.records import Batch, Channel, Damage, Progress
from collaudit.core.numeric.parallel import ordered_map

#: Further places of damage are not listed.
MAX_DAMAGE = 20
#: Chunks are unpacked ahead of who reads them, as many as fit the second-level caches of two cores and not more than so
#: many: what had to come from memory again took a tenth of the time of reading.
_AHEAD_BYTES, _AHEAD = 1 << 22, 8


@dataclass(frozen=True, slots=True, eq=False)
class Chunk:
    """A chunk's decompressed records, its messages by channel, and what was wrong with it."""

    ref: Any
    data: bytes
    located: Located
    batches: list[Batch]
    problem: str | None

    @classmethod
    def of(cls, ref: Any, data: bytes, located: Located, problem: str | None) -> Chunk:
        """A chunk by where its messages were located."""
        return cls(ref, data, located, located.by_channel(np.frombuffer(data, dtype=np.uint8)), problem)


class ChunkedFile:
    """A file read chunk by chunk; damage is noted.

    Attributes:
        file: the opened file.
        channels: what it holds.
        counts: channel to how many messages its index claims.
        damage: what was found wrong so far, each place once.
        bounds: how much may be read; None while it is opened, when the defaults hold.
        counted: begins what is said of claims that do not hold.
    """

    counted = "its index counts"
    file: RandomFile
    channels: tuple[Channel, ...]
    counts: dict[int, int]
    damage: list[Damage]
    bounds: ReadingBounds | None = None

    def refs(self, wanted: frozenset[int]) -> Sequence[Any]:
        """The chunks that may hold messages of some channels."""
        raise NotImplementedError

    def load(self, ref: Any) -> Chunk:
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
        if self.bounds is not None:
            self.bounds.take_bytes(sum(ref.size for ref in refs if ref.compression not in ("", "none")))
        found: Counter[int] = Counter()
        largest = max((ref.size for ref in refs), default=1)
        for chunk in ordered_map(self.load, refs, min(_AHEAD, max(1, _AHEAD_BYTES // max(1, largest)))):
            self.judge(chunk)
            for batch in chunk.batches:
                found[batch.key] += batch.start.shape[0]
                if batch.key not in topics:
                    self.note(f"messages on channel {batch.key}, which it does not define, were left out")
                elif batch.key in wanted:
                    yield batch
            if progress is not None:
                progress(chunk.ref.data_at + chunk.ref.data_size, self.file.size)
        for key in sorted(wanted & set(self.counts) & set(topics)):
            if self.counts[key] != found[key]:
                self.note(f"{self.counted} {self.counts[key]} messages on {topics[key]}, {found[key]} were found")

    def judge(self, chunk: Chunk) -> None:
        """Note what is wrong with a chunk."""
        located = chunk.located
        if chunk.problem is not None:
            kept = f"{located.start.shape[0]} messages before the damage were read"
            self.note(f"the chunk at byte {chunk.ref.at} is damaged: {chunk.problem}; {kept}")
        elif located.rest:
            self.note(f"the chunk at byte {chunk.ref.at} has {located.rest} bytes that are no record")

    def most(self) -> int:
        """Bytes that a chunk may become."""
        return MAX_CHUNK_BYTES if self.bounds is None else self.bounds.chunk_bytes

    def note(self, text: str) -> None:
        """Note damage, each once."""
        damage = Damage(text)
        if damage not in self.damage and len(self.damage) < MAX_DAMAGE:
            self.damage.append(damage)
