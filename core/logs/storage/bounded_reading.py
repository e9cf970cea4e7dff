"""Reading logs that are not trusted: how much may come out of one, decompression within that, files read by chunks.

A small file can honestly hold very much: 8 MB of zeros compressed are gigabytes. What is read is counted before memory
is taken for it, against bounds that follow the size of the file; a chunk is never decompressed beyond what it claims,
and of a damaged one comes what can be had. What MCAP files and ROS 1 bags share, their messages lying in chunks, is
read at places, whatever a file says about itself.
"""

from __future__ import annotations

import bz2
import gzip
import lzma
import os
import zipfile
import zlib
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from io import BufferedIOBase, BytesIO
from pathlib import Path
from typing import Any, cast

import lz4.frame
import zstandard

from collaudit.core.errors import LogError
from collaudit.core.logs.storage.readers import Batch, Channel, DamageNotes, Located
from collaudit.core.numeric.parallel import Progress, ordered_map

#: Memory that a number of a joint takes until the log is judged (measured: 1.87 GB for 12.6 million samples of a joint
#: with position, velocity and effort), and that of the program without a log.
VALUE_BYTES, BASE_BYTES = 50, 250_000_000
#: Memory for a log when the configuration states none: so many times the size of its files, within these bounds.
MEMORY_TIMES, LEAST_MEMORY, MOST_MEMORY = 100, 1_000_000_000, 16_000_000_000
#: What a file may be decompressed into: so many times its size, and always so many bytes. A chunk of it, bytes.
EXPANSION, FREE_BYTES, CHUNK_BYTES = 100, 256_000_000, 128_000_000
#: Numbers of one sample or columns of a table, at most.
MOST_COLUMNS = 30_000
#: Sets of joints on one topic; each takes memory of its own.
MOST_LAYOUTS = 1000
#: A compressed file may become this large, or so many times its size; a table too, all of which is in memory at once.
FREE_FILE_BYTES, FILE_RATIO = 64 << 20, 1000
FREE_TABLE_BYTES, TABLE_RATIO = 128_000_000, 25
#: Bytes that are decompressed at a time.
_STEP = 1 << 16
#: Compressed bytes taken at a time: whatever they claim, they cannot fill the memory.
_ZSTD_PIECE = 1 << 11
_OF_CHUNKS = ("zstd", "lz4", "bz2")
#: What the decompressors raise on damaged files.
DECOMPRESSION_ERRORS = (
    OSError, EOFError, RuntimeError, lzma.LZMAError, zlib.error, zstandard.ZstdError, zipfile.BadZipFile
)  # fmt: skip
_ERRORS = (*DECOMPRESSION_ERRORS, ValueError, MemoryError)


def plausible_table(file_bytes: int, claimed: int) -> bool:
    """Whether a file of so many bytes may be read as a table of ``claimed`` bytes."""
    return claimed <= max(FREE_TABLE_BYTES, TABLE_RATIO * file_bytes)


class ReadingBounds:
    """Counts what is read of one log; each method raises LogError where a bound is exceeded."""

    def __init__(self, file_bytes: int, where: str, memory_gb: float | None = None) -> None:
        """``file_bytes``: of all files of the log; ``where``: what messages call it; ``memory_gb``: as is stated."""
        self._where = where
        self.memory_bytes = min(max(MEMORY_TIMES * file_bytes, LEAST_MEMORY), MOST_MEMORY)
        if memory_gb is not None:
            self.memory_bytes = int(memory_gb * 1e9)
        self.decoded_bytes = max(EXPANSION * file_bytes, FREE_BYTES)
        self.chunk_bytes = CHUNK_BYTES
        self._bytes = self._values = 0

    @classmethod
    def of(cls, files: Sequence[Path], where: str, memory_gb: float | None = None) -> ReadingBounds:
        """Bounds by the sizes of files."""
        return cls(sum(file.stat().st_size for file in files), where, memory_gb)

    def take_bytes(self, count: int) -> None:
        """Bytes that come out of compression."""
        self._bytes += count
        if self._bytes > self.decoded_bytes:
            found, most = f"{self._bytes:,} bytes", f"{self.decoded_bytes:,}"
            self._refuse("decompresses into", found, most, "decompress it, and judge the larger file")

    def take_values(self, rows: int, width: int) -> None:
        """Samples that are kept: ``rows`` of ``width`` numbers."""
        self.check_columns(width)
        self._values += rows * width
        needed = BASE_BYTES + VALUE_BYTES * self._values
        if needed > self.memory_bytes:
            found = f"{self._values:,} numbers, which take about {needed / 1e9:.2g} GB"
            enough = f"state [log] memory_gb = {2 * int(needed // 1e9) + 1}"
            self._refuse("holds", found, f"{self.memory_bytes / 1e9:.3g} GB", enough)

    def check_columns(self, count: int) -> None:
        """Numbers in a row."""
        if count > MOST_COLUMNS:
            found = f"{count:,} numbers in a sample"
            self._refuse("holds", found, f"{MOST_COLUMNS:,}", "keep the columns of the joints")

    def check_layouts(self, count: int) -> None:
        """Sets of joints on one topic."""
        if count > MOST_LAYOUTS:
            raise LogError(
                "holds changing sets of joints on one topic",
                where=self._where,
                found=f"{count:,}",
                expected=f"at most {MOST_LAYOUTS:,}",
            )

    def _refuse(self, verb: str, found: str, most: str, way: str) -> None:
        raise LogError(
            f"{verb} more than a log of this size is read for",
            where=self._where,
            found=found,
            expected=f"at most {most}",
            hint=f"if the log is genuine, {way}",
        )


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
