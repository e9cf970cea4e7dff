"""The index that an MCAP file's summary states, and a walk over the file that jumps over chunks by its word.

What the summary says of a chunk is compared with the chunk when it is read; the counts that it states are compared with
the messages that were found, as of any file.
"""

from __future__ import annotations

import struct
from dataclasses import replace

from collaudit.core.logs.mcap.mcap_scan import (
    CHANNEL,
    CHUNK_INDEX,
    HEAD,
    MAGIC,
    SCHEMA,
    STATISTICS,
    ChunkRef,
    McapIndex,
    Scan,
    chunk_records,
)
from collaudit.core.logs.storage.file_reading import RandomFile

_MAX_SUMMARY = 256 << 20
_TAIL = 8 + 20 + 9


def ranged_index(file: RandomFile) -> McapIndex | None:
    """What a walk over the file finds that steps from each chunk that the summary names to what follows it.

    Args:
        file: an MCAP file, its magic already seen.

    Returns:
        Chunks as the summary states them (``extent`` above 0), to be looked up by :func:`looked_up` before they are
        read. None where the file has no usable summary, or does not lie as its summary says.
    """
    summary = read_summary(file)
    if summary is None or not summary.chunks:
        return None
    known = {chunk.at: chunk for chunk in summary.chunks}
    if len(known) != len(summary.chunks) or any(not chunk.extent for chunk in summary.chunks):
        return None
    index = Scan(file, known).run()
    jumped = sum(1 for chunk in index.chunks if chunk.extent)
    return None if index.damage or jumped != len(known) else index


def looked_up(file: RandomFile, stated: ChunkRef) -> ChunkRef | None:
    """A chunk as it lies in the file, with its message indexes; None where the summary says something else of it."""
    walk = Scan(file)
    walk.window, walk.base = file.read(stated.at, stated.extent), stated.at
    at, stop = stated.at, stated.at + stated.extent
    while at < stop:
        after = walk.step(at)
        if after is None:
            return None
        at = after
    found = walk.index.chunks
    if at != stop or len(found) != 1 or walk.index.damage:
        return None
    alike = replace(found[0], crc=0, index=(), extent=0) == replace(stated, crc=0, index=(), extent=0)
    held = {number for number, _, _ in found[0].index} == {number for number, _, _ in stated.index}
    return found[0] if alike and held else None


def read_summary(file: RandomFile) -> McapIndex | None:
    """Channels, chunks and statistics as the summary states them, or None when there is no usable one.

    Args:
        file: an MCAP file, its magic already seen.
    """
    tail = file.read(max(file.size - _TAIL, 0), _TAIL)
    if len(tail) < _TAIL or tail[-8:] != MAGIC or tail[0] != 2:
        return None
    start, _, _ = struct.unpack_from("<QQI", tail, HEAD.size)
    size = file.size - _TAIL - start
    if start < len(MAGIC) or not 0 < size <= _MAX_SUMMARY:
        return None
    index = McapIndex()
    data = file.read(start, size)
    for op, at, length in chunk_records(data):
        body = data[at + 9 : at + 9 + length]
        if op in (SCHEMA, CHANNEL, STATISTICS):
            index.record(op, body)
        elif op == CHUNK_INDEX:
            chunk = _chunk(body, file.size)
            if chunk is None:
                return None
            index.chunks.append(chunk)
            if chunk.index:  # a chunk without messages states zeros
                index.chunk_spans_ns.append(struct.unpack_from("<QQ", body))
    usable = bool(index.channels) and bool(index.counts) and index.span_ns is not None and not index.damage
    return index if usable else None


def _chunk(body: bytes, file_size: int) -> ChunkRef | None:
    """A chunk by its index record; the arrays of its message indexes are not located, only their channels."""
    try:
        at, length, offsets = struct.unpack_from("<QQI", body, 16)
        channels = [number for number, _ in struct.iter_unpack("<HQ", body[36 : 36 + offsets // 10 * 10])]
        rest = 36 + offsets + 8
        indexes, name = struct.unpack_from("<QI", body, rest - 8)
        compression = body[rest + 4 : rest + 4 + name].decode("ascii")
        compressed, size = struct.unpack_from("<QQ", body, rest + 4 + name)
    except (struct.error, UnicodeDecodeError):
        return None
    data_at = at + 9 + 40 + name
    if data_at + compressed > file_size:
        return None
    held = tuple((number, 0, 0) for number in channels)
    whole = data_at + compressed == at + length and at + length + indexes <= file_size
    extent = length + indexes if whole else 0
    return ChunkRef(at, data_at, compressed, size, 0, compression, held, extent=extent)
