"""Reading a file at places, without trusting what it says about itself."""

from __future__ import annotations

import os
from pathlib import Path

from collaudit.core.errors import LogError

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
