"""Decompressed text as a stream: bounded, and ending at the last whole line before damage."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

from collaudit.core.errors import LogError
from collaudit.core.logs.storage.decompression import DECOMPRESSION_ERRORS
from collaudit.core.logs.storage.file_reading import plausible_table
from collaudit.core.logs.storage.packed_file import opened_packed

_PIECE = 1 << 18
_LONGEST_LINE = 1 << 24


class BoundedStream(io.RawIOBase):
    """A decompressed file that refuses to become implausibly larger than the file is.

    Text is handed on by whole lines: where the file turns out to be damaged, the line before is the last, and
    :attr:`damage` says so.
    """

    def __init__(self, path: Path, method: str) -> None:
        self._path = path
        self._size = path.stat().st_size
        self._inner = opened_packed(path, method)
        self._given = 0
        self._lines = memoryview(b"")
        self._rest = b""
        self._ended = False
        self.damage: str | None = None

    def readable(self) -> bool:
        """Always."""
        return True

    def readinto(self, buffer: Any) -> int:
        """Fill a buffer.

        Raises:
            LogError: the file decompresses into more than can be trusted.
        """
        while not self._lines and not self._ended:
            self._more()
        count = min(len(buffer), len(self._lines))
        buffer[:count] = self._lines[:count]
        self._lines = self._lines[count:]
        return count

    def _more(self) -> None:
        """Decompress a piece and set its whole lines free."""
        try:
            data = self._inner.read1(_PIECE)
        except DECOMPRESSION_ERRORS as error:
            if not self._given:
                raise
            self.damage = f"it cannot be decompressed beyond {self._given} bytes of text ({error})"
            self._ended = True
            return
        self._given += len(data)
        if not plausible_table(self._size, self._given):
            raise LogError(
                "decompresses into more than its size allows",
                where=str(self._path),
                found=f"{self._given} bytes from {self._size}",
                hint="if the log is genuine, unpack it first",
            )
        whole = len(data) if not data else data.rfind(b"\n") + 1
        self._ended = not data
        if whole or self._ended:
            self._lines, self._rest = memoryview(self._rest + data[:whole]), data[whole:]
        else:
            self._rest += data
            if len(self._rest) > _LONGEST_LINE:  # a line that never ends costs the square of its length to collect
                raise LogError(
                    "decompresses into a line that is too long for a table",
                    where=str(self._path),
                    found=f"more than {_LONGEST_LINE >> 20} MB without an end of line",
                )

    def close(self) -> None:
        """Close it and the file below."""
        if not self.closed:
            self._inner.close()
        super().close()
