"""Bounded decompression: of chunks never more than was claimed, and what can be had of a damaged one; of streams."""

from __future__ import annotations

import bz2
import gzip
import lzma
import zipfile
import zlib
from collections.abc import Callable
from io import BufferedIOBase, BytesIO
from pathlib import Path
from typing import Any, cast

import lz4.frame
import zstandard

from collaudit.core.logs.storage.chunked_file import MAX_CHUNK_BYTES, plausible_size

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


def unpack(kind: str, data: bytes, size: int, most: int = MAX_CHUNK_BYTES) -> tuple[bytes, str | None]:
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
    if not plausible_size(len(data), size, most):
        return b"", f"it claims {size} bytes in {len(data)} compressed ones"
    try:
        out, _ = _frame(kind, data, size + 1)
        if len(out) == size:
            return out, None
    except _ERRORS:
        pass
    out = _salvage(kind, data, size + 1)
    if len(out) > size:
        return out[:size], f"it holds more than the {size} bytes that it claims"
    return out, f"only {len(out)} of its {size} bytes could be decompressed"


def bounded(kind: str, data: bytes, limit: int) -> tuple[bytes, str | None]:
    """Decompress what need not say how large it is.

    Args:
        kind: ``zstd`` or ``lz4``.
        data: one whole compressed frame.
        limit: bytes that it may become.

    Returns:
        All of the bytes and None, or none and the problem.
    """
    try:
        out, ended = _frame(kind, data, limit)
        return (out, None) if ended else (b"", f"it ends early, or becomes more than {limit} bytes")
    except _ERRORS as error:
        return b"", str(error) or type(error).__name__


def _frame(kind: str, data: bytes, limit: int) -> tuple[bytes, bool]:
    """The bytes of a frame, at most so many, and whether it ended with them."""
    stream: Any
    if kind == "zstd":
        if zstandard.frame_content_size(data) > limit:
            raise ValueError(f"it claims more than {limit} bytes")
        return zstandard.ZstdDecompressor().decompress(data, max_output_size=limit), True
    stream = lz4.frame.LZ4FrameDecompressor() if kind == "lz4" else bz2.BZ2Decompressor()
    return bytes(stream.decompress(data, max_length=limit)), stream.eof


def _salvage(kind: str, data: bytes, size: int) -> bytes:
    """What a damaged stream yields before the damage, taken in small steps."""
    parts: list[bytes] = []
    have = 0
    try:
        stream = decompressor(BytesIO(data), kind)
        while have < size and (part := stream.read1(min(_STEP, size - have))):
            parts.append(part)
            have += len(part)
    except _ERRORS:
        pass
    return b"".join(parts)[:size]
