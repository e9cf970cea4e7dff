"""Bounded decompression: of chunks never more than was claimed, and what can be had of a damaged one; of streams."""

from __future__ import annotations

import bz2
import gzip
import lzma
import zipfile
import zlib
from collections.abc import Callable
from contextlib import suppress
from io import BufferedIOBase, BytesIO
from pathlib import Path
from typing import Any, cast

import lz4.frame
import zstandard

_STEP = 1 << 16
#: Compressed bytes taken at a time: whatever they claim, they cannot fill the memory.
_ZSTD_PIECE = 1 << 11
_OF_CHUNKS = ("zstd", "lz4", "bz2")
#: What the decompressors raise on damaged files.
DECOMPRESSION_ERRORS = (
    OSError, EOFError, RuntimeError, lzma.LZMAError, zlib.error, zstandard.ZstdError, zipfile.BadZipFile
)  # fmt: skip
_ERRORS = (*DECOMPRESSION_ERRORS, ValueError, MemoryError)


class _Zstd(BufferedIOBase):
    """Frames of zstd one after the other; unlike the package's reader it tells a cut file from a whole one."""

    def __init__(self, source: Path | BytesIO) -> None:
        self._file = source.open("rb") if isinstance(source, Path) else source
        self._frame: Any = None

    def read1(self, size: int = -1, /) -> bytes:
        """The next bytes that can be had at once; none at the end."""
        while piece := self._file.read(_ZSTD_PIECE):
            parts = []
            while piece:
                if self._frame is None:
                    self._frame = zstandard.ZstdDecompressor().decompressobj()
                parts.append(self._frame.decompress(piece))
                piece = self._frame.unused_data
                if self._frame.eof:
                    self._frame = None
            if data := b"".join(parts):
                return data
        if self._frame is not None:
            raise EOFError("the file ended inside a frame")
        return b""

    def close(self) -> None:
        """Release the file."""
        self._file.close()
        super().close()


#: What opens a file that is compressed with a method.
_OPENED: dict[str, Callable[[Any, Any], Any]] = {
    "gzip": gzip.open, "xz": lzma.open, "lz4": lz4.frame.open, "bz2": bz2.open, "zstd": lambda source, _: _Zstd(source),
}  # fmt: skip


def decompressor(source: Path | BytesIO, method: str) -> BufferedIOBase:
    """The decompressed bytes of a file: ``gzip``, ``xz``, ``lz4``, ``bz2`` or ``zstd``."""
    return cast(BufferedIOBase, _OPENED[method](source, "rb"))


def unpack(kind: str, data: bytes, size: int, most: int) -> tuple[bytes, str | None]:
    """Decompress a chunk that claims to hold ``size`` bytes.

    Args:
        kind: "", ``none``, ``zstd``, ``lz4`` or ``bz2``.
        data: the compressed bytes, possibly cut short.
        size: the size the file claims.
        most: bytes that it may become.

    Returns:
        The bytes, as many as could be had, and the problem when they are not all, else None.
    """
    if kind in ("", "none"):
        return data, None if len(data) == size else f"it holds {len(data)} of {size} bytes"
    if kind not in _OF_CHUNKS:
        return b"", f"its compression {kind[:20]!r} is not supported"
    if size > most:
        return b"", f"it claims {size} bytes in {len(data)} compressed ones"
    out, _ = bounded(kind, data, size + 1)
    if len(out) > size:
        return out[:size], f"it holds more than the {size} bytes that it claims"
    return out, None if len(out) == size else f"only {len(out)} of its {size} bytes could be decompressed"


def bounded(kind: str, data: bytes, limit: int) -> tuple[bytes, str | None]:
    """Decompress what need not say how large it is.

    Args:
        kind: ``zstd``, ``lz4`` or ``bz2``.
        data: a compressed stream, possibly damaged.
        limit: bytes that it may become.

    Returns:
        What could be had of it, less than ``limit`` bytes where that is all, and the problem, or None.
    """
    if kind == "zstd":
        with suppress(*_ERRORS):  # at once where the frame is whole, which is faster
            if zstandard.frame_content_size(data) <= limit:
                return zstandard.ZstdDecompressor().decompress(data, max_output_size=limit), None
    parts: list[bytes] = []
    have = 0
    try:
        stream = decompressor(BytesIO(data), kind)
        while have < limit and (part := stream.read1(min(_STEP, limit - have))):
            parts.append(part)
            have += len(part)
    except _ERRORS as error:
        return b"".join(parts)[:limit], str(error) or type(error).__name__
    return b"".join(parts)[:limit], f"it becomes {limit} bytes or more" if have >= limit else None
