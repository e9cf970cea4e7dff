"""The records of an MCAP file as they lie in it, found by walking over it once; nothing it claims is trusted.

Record layout: https://mcap.dev/spec. The data section is walked rather than the summary, so that files
without a summary, with a wrong one or cut short are read the same way.
"""

from __future__ import annotations

import struct
from dataclasses import replace

import numpy as np

from collaudit.core.logs.mcap.mcap_records import (
    CHANNEL,
    CHUNK,
    FOOTER,
    MAGIC,
    MAX_SMALL,
    MESSAGE,
    MESSAGE_HEAD,
    MESSAGE_INDEX,
    SCHEMA,
    STATISTICS,
    McapIndex,
)
from collaudit.core.logs.storage.chunked_file import ChunkRef, RandomFile
from collaudit.core.numeric.arrays import IntArray

_WINDOW = 1 << 13
#: Bytes of a chunk's record before its data, and more.
_CHUNK_HEAD = 128
_WIDE_WINDOW = 1 << 20
#: Bytes from the start of a message record up to the end of its log time.
LEAST_HEAD = 23
_LENGTH = struct.Struct("<Q").unpack_from


def scan(file: RandomFile) -> McapIndex:
    """Walk over the top-level records of a file.

    Args:
        file: an MCAP file, its magic already seen.

    Returns:
        Channels, chunks and loose messages up to the end or to the first damage.
    """
    return Scan(file).run()


def chunk_at(file: RandomFile, pos: int) -> ChunkRef | None:
    """The chunk that begins at a byte, as its own head states it; None where none does, or the file ends inside it."""
    walk = Scan(file)
    walk.width = _CHUNK_HEAD
    return walk.index.chunks[0] if walk.step(pos) is not None and walk.index.chunks else None


class Scan:
    """A walk over top-level records."""

    def __init__(self, file: RandomFile) -> None:
        self.file = file
        self.index = McapIndex()
        self.window = b""
        self.base = 0
        self.width = _WINDOW
        self.finished = False
        self.runs: list[IntArray] = []
        self.end = 0

    def run(self) -> McapIndex:
        """What it finds up to the end or to the first damage."""
        pos = len(MAGIC)
        while not self.finished and pos < self.file.size:
            nxt = self.step(pos)
            if nxt is None:
                break
            pos = nxt
        self._end_run()
        if not self.finished and not self.index.damage:
            cut = "it was cut short or is still being written"
            self.index.damage.note(f"it ends at byte {self.file.size} without a footer: {cut}")
        return self.index

    def view(self, pos: int, size: int) -> bytes:
        """``size`` bytes at ``pos``, through a window that is read ahead."""
        start = pos - self.base
        if start < 0 or start + size > len(self.window):
            self.window = self.file.read(pos, max(self.width, size))
            self.base = pos
            start = 0
        return self.window[start : start + size]

    def step(self, pos: int) -> int | None:
        """Take note of the record at ``pos``; where the next one begins, None at the end or at damage."""
        head = self.view(pos, 9)
        if len(head) < 9:
            self.index.damage.note(f"it ends at byte {self.file.size}, inside a record")
            return None
        op, length = int(head[0]), int.from_bytes(head[1:9], "little")
        if op == 0:
            self.index.damage.note(f"there is no record at byte {pos}")
            return None
        end = pos + 9 + length
        if op == CHUNK:
            return self.chunk(pos, length)
        if end > self.file.size:
            self.index.damage.note(f"it ends at byte {self.file.size}, inside a record that should reach byte {end}")
            return None
        if op == MESSAGE:
            return self.messages(pos)
        if op == MESSAGE_INDEX:
            self._message_index(pos, length)
        elif op == FOOTER:
            self._footer(end)
        elif op in (SCHEMA, CHANNEL, STATISTICS):
            if length <= MAX_SMALL:
                self.index.record(op, self.view(pos + 9, length))
            else:
                self.index.damage.note(f"a record of kind {op} at byte {pos} is {length} bytes long")
        return end

    def _footer(self, end: int) -> None:
        self.finished = True
        if self.file.read(end, 8) != MAGIC:
            self.index.damage.note("its closing magic is missing", lost=False)

    def chunk(self, pos: int, length: int) -> int | None:
        """Note a chunk; one that the file ends in is noted with the bytes that are there."""
        self._end_run()
        head = self.view(pos + 9, min(length, 64))
        try:
            size, crc, name = struct.unpack_from("<QII", head, 16)
            compression = head[32 : 32 + name].decode("ascii")
            (records,) = struct.unpack_from("<Q", head, 32 + name)
        except (struct.error, UnicodeDecodeError):
            self.index.damage.note(f"the chunk at byte {pos} has a malformed head")
            return None
        data_at = pos + 9 + 40 + name
        end = pos + 9 + length
        complete = end <= self.file.size and data_at + records <= end
        have = records if complete else max(0, min(records, self.file.size - data_at))
        self.index.chunks.append(ChunkRef(pos, data_at, have, size, compression, crc=crc))
        if not complete:
            self.index.damage.note(f"it ends at byte {self.file.size}, inside the chunk at byte {pos}")
            return None
        return end

    def _message_index(self, pos: int, length: int) -> None:
        head = self.view(pos + 9, 6)
        if len(head) < 6 or length < 6 or not self.index.chunks or self.index.chunks[-1].loose is not None:
            return
        number, size = struct.unpack("<HI", head)
        last = self.index.chunks[-1]
        entry = (number, pos + 15, min(size, length - 6) // 16 * 16)
        self.index.chunks[-1] = replace(last, index=(*last.index, entry))

    def messages(self, pos: int) -> int:
        """Note the messages that follow each other from ``pos``, as far as the window reaches."""
        self.width = _WIDE_WINDOW
        self.view(pos, MESSAGE_HEAD)
        base = self.base
        starts, after = message_run(self.window, pos - base)
        if starts.shape[0] and base + after > self.file.size:  # it is refused as any other record would be
            after = int(starts[-1])
            starts = starts[:-1]
        lengths = np.append(starts[1:], after)[: starts.shape[0]] - starts - 9
        whole = lengths >= 22
        for at, length in zip(starts[~whole].tolist(), lengths[~whole].tolist(), strict=True):
            self.index.damage.note(f"the message at byte {base + at} is only {length} bytes long")
        if whole.any():
            if self.runs and base + after - int(self.runs[0][0]) > _WIDE_WINDOW:
                self._end_run()
            self.runs.append(base + starts[whole])
            self.end = base + after
        return max(base + after, pos + 9)

    def _end_run(self) -> None:
        """Note the messages since the last chunk as one, whatever small records lie between them."""
        if self.runs:
            at = np.concatenate(self.runs)
            start, size = int(at[0]), self.end - int(at[0])
            self.index.chunks.append(ChunkRef(start, start, size, size, "", loose=at - start))
            self.runs = []


def message_run(window: bytes, at: int) -> tuple[IntArray, int]:
    """The messages that follow each other from one place.

    Args:
        window: a part of the file.
        at: where a record begins in it.

    Returns:
        (n,) offsets of the message records up to the first other record, or to one of which fewer than
        ``LEAST_HEAD`` bytes lie in the window; and the offset after the last, which may lie beyond the window.
    """
    out: list[int] = []
    last = len(window) - LEAST_HEAD
    while at <= last and window[at] == MESSAGE:
        out.append(at)
        at += 9 + _LENGTH(window, at + 1)[0]
    return np.array(out, dtype=np.int64), at
