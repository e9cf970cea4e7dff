"""Where the messages of one decompressed MCAP chunk lie: by its message index, proven against the bytes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from collaudit.core.logs.mcap.mcap_run import MESSAGE
from collaudit.core.logs.mcap.mcap_scan import CHANNEL, MESSAGE_HEAD, SCHEMA, chunk_records
from collaudit.core.logs.storage.message_places import ascending, gather
from collaudit.core.logs.storage.records import Batch, ByteArray
from collaudit.core.numeric.arrays import IntArray

_HEAD = np.dtype([("op", "u1"), ("length", "<u8"), ("channel", "<u2"), ("seq", "<u4"), ("log", "<u8"), ("pub", "<u8")])

#: What chunks hold (mcap.dev/spec). So many other records are passed over, and so many schemas and channels taken.
_OF_CHUNKS = (SCHEMA, CHANNEL, MESSAGE)
_MOST_FOREIGN, _MOST_OTHERS = 10_000, 1 << 18

#: Messages after which a turn of topics is looked for to begin again.
_LONGEST_TURN = 16

Heads = np.ndarray[tuple[int], np.dtype[np.void]]


@dataclass(frozen=True, slots=True, eq=False)
class Located:
    """Messages of a chunk in the order they lie in it.

    Attributes:
        start, length: (n,) payload offsets and sizes.
        channel: (n,) channel numbers.
        log_ns: (n,) log times.
        publish_ns: (n,) publish times.
        others: (op, offset, length) of schemas and channels.
        rest: bytes at the end that are no whole record.
    """

    start: IntArray
    length: IntArray
    channel: IntArray
    log_ns: IntArray
    publish_ns: IntArray
    others: tuple[tuple[int, int, int], ...]
    rest: int


@dataclass(frozen=True, slots=True, eq=False)
class Sorted:
    """Messages by their channels.

    Attributes:
        counts: channel to how many of its messages were found, in order of their numbers.
        batches: the messages of the channels that are wanted.
    """

    counts: dict[int, int]
    batches: list[Batch]


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
    if offsets.shape[0] and _plausible(view, offsets):
        heads = heads_of(view, offsets)
        sizes = heads["length"].astype(np.int64)
        if (heads["op"] == MESSAGE).all() and int(sizes.min()) >= 22 and int(sizes.max()) <= len(data):
            gaps = _gaps(offsets, offsets + (9 + sizes), len(data))
            if gaps is not None:
                return _walked(data, view, gaps, offsets, heads)
    return _walked(data, view, [(0, len(data))], np.empty(0, np.int64), None)


def _plausible(view: ByteArray, offsets: IntArray) -> bool:
    return bool(offsets[0] >= 0 and offsets[-1] + MESSAGE_HEAD <= view.shape[0])


def heads_of(view: ByteArray, offsets: IntArray) -> Heads:
    """(n,) heads of the message records at offsets, each wholly inside the bytes."""
    rows: Heads = gather(view, offsets, MESSAGE_HEAD).view(_HEAD).ravel()
    return rows


def _gaps(offsets: IntArray, ends: IntArray, size: int) -> list[tuple[int, int]] | None:
    """The stretches of a chunk between messages, mostly none; None where messages overlap or reach beyond the chunk."""
    bounds = [(0, int(offsets[0])), (int(ends[-1]), size)]
    if not (ends[:-1] == offsets[1:]).all():
        apart = np.flatnonzero(ends[:-1] != offsets[1:])
        bounds[1:1] = zip(ends[apart].tolist(), offsets[apart + 1].tolist(), strict=True)
    if any(start > stop for start, stop in bounds):
        return None
    return [(start, stop) for start, stop in bounds if start < stop]


def _walked(data: bytes, view: ByteArray, gaps: list[tuple[int, int]], known: IntArray, heads: Heads | None) -> Located:
    """Walk the gaps record by record, and put together what is known and what they hold."""
    found: list[int] = []
    others: list[tuple[int, int, int]] = []
    rest = foreign = 0
    for start, stop in gaps:
        last = start
        for op, at, length in chunk_records(data, start, stop):
            if op not in _OF_CHUNKS:
                foreign += 1
                if op == 0 or foreign > _MOST_FOREIGN:  # no record begins so: the rest is none, however long
                    break
            last = at + 9 + length
            if op == MESSAGE and length >= 22:
                found.append(at)
            elif op in (SCHEMA, CHANNEL) and len(others) < _MOST_OTHERS:
                others.append((op, at, length))
        rest += stop - last
    offsets = known
    if found:
        offsets = np.sort(np.concatenate([known, np.array(found, dtype=np.int64)]))
    if heads is None or found:
        heads = heads_of(view, offsets)
    return located_of(offsets, heads["length"].astype(np.int64), heads, tuple(others), rest)


def located_of(
    offsets: IntArray, sizes: IntArray, heads: Heads, others: tuple[tuple[int, int, int], ...] = (), rest: int = 0
) -> Located:
    """Messages by the offsets and body sizes of their records, and their heads."""
    return Located(
        start=offsets + MESSAGE_HEAD,
        length=sizes - 22,
        channel=heads["channel"].astype(np.int64),
        log_ns=heads["log"].astype(np.int64),
        publish_ns=heads["pub"].astype(np.int64),
        others=others,
        rest=rest,
    )


def by_channel(data: ByteArray, located: Located, wanted: frozenset[int]) -> Sorted:
    """Sort messages by channel.

    Args:
        data: the bytes they lie in.
        located: where.
        wanted: channels whose messages are handed on; those of others are counted.
    """
    out = Sorted({}, [])
    for number, mine in _places(located.channel):
        start = located.start[mine]
        out.counts[number] = start.shape[0]
        if number in wanted:
            times = located.log_ns[mine], located.publish_ns[mine]
            out.batches.append(Batch(number, data, start, located.length[mine], *times))
    return out


def _places(channel: IntArray) -> list[tuple[int, slice | IntArray]]:
    """Each channel met, in order of their numbers, with the places of its messages.

    Recorders mostly write the same topics in turn: their messages are then a slice each.
    """
    head = channel[: _LONGEST_TURN + 1].tolist()
    turn = head.index(head[0], 1) if head and head[0] in head[1:] else len(head)
    if len(set(head[:turn])) == turn and (channel[turn:] == channel[:-turn]).all():
        return [(head[place], slice(place, None, turn)) for place in sorted(range(turn), key=lambda place: head[place])]
    numbers = np.flatnonzero(np.bincount(channel)).tolist()
    return [(number, np.flatnonzero(channel == number)) for number in numbers]
