"""The index that an MCAP file's summary states, and a walk over the file that jumps over chunks by its word.

What the summary says of a chunk is compared with the chunk when it is read; the counts that it states are compared with
the messages that were found, as of any file.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from collaudit.core.logs.mcap.mcap_records import (
    CHANNEL,
    CHUNK_INDEX,
    SCHEMA,
    STATISTICS,
    McapIndex,
    parsed,
    record_places,
    summary_of,
)
from collaudit.core.logs.mcap.mcap_scan import Scan
from collaudit.core.logs.storage.chunked_file import ChunkRef
from collaudit.core.logs.storage.file_reading import RandomFile


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
    data = summary_of(file)
    index = McapIndex()
    for op, at, length in record_places(data):
        body = data[at + 9 : at + 9 + length]
        if op in (SCHEMA, CHANNEL, STATISTICS):
            index.record(op, body)
        elif op == CHUNK_INDEX:
            stated = parsed(op, body)
            chunk = None if stated is None else _chunk(stated, file.size)
            if chunk is None:
                return None
            index.chunks.append(chunk)
            if chunk.index:  # a chunk without messages states zeros
                index.chunk_spans_ns += [stated.message_start_time, stated.message_end_time]
    usable = bool(index.channels) and bool(index.counts) and index.span_ns is not None and not index.damage
    return index if usable else None


def _chunk(stated: Any, file_size: int) -> ChunkRef | None:
    """A chunk by its index record; the arrays of its message indexes are not located, only their channels."""
    at, size = stated.chunk_start_offset, stated.compressed_size
    data_at = at + 9 + 40 + len(stated.compression)
    if data_at + size > file_size or not stated.compression.isascii():
        return None
    end = at + stated.chunk_length
    whole = data_at + size == end and end + stated.message_index_length <= file_size
    extent = stated.chunk_length + stated.message_index_length if whole else 0
    held = tuple((number, 0, 0) for number in stated.message_index_offsets)
    return ChunkRef(at, data_at, size, stated.uncompressed_size, stated.compression, held, extent=extent)
