"""Columnar decoding: batches of raw messages to stacked columns of a topic, one layout at a time.

Messages that share a layout and their joint names are decoded together as views into one byte matrix; every
message is checked against the layout first. Where messages have ever new layouts, each is decoded alone, in the same
way. What comes out is grouped by what the messages hold, still in the log's own names and units.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from collaudit.core.logs.messages.column_extraction import GroupKey, Plan, make_plan
from collaudit.core.logs.messages.layout import Layout, LayoutError, value_layouts, walk
from collaudit.core.logs.messages.message_schema import SchemaError, parse_schema
from collaudit.core.logs.storage.bounded_reading import FILE_RATIO, ReadingBounds, bounded
from collaudit.core.logs.storage.readers import Batch, ByteArray, Channel, gather
from collaudit.core.numeric.arrays import FloatArray, IntArray
from collaudit.core.vendors.message_profiles import Profile

#: Rows of room that a column grows by at least.
_LEAST_ROWS = 4096
#: And how many times as long it becomes at most.
_MOST_TIMES = 64
Column = IntArray | FloatArray
#: Numbers of a row besides its quantities: stamps, place and source.
_OWN_COLUMNS = 4
#: Encodings whose bytes have a layout that messages share, and those whose messages are values.
_BYTES, _VALUES = ("cdr", "ros1"), ("json", "protobuf")
_MAGICS = {b"\x28\xb5\x2f\xfd": "zstd", b"\x04\x22\x4d\x18": "lz4"}
#: So many bytes are unpacked at once.
_AT_ONCE = 1 << 27
#: A message that becomes larger than this, and more than ``FILE_RATIO`` times its bytes, is refused.
_FREE_BYTES = 1 << 20
#: More layouts than this are not kept of one channel.
MAX_PLANS = 256


class ChannelDecoder:
    """Decodes one channel's batches into a topic's :class:`Decoded`.

    Attributes:
        channel: what is decoded.
        profile: which of its fields are meant.
        out: where the columns go; shared by the channels of one topic.
        lay: finds the fields of one message.
        max_plans: layouts that are kept for further messages; 0 where each message has one of its own.
    """

    def __init__(self, channel: Channel, profile: Profile, out: Decoded, extra: Mapping[str, Any] = {}) -> None:
        """A decoder for a channel; JSON and protobuf have no layouts in common and go message by message.

        Args:
            channel, profile, out: as of the attributes.
            extra: definitions of types that the log does not hold, by name.

        Raises:
            SchemaError: the channel's encoding or definition is none that can be read.
        """
        self.channel, self.profile, self.out = channel, profile, out
        self.lay = layouts_of(channel, extra)
        self.max_plans = MAX_PLANS if channel.encoding in _BYTES else 0
        self._plans: dict[int, list[Plan]] = {}

    def add(self, batch: Batch) -> None:
        """Decode a batch; what cannot be decoded is counted, never dropped in silence."""
        kind = packing_of(batch) if self.channel.encoding == "cdr" else None
        for messages, problems in unpacked(batch, kind) if kind is not None else [(batch, [])]:
            count = messages.start.shape[0]
            places = np.arange(self.out.seen, self.out.seen + count)
            self.out.seen += count + len(problems)
            for size in np.unique(messages.length).tolist():
                mine = messages.length == size
                data = gather(messages.data, messages.start[mine], size)
                self._equal_size(data, messages.log_ns[mine], places[mine])
            for problem in problems:
                self.out.skip(1, problem)

    def _equal_size(self, data: ByteArray, log_ns: IntArray, places: IntArray) -> None:
        """Decode messages of one size: (n, size) bytes, (n,) times of recording and places among the topic's."""
        plans = list(self._plans.setdefault(data.shape[1], []))
        while places.shape[0]:
            plan = plans.pop(0) if plans else None
            if plan is None:
                plan = self._new(data[0].tobytes(), log_ns[:1], places[:1])
                data, log_ns, places = data[1:], log_ns[1:], places[1:]
            if plan is None or not places.shape[0]:
                continue
            same = plan.matches(data)
            if same is None:
                self._emit(plan, data, log_ns, places)
                return
            if same.any():
                self._emit(plan, data[same], log_ns[same], places[same])
            data, log_ns, places = data[~same], log_ns[~same], places[~same]

    def _new(self, message: bytes, log_ns: IntArray, places: IntArray) -> Plan | None:
        """Decode a message by a plan of its own; the plan where other messages may share it."""
        try:
            layout = self.lay(message)
            plan = make_plan(layout, self.profile)
        except LayoutError as error:
            self.out.skip(1, str(error))
            return None
        self._emit(plan, np.frombuffer(layout.data, np.uint8)[None, :], log_ns, places)
        if sum(map(len, self._plans.values())) >= self.max_plans:
            return None
        self._plans[len(message)].append(plan)
        return plan

    def _emit(self, plan: Plan, data: ByteArray, log_ns: IntArray, places: IntArray) -> None:
        columns = plan.columns_of(data)
        columns |= {"log_ns": log_ns, "place": places, "source": np.full(places.shape[0], self.channel.key)}
        self.out.add(plan.key, columns)


def layouts_of(channel: Channel, extra: Mapping[str, Any] = {}) -> Callable[[bytes], Layout]:
    """What finds the fields of one message of a channel.

    Raises:
        SchemaError: the channel's encoding or definition is none that can be read.
    """
    if channel.encoding not in (*_BYTES, *_VALUES):
        raise SchemaError(f"messages encoded as {channel.encoding!r} are not read")
    if channel.encoding in _VALUES:
        return value_layouts(channel)
    schema = parse_schema(channel.type, channel.encoding, channel.schema_encoding, channel.schema, extra)
    return partial(walk, schema, cdr=channel.encoding == "cdr")


