"""Where the messages of one decompressed MCAP chunk lie: by its message index, proven against the bytes."""

from __future__ import annotations

import numpy as np

from collaudit.core.logs.mcap.mcap_records import CHANNEL, MESSAGE, MESSAGE_HEAD, SCHEMA, record_places
from collaudit.core.logs.storage.message_places import Located, ascending, gaps_between, gather
from collaudit.core.logs.storage.records import ByteArray
from collaudit.core.numeric.arrays import IntArray

_HEAD = np.dtype([("op", "u1"), ("length", "<u8"), ("channel", "<u2"), ("seq", "<u4"), ("log", "<u8"), ("pub", "<u8")])
#: Bytes of a message's body before its payload.
_LEAST = 22
#: What chunks hold (mcap.dev/spec). So many other records are passed over, and so many schemas and channels taken.
_OF_CHUNKS = (SCHEMA, CHANNEL, MESSAGE)
_MOST_FOREIGN, _MOST_OTHERS = 10_000, 1 << 18


def locate(data: bytes, index_offsets: IntArray) -> Located:
    """Find every message of a chunk.

    The offsets of the message indexes are used when each is the start of a message; what lies between the
    messages is walked record by record, so that a message missing from the index is found all the same.

    Args:
        data: the chunk's records.
        index_offsets: (m,) offsets from its message indexes, any order; may be empty or wrong.
    """
    view = np.frombuffer(data, dtype=np.uint8)
    offsets = ascending(index_offsets)
    gaps = _gaps(view, offsets)
    if gaps is None:
        offsets, gaps = np.empty(0, np.int64), [(0, len(data))]
    found, others, rest = _walked(data, gaps)
    if found:
        offsets = np.sort(np.concatenate([offsets, np.array(found, dtype=np.int64)]))
    heads = _heads_of(view, offsets)
    return Located(
        start=offsets + MESSAGE_HEAD,
        length=heads["length"].astype(np.int64) - _LEAST,
        channel=heads["channel"].astype(np.int64),
        log_ns=heads["log"].astype(np.int64),
        others=others,
        rest=rest,
    )


def _heads_of(view: ByteArray, offsets: IntArray) -> np.ndarray[tuple[int], np.dtype[np.void]]:
    heads: np.ndarray[tuple[int], np.dtype[np.void]] = gather(view, offsets, MESSAGE_HEAD).view(_HEAD).ravel()
    return heads


def _gaps(view: ByteArray, offsets: IntArray) -> list[tuple[int, int]] | None:
    """The stretches of a chunk between messages, mostly none; None unless each offset is the start of a message."""
    size = view.shape[0]
    if not offsets.shape[0] or offsets[0] < 0 or offsets[-1] + MESSAGE_HEAD > size:
        return None
    heads = _heads_of(view, offsets)
    sizes = heads["length"]
    if not (heads["op"] == MESSAGE).all() or sizes.min() < _LEAST or sizes.max() > size:
        return None
    return gaps_between(offsets, offsets + 9 + sizes.astype(np.int64), size)


def _walked(data: bytes, gaps: list[tuple[int, int]]) -> tuple[list[int], list[tuple[int, int, int]], int]:
    """What gaps hold, record by record: offsets of messages, schemas and channels, and bytes that are no record."""
    found: list[int] = []
    others: list[tuple[int, int, int]] = []
    rest = foreign = 0
    for start, stop in gaps:
        last = start
        for op, at, length in record_places(data, start, stop):
            if op not in _OF_CHUNKS:
                foreign += 1
                if op == 0 or foreign > _MOST_FOREIGN:  # no record begins so: the rest is none, however long
                    break
            last = at + 9 + length
            if op == MESSAGE and length >= _LEAST:
                found.append(at)
            elif op in (SCHEMA, CHANNEL) and len(others) < _MOST_OTHERS:
                others.append((op, at, length))
        rest += stop - last
    return found, others, rest
