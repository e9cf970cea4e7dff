"""Bounded decompression of chunks: never more than was claimed, and what can be had of a damaged one."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from collaudit.core.logs.storage.file_reading import MAX_CHUNK_BYTES, plausible_size

_STEP = 1 << 16
#: Of each thread: what keeps its memory from chunk to chunk.
_OWN = threading.local()


@dataclass(frozen=True, slots=True)
class Unpacked:
    """A chunk's bytes, and what was wrong with it (None when nothing was)."""

    data: bytes
    problem: str | None = None


class _Stream(Protocol):
    def read(self, limit: int) -> bytes:
        """The next bytes, at most ``limit``; none at the end."""


class _Zstd:
    def __init__(self, data: bytes) -> None:
        import zstandard

        self._reader = zstandard.ZstdDecompressor().stream_reader(data, read_across_frames=True)

    def read(self, limit: int) -> bytes:
        return self._reader.read(limit)


class _Lz4:
    def __init__(self, data: bytes) -> None:
        import lz4.frame

        self._object = lz4.frame.LZ4FrameDecompressor()
        self._data = data

    def read(self, limit: int) -> bytes:
        data, self._data = self._data, b""
        return b"" if self._object.eof else bytes(self._object.decompress(data, max_length=limit))


class _Bz2:
    def __init__(self, data: bytes) -> None:
        import bz2

        self._object = bz2.BZ2Decompressor()
        self._data = data

    def read(self, limit: int) -> bytes:
        data, self._data = self._data, b""
        return b"" if self._object.eof else self._object.decompress(data, max_length=limit)


_STREAMS: dict[str, Callable[[bytes], _Stream]] = {"zstd": _Zstd, "lz4": _Lz4, "bz2": _Bz2}


def _whole(kind: str, data: bytes, size: int) -> bytes:
    if kind == "zstd":
        import zstandard

        if zstandard.frame_content_size(data) not in (-1, size):
            raise ValueError("its frame claims another size than the chunk")
        if not hasattr(_OWN, "zstd"):
            _OWN.zstd = zstandard.ZstdDecompressor()
        out: bytes = _OWN.zstd.decompress(data, max_output_size=size)
        return out
    return _STREAMS[kind](data).read(size)


def unpack(kind: str, data: bytes, size: int, most: int = MAX_CHUNK_BYTES) -> Unpacked:
    """Decompress a chunk that claims to hold ``size`` bytes.

    Args:
        kind: "", ``none``, ``zstd``, ``lz4`` or ``bz2``.
        data: the compressed bytes, possibly cut short.
        size: the size the file claims.
        most: bytes that it may become.

    Returns:
        The bytes, as many as could be had, and the problem when they are not all.
    """
    if kind in ("", "none"):
        return Unpacked(data, None if len(data) == size else f"it holds {len(data)} of {size} bytes")
    if kind not in _STREAMS:
        return Unpacked(b"", f"its compression {kind[:20]!r} is not supported")
    if not plausible_size(len(data), size, most):
        return Unpacked(b"", f"it claims {size} bytes in {len(data)} compressed ones")
    if size == 0:
        return Unpacked(b"")
    try:
        out = _whole(kind, data, size)
        if len(out) == size:
            return Unpacked(out)
    except _errors():
        pass
    out = _salvage(kind, data, size)
    return Unpacked(out, f"only {len(out)} of its {size} bytes could be decompressed")


def bounded(kind: str, data: bytes, limit: int) -> Unpacked:
    """Decompress what need not say how large it is.

    Args:
        kind: ``zstd`` or ``lz4``.
        data: one whole compressed frame.
        limit: bytes that it may become.

    Returns:
        All of the bytes, or none and the problem.
    """
    try:
        if kind == "zstd":
            import zstandard

            if zstandard.frame_content_size(data) > limit:
                return Unpacked(b"", f"it claims more than {limit} bytes")
            return Unpacked(zstandard.ZstdDecompressor().decompress(data, max_output_size=limit))
        import lz4.frame

        stream = lz4.frame.LZ4FrameDecompressor()
        out = bytes(stream.decompress(data, max_length=limit))
        return Unpacked(out) if stream.eof else Unpacked(b"", f"it ends early, or becomes more than {limit} bytes")
    except _errors() as error:
        return Unpacked(b"", str(error) or type(error).__name__)


def _salvage(kind: str, data: bytes, size: int) -> bytes:
    """What a damaged stream yields before the damage, taken in small steps."""
    parts: list[bytes] = []
    have = 0
    try:
        stream = _STREAMS[kind](data)
        while have < size and (part := stream.read(min(_STEP, size - have))):
            parts.append(part)
            have += len(part)
    except _errors():
        pass
    return b"".join(parts)


def _errors() -> tuple[type[Exception], ...]:
    import zstandard

    return (zstandard.ZstdError, RuntimeError, OSError, ValueError, EOFError, MemoryError)