def first_message(batch: Batch) -> bytes | None:
    """The first message of a batch as it was before it was compressed; None where there is none."""
    kind = packing_of(batch)
    for messages, _ in unpacked(batch, kind) if kind is not None else [(batch, [])]:
        return messages.payload(0) if messages.start.shape[0] else None
    return None


def packing_of(batch: Batch) -> str | None:
    """How the messages of a batch are compressed, by the first one; None when they are not."""
    return _MAGICS.get(batch.payload(0)[:4]) if batch.start.shape[0] else None


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
    held, last = 0, batch.start.shape[0] - 1
    for index in range(last + 1):
        packed = batch.payload(index)
        data, problem = bounded(kind, packed, max(_FREE_BYTES, FILE_RATIO * len(packed)))
        if problem is None:
            rows.append(index)
            parts.append(data)
            held += len(data)
        else:
            problems.append(f"it is compressed as {kind} and cannot be unpacked: {problem}")
        if index == last or held >= _AT_ONCE:
            length = np.array([len(part) for part in parts], dtype=np.int64)
            joined = np.frombuffer(b"".join(parts), dtype=np.uint8)
            yield Batch(batch.key, joined, np.cumsum(length) - length, length, batch.log_ns[rows]), problems
            rows, parts, problems, held = [], [], [], 0


@dataclass(slots=True, eq=False)
class Decoded:
    """Everything decoded of one topic.

    Attributes:
        groups: by key, in the order met.
        seen: messages met.
        skipped: messages left out.
        problem: why the first of them was left out.
        bounds: how much may be read.
        claimed: messages that the file's summary claims.
    """

    groups: dict[GroupKey, Group] = field(default_factory=dict)
    seen: int = 0
    skipped: int = 0
    problem: str | None = None
    bounds: ReadingBounds = field(default_factory=lambda: ReadingBounds(0, "the log"))
    claimed: int = 0

    def skip(self, count: int, problem: str) -> None:
        """Count messages that could not be used."""
        self.skipped += count
        self.problem = self.problem or problem

    @property
    def currents(self) -> bool:
        """Whether the efforts are currents by the type's definition or by the names of interfaces."""
        return any(key.currents for key in self.groups)

    def add(self, key: GroupKey, columns: Mapping[str, Column]) -> None:
        """Take in rows of a group, which is made when new.

        Raises:
            LogError: they are more than is read of a log.
        """
        self.bounds.take_values(len(columns["log_ns"]), _OWN_COLUMNS + sum(count for _, count in key.present))
        if key not in self.groups:
            self.groups[key] = Group(key, claimed=self.claimed)
            self.bounds.check_layouts(len(self.groups))
        self.groups[key].add(columns)


@dataclass(slots=True, eq=False)
class Group:
    """Stacked columns of one :class:`GroupKey`.

    Attributes:
        key: what its messages hold.
        columns: column name to rows: ``log_ns``, ``stamp_ns``, ``place``, which of the topic's messages a row is, and
            ``source``, its channel, (n,) int64, and the quantities (n, j) float64.
        claimed: rows that the topic is said to have.
    """

    key: GroupKey
    columns: dict[str, Growing] = field(default_factory=dict)
    claimed: int = 0

    def add(self, columns: Mapping[str, Column]) -> None:
        """Take in rows, of the same columns each time."""
        for name, values in columns.items():
            if name not in self.columns:
                self.columns[name] = Growing(values.shape[1] if values.ndim > 1 else 0, self.claimed)
            self.columns[name].add(values)

    def look(self, name: str) -> NDArray[Any] | None:
        """A column that stays in the group."""
        column = self.columns.get(name)
        return None if column is None else column.so_far()

    def take(self, name: str) -> NDArray[Any] | None:
        """The whole column, which the group gives away."""
        column = self.columns.pop(name, None)
        return None if column is None else column.so_far()

    def holds(self, name: str) -> bool:
        """Whether a column is there and any of its numbers is one."""
        values = self.look(name)
        return values is not None and bool(np.isfinite(values).any())

    @property
    def rows(self) -> int:
        """Number of messages; counted on the recording times, which every group has."""
        return len(self.columns["log_ns"]) if "log_ns" in self.columns else 0


class Growing:
    """An array that grows at its end: memory that is not written to costs nothing.

    It grows to as many rows as are claimed, within 64 times what is there, for claims may be false; to twice its length
    where no more are claimed.
    """

    def __init__(self, width: int, claimed: int = 0) -> None:
        """``width``: numbers of a row, 0 for one integer; ``claimed``: rows that are said to come."""
        self._array: Column = np.empty((0, width)) if width else np.empty(0, dtype=np.int64)
        self._used, self._claimed = 0, claimed

    def add(self, values: Column) -> None:
        """Take in further rows."""
        start, self._used = self._used, self._used + values.shape[0]
        if self._used > self._array.shape[0]:
            rows = min(self._claimed, _MOST_TIMES * self._used)
            rows = rows if rows >= self._used else 2 * self._used + _LEAST_ROWS
            longer = np.empty((rows, *self._array.shape[1:]), self._array.dtype, order="F")
            longer[:start] = self._array[:start]
            self._array = longer
        self._array[start : self._used] = values

    def so_far(self) -> Column:
        """The rows so far, where they lie."""
        return self._array[: self._used]

    def __len__(self) -> int:
        return int(self._used)


def all_names(tables: Iterable[Decoded]) -> tuple[str, ...]:
    """Every joint name met, in the order met."""
    names: dict[str, None] = {}
    for decoded in tables:
        for key in decoded.groups:
            names.update(dict.fromkeys(key.names))
    return tuple(names)
