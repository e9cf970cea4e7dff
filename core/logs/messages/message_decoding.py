"""Columnar decoding: batches of raw messages to stacked columns, one layout at a time.

Messages that share a layout and their joint names are decoded together as views into one byte matrix; every
message is checked against the layout first. Where messages have ever new layouts, each is decoded alone, in the same
way.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np

from collaudit.core.logs.messages.column_extraction import Plan, make_plan
from collaudit.core.logs.messages.decoded_columns import Decoded
from collaudit.core.logs.messages.layout import Layout, LayoutError, value_layouts, walk
from collaudit.core.logs.messages.message_schema import SchemaError, parse_schema
from collaudit.core.logs.storage.decompression import bounded
from collaudit.core.logs.storage.reading_bounds import FILE_RATIO
from collaudit.core.logs.storage.records import Batch, ByteArray, Channel, gather
from collaudit.core.numeric.arrays import BoolArray, IntArray
from collaudit.core.vendors.message_profiles import Profile

_ENCODINGS = ("cdr", "ros1", "json", "protobuf")
_MAGICS = {b"\x28\xb5\x2f\xfd": "zstd", b"\x04\x22\x4d\x18": "lz4"}
#: So many bytes are unpacked at once.
_AT_ONCE = 1 << 27
#: A message that becomes larger than this, and more than ``FILE_RATIO`` times its bytes, is refused.
_FREE_BYTES = 1 << 20
#: More layouts than this are not kept of one channel.
MAX_PLANS = 256


def packing_of(batch: Batch) -> str | None:
    """How the messages of a batch are compressed, by the first one; None when they are not."""
    if not batch.start.shape[0] or batch.length[0] < 4:
        return None
    start = int(batch.start[0])
    return _MAGICS.get(batch.data[start : start + 4].tobytes())


def unpacked(batch: Batch, kind: str) -> Iterator[tuple[Batch, list[str]]]:
    """The messages of a batch, decompressed, in their order and in blocks of bounded size.

    Args:
        batch: compressed messages.
        kind: as :func:`packing_of` names it.

    Returns:
        Those of each block that could be unpacked, and why each of the others could not.
    """
    rows: list[int] = []
    parts: list[bytes] = []
    problems: list[str] = []
    held, count = 0, batch.start.shape[0]
    for index in range(count):
        packed = batch.payload(index)
        data, problem = bounded(kind, packed, max(_FREE_BYTES, FILE_RATIO * len(packed)))
        if problem is None:
            rows.append(index)
            parts.append(data)
        else:
            problems.append(f"it is compressed as {kind} and cannot be unpacked: {problem}")
        held += len(data)
        if index == count - 1 or held >= _AT_ONCE:
            yield _joined(batch, rows, parts), problems
            rows, parts, problems, held = [], [], [], 0


def _joined(batch: Batch, rows: list[int], parts: list[bytes]) -> Batch:
    """Some messages of a batch, their payloads end to end in bytes of their own."""
    length = np.array([len(part) for part in parts], dtype=np.int64)
    data = np.frombuffer(b"".join(parts), dtype=np.uint8)
    return replace(batch, data=data, start=np.cumsum(length) - length, length=length, log_ns=batch.log_ns[rows])


@dataclass(frozen=True, slots=True, eq=False)
class _Rows:
    """Messages of one size.

    Attributes:
        data: (n, size) their bytes.
        log_ns: (n,) times of recording.
        places: (n,) which of the topic's messages they are.
    """

    data: ByteArray
    log_ns: IntArray
    places: IntArray

    def at(self, rows: slice | BoolArray) -> _Rows:
        """Some of them."""
        return _Rows(self.data[rows], self.log_ns[rows], self.places[rows])


def layouts_of(channel: Channel, extra: Mapping[str, Any] = {}) -> Callable[[bytes], Layout]:
    """What finds the fields of one message of a channel.

    Raises:
        SchemaError: the channel's encoding or definition is none that can be read.
    """
    if channel.encoding not in _ENCODINGS:
        raise SchemaError(f"messages encoded as {channel.encoding!r} are not read")
    if channel.encoding not in ("cdr", "ros1"):
        return value_layouts(channel)
    schema = parse_schema(channel.type, channel.encoding, channel.schema_encoding, channel.schema, extra)
    return partial(walk, schema, cdr=channel.encoding == "cdr")


def first_message(batch: Batch) -> bytes | None:
    """The first message of a batch as it was before it was compressed; None where there is none."""
    if not batch.start.shape[0]:
        return None
    kind, message = packing_of(batch), batch.payload(0)
    return message if kind is None else bounded(kind, message, max(_FREE_BYTES, FILE_RATIO * len(message)))[0]


@dataclass(slots=True, eq=False)
class ChannelDecoder:
    """Decodes one channel's batches into a topic's :class:`Decoded`.

    Attributes:
        channel: what is decoded.
        profile: which of its fields are meant.
        lay: finds the fields of one message.
        out: where the columns go; shared by the channels of one topic.
        max_plans: layouts that are kept for further messages; 0 where each message has one of its own.
    """

    channel: Channel
    profile: Profile
    lay: Callable[[bytes], Layout]
    out: Decoded
    max_plans: int = MAX_PLANS
    _plans: dict[int, list[Plan]] = field(default_factory=dict)

    @classmethod
    def of(cls, channel: Channel, profile: Profile, out: Decoded, extra: Mapping[str, Any] = {}) -> ChannelDecoder:
        """A decoder for a channel; JSON and protobuf have no layouts and go message by message.

        Args:
            channel, profile, out: as of the attributes.
            extra: definitions of types that the log does not hold, by name.

        Raises:
            SchemaError: the channel's encoding or definition is none that can be read.
        """
        plans = MAX_PLANS if channel.encoding in ("cdr", "ros1") else 0
        return cls(channel, profile, layouts_of(channel, extra), out, max_plans=plans)

    def add(self, batch: Batch) -> None:
        """Decode a batch; what cannot be decoded is counted, never dropped in silence."""
        kind = packing_of(batch) if self.channel.encoding == "cdr" else None
        if kind is None:
            self._add_plain(batch)
            return
        for messages, problems in unpacked(batch, kind):
            self._add_plain(messages)
            self.out.seen += len(problems)
            for problem in problems:
                self.out.skip(1, problem)

    def _add_plain(self, batch: Batch) -> None:
        count = batch.start.shape[0]
        self.out.bounds.take_messages(count)
        places = np.arange(self.out.seen, self.out.seen + count)
        self.out.seen += count
        for size in np.unique(batch.length).tolist():
            mine = batch.length == size
            self._equal_size(_Rows(gather(batch.data, batch.start[mine], size), batch.log_ns[mine], places[mine]))

    def _add_alone(self, data: bytes, log_ns: IntArray, places: IntArray) -> Plan | None:
        """Decode a message by a layout of its own, which other messages may share; None where it cannot be."""
        try:
            layout = self.lay(data)
            plan = make_plan(layout, self.profile)
        except LayoutError as error:
            self.out.skip(1, str(error))
            return None
        self._emit(plan, _Rows(np.frombuffer(layout.data, np.uint8)[None, :], log_ns, places))
        return plan

    def _equal_size(self, rows: _Rows) -> None:
        kept = self._plans.setdefault(rows.data.shape[1], [])
        for plan in kept:
            rows = self._without_alike(rows, plan)
        while rows.places.shape[0]:
            new = self._add_alone(rows.data[0].tobytes(), rows.log_ns[:1], rows.places[:1])
            rows = rows.at(slice(1, None))
            if new is not None and sum(map(len, self._plans.values())) < self.max_plans:
                kept.append(new)
                rows = self._without_alike(rows, new)

    def _without_alike(self, rows: _Rows, plan: Plan) -> _Rows:
        """Decode the messages that share a plan's layout; the others are left."""
        if not rows.places.shape[0]:
            return rows
        same = plan.matches(rows.data)
        alike = rows if same is None else rows.at(same)
        if alike.places.shape[0]:
            self._emit(plan, alike)
        return rows.at(slice(0)) if same is None else rows.at(~same)

    def _emit(self, plan: Plan, rows: _Rows) -> None:
        columns = plan.columns_of(rows.data)
        source = np.full(rows.places.shape[0], self.channel.key)
        columns |= {"log_ns": rows.log_ns, "place": rows.places, "source": source}
        self.out.add(plan.key, columns)
