"""A file whose damage is noted while it is read."""

from __future__ import annotations

from collections.abc import Sequence

from collaudit.core.logs.storage.file_reading import MAX_CHUNK_BYTES, RandomFile
from collaudit.core.logs.storage.reading_bounds import ReadingBounds
from collaudit.core.logs.storage.records import Damage

#: Further places of damage are not listed.
MAX_DAMAGE = 20


class NotedFile:
    """What readers of message files share.

    Attributes:
        file: the opened file.
        damage: what was found wrong so far, each place once.
        bounds: how much may be read; None while it is opened, when the defaults hold.
    """

    file: RandomFile
    damage: list[Damage]
    bounds: ReadingBounds | None = None

    def close(self) -> None:
        """Release the file."""
        self.file.close()

    def _most(self) -> int:
        """Bytes that a chunk may become."""
        return MAX_CHUNK_BYTES if self.bounds is None else self.bounds.chunk_bytes

    def _take_chunks(self, sizes: Sequence[int]) -> None:
        """Count what chunks claim to become.

        Raises:
            LogError: they become more than is read.
        """
        if self.bounds is not None:
            for size in sizes:
                self.bounds.take_bytes(size)

    def _note(self, text: str, *, lost: bool = True) -> None:
        damage = Damage(text, lost)
        if damage not in self.damage and len(self.damage) < MAX_DAMAGE:
            self.damage.append(damage)
