"""Columnar decoding: batches of raw messages to stacked columns, one layout at a time.

Messages that share a layout and their joint names are decoded together as views into one byte matrix; every
message is checked against the layout first. A topic whose messages have ever new layouts goes through the
generic decoder message by message; the result is the same, only slower.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from collaudit.core.logs.messages.column_extraction import Plan, make_plan
from collaudit.core.logs.messages.decoded_columns import Decoded, GroupKey
from collaudit.core.logs.messages.generic_decoder import generic_decoder
from collaudit.core.logs.messages.layout import LayoutError, walk
from collaudit.core.logs.messages.message_schema import Struct, parse_schema
from collaudit.core.logs.messages.profiles import Profile
from collaudit.core.logs.storage.message_places import rows_at
from collaudit.core.logs.storage.packed_messages import packing_of, unpacked
from collaudit.core.logs.storage.records import Batch, ByteArray, Channel
from collaudit.core.numeric.arrays import FloatArray, IntArray

#: More layouts than this on one channel, and the rest goes through the generic decoder.
MAX_PLANS = 256

Columns = dict[str, IntArray | FloatArray]
Generic = Callable[[bytes], tuple[GroupKey, Columns]]


@dataclass(slots=True, eq=False)
class ChannelDecoder:
    """Decodes one channel's batches into a topic's :class:`Decoded`.

    Attributes:
        channel: what is decoded.
        profile: which of its fields are meant.
        kind: the message's wire type, None where messages have no fixed layout.
        out: where the columns go; shared by the channels of one topic.
        extra: definitions of types that the log does not hold, by name.
        tagged: whether each row keeps which channel it came from.
    """

    channel: Channel
    profile: Profile
    kind: Struct | None
    out: Decoded
    max_plans: int = MAX_PLANS
    extra: Mapping[str, Any] = field(default_factory=dict)
    tagged: bool = False
    _plans: dict[int, list[Plan]] = field(default_factory=dict)
    _count: int = 0
    _generic: Generic | None = None

    @classmethod
    def of(cls, channel: Channel, profile: Profile, out: Decoded, extra: Mapping[str, Any] = {}) -> ChannelDecoder:
        """A decoder for a channel; JSON and protobuf have no layouts and go message by message.

        Raises:
            SchemaError: the channel's definition cannot be understood.
        """
        if channel.encoding not in ("cdr", "ros1"):
            decoder = cls(channel, profile, None, out, max_plans=0)
            decoder._generic = generic_decoder(channel, profile)
            return decoder
        kind = parse_schema(channel.type, channel.encoding, channel.schema_encoding, channel.schema, extra)
        return cls(channel, profile, kind, out, extra=extra)

    def add(self, batch: Batch) -> None:
        """Decode a batch; what cannot be decoded is counted, never dropped in silence."""
        kind = packing_of(batch) if self.channel.encoding == "cdr" else None
        if kind is None:
            self._add_plain(batch)
            return
        for part in unpacked(batch, kind):
            self._add_plain(part.batch)
            if part.failed:
                self.out.seen += part.failed
                self.out.skip(part.failed, part.problem)

    def _add_plain(self, batch: Batch) -> None:
        count = batch.start.shape[0]
        if count == 0:
            return
        if self.out.bounds is not None:
            self.out.bounds.take_messages(count)
        first = self.out.seen
        self.out.seen += count
        if batch.publish_ns is not None:
            self.out.latency.add(batch.publish_ns, batch.log_ns)
        low, high = int(batch.length.min()), int(batch.length.max())
        if low == high:
            self._equal_size(batch, None, low, first)
            return
        for size in np.unique(batch.length).tolist():
            self._equal_size(batch, np.flatnonzero(batch.length == size), int(size), first)

    def _equal_size(self, batch: Batch, picked: IntArray | None, size: int, first: int) -> None:
        """Decode the messages of one size: all of a batch when ``picked`` is None."""
        rows = rows_at(batch.data, batch.start if picked is None else batch.start[picked], size)
        for plan in self._plans.get(size, ()):
            same = plan.matches(rows)
            if same is None:
                self._emit(plan, rows, batch, first, picked)
                return
            if same.any():
                picked = np.arange(rows.shape[0]) if picked is None else picked
                self._emit(plan, rows[same], batch, first, picked[same])
                rows, picked = rows[~same], picked[~same]
        self._new_layouts(batch, rows, np.arange(rows.shape[0]) if picked is None else picked, first)

    def _new_layouts(self, batch: Batch, rows: ByteArray, picked: IntArray, first: int) -> None:
        while picked.shape[0]:
            if self.kind is None or self._count >= self.max_plans:
                self._one_by_one(batch, picked, first)
                return
            data = rows[0].tobytes()
            try:
                plan = make_plan(walk(self.kind, data, cdr=self.channel.encoding == "cdr"), self.profile, data)
            except LayoutError as error:
                self.out.skip(1, str(error))
                rows, picked = rows[1:], picked[1:]
                continue
            self._count += 1
            self._plans.setdefault(rows.shape[1], []).append(plan)
            same = plan.matches(rows)
            if same is None:
                self._emit(plan, rows, batch, first, picked)
                return
            self._emit(plan, rows[same], batch, first, picked[same])
            rows, picked = rows[~same], picked[~same]

    def _emit(self, plan: Plan, rows: ByteArray, batch: Batch, first: int, picked: IntArray | None) -> None:
        places = np.arange(rows.shape[0]) if picked is None else picked
        log_ns = batch.log_ns if picked is None else batch.log_ns[picked]
        self._add(plan.key, plan.columns_of(rows), log_ns, first + places)

    def _add(self, key: GroupKey, columns: Columns, log_ns: IntArray, places: IntArray) -> None:
        columns |= {"log_ns": log_ns, "place": places}
        if self.tagged:
            columns["source"] = np.full(places.shape[0], self.channel.key)
        self.out.add(key, columns)

    def _one_by_one(self, batch: Batch, picked: IntArray, first: int) -> None:
        if self._generic is None:
            self._generic = generic_decoder(self.channel, self.profile, self.extra)
        for index in picked.tolist():
            try:
                key, columns = self._generic(batch.payload(index))
            except LayoutError as error:
                self.out.skip(1, str(error))
                continue
            self.out.slow += 1
            self._add(key, columns, batch.log_ns[index : index + 1], np.array([first + index]))
