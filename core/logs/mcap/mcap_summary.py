"""The summary section of an MCAP file: what is in a huge file, without walking over it."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np

from collaudit.core.logs.mcap.mcap_file import McapFile
from collaudit.core.logs.mcap.mcap_scan import (
    CHANNEL,
    CHUNK_INDEX,
    HEAD,
    MAGIC,
    SCHEMA,
    STATISTICS,
    ChunkRef,
    McapIndex,
    chunk_records,
)
from collaudit.core.logs.signals.impossible_values import garbage_stamps
from collaudit.core.logs.storage.file_reading import RandomFile
from collaudit.core.logs.storage.records import Overview

_MAX_SUMMARY = 256 << 20
_TAIL = 8 + 20 + 9


def overview_of(path: Path) -> Overview | None:
    """Counts and times as a file's summary states them, and a reader of one chunk of each channel.

    Args:
        path: an MCAP file.

    Returns:
        None when the file has no usable summary, or schemas that stand in none of these chunks.
    """
    file = RandomFile(path)
    index = read_summary(file)
    file.close()
    if index is None or index.span_ns is None:
        return None
    text = (
        f"Only the summary and the first chunk of each topic were read, of {len(index.chunks)} chunks: rates are means "
        "over the whole log; gaps, clocks and damage inside the chunks were not looked for."
    )
    reader = McapFile(path, _first_chunks(index))
    if reader.index.lacks_schemas():
        reader.close()
        return None
    first, last, astray = _plausible_span(index)
    if astray:
        text += f" Times that are none of this recording stand in {astray} of the chunks; the length leaves them out."
    return Overview(reader, index.counts, (first, last), text)


def _plausible_span(index: McapIndex) -> tuple[int, int, int]:
    """First and last time by the chunks' own, without garbage, and how many chunks have some."""
    assert index.span_ns is not None
    spans = np.array(index.chunk_spans_ns, dtype=np.uint64).reshape(-1, 2)
    far = garbage_stamps(spans.ravel() / 1e9).reshape(-1, 2)
    if not far.any():
        return (*index.span_ns, 0)
    good = spans[~far]
    return int(good.min()), int(good.max()), int(np.count_nonzero(far.any(axis=1)))


def _first_chunks(index: McapIndex) -> McapIndex:
    """An index of the first chunk that holds each channel, and no others."""
    chosen: dict[int, ChunkRef] = {}
    left = set(index.channels)
    for chunk in index.chunks:
        held = {number for number, _, _ in chunk.index}
        if held & left or not held:
            chosen[chunk.at] = ChunkRef(
                chunk.at, chunk.data_at, chunk.data_size, chunk.size, chunk.crc, chunk.compression
            )
            left -= held
        if not left or len(chosen) > 16:
            break
    return McapIndex(index.schemas, index.channels, list(chosen.values()), span_ns=index.span_ns)


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
        at, _, offsets = struct.unpack_from("<QQI", body, 16)
        channels = [number for number, _ in struct.iter_unpack("<HQ", body[36 : 36 + offsets // 10 * 10])]
        rest = 36 + offsets + 8
        (name,) = struct.unpack_from("<I", body, rest)
        compression = body[rest + 4 : rest + 4 + name].decode("ascii")
        compressed, size = struct.unpack_from("<QQ", body, rest + 4 + name)
    except (struct.error, UnicodeDecodeError):
        return None
    data_at = at + 9 + 40 + name
    if data_at + compressed > file_size:
        return None
    return ChunkRef(at, data_at, compressed, size, 0, compression, tuple((number, 0, 0) for number in channels))
