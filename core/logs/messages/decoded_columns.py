"""Decoded samples of one topic, grouped by what its messages hold, still in the log's own names and units."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np

from collaudit.core.logs.messages.growing_columns import Column, Growing
from collaudit.core.logs.storage.reading_bounds import ReadingBounds
from collaudit.core.numeric.arrays import FloatArray, IntArray
from collaudit.core.numeric.parallel import Beside

#: Numbers of a row besides its quantities: stamps and place.
_OWN_COLUMNS = 3
#: Bytes of messages that are not held beyond the decoding of their batch.
_MOST_HELD = 1 << 22
MOTION = ("position", "velocity", "effort")
QUANTITIES = (*MOTION, "temperature", "joint_torque")


@dataclass(frozen=True, slots=True)
class GroupKey:
    """Messages that may be stacked: same names in the same order, same quantities present.

    Attributes:
        names: joint names in message order; empty for a wrench.
        present: which of the quantities the messages hold, with how many numbers each.
        stamped: whether they carry a header's stamp.
    """

    names: tuple[str, ...]
    present: tuple[tuple[str, int], ...]
    stamped: bool


@dataclass(slots=True, eq=False)
class Group:
    """Stacked columns of one :class:`GroupKey`.

    Attributes:
        key: what its messages hold.
        columns: column name to rows: ``log_ns``, ``stamp_ns`` (n,) int64 and the quantities (n, j) float64.
        places: of the rows among the topic's messages, as runs and lists of them.
    """

    key: GroupKey
    columns: dict[str, Growing] = field(default_factory=dict)
    places: list[range | IntArray] = field(default_factory=list)

    def place(self, rows: range | IntArray) -> None:
        """Note which of the topic's messages, in ascending order, the next rows are; of a run its ends are kept."""
        if not isinstance(rows, range) and rows.shape[0] and int(rows[-1]) - int(rows[0]) + 1 == rows.shape[0]:
            rows = range(int(rows[0]), int(rows[-1]) + 1)
        last = self.places[-1] if self.places else None
        if isinstance(rows, range) and isinstance(last, range) and last.stop == rows.start:
            self.places[-1] = range(last.start, rows.stop)
        else:
            self.places.append(rows)

    def order(self) -> IntArray:
        """(n,) which of the topic's messages each row is."""
        parts = [np.arange(p.start, p.stop) if isinstance(p, range) else p for p in self.places]
        return np.concatenate(parts) if parts else np.empty(0, dtype=np.int64)

    @property
    def is_one_run(self) -> bool:
        """Whether its rows followed each other with no message of the topic between."""
        return len(self.places) == 1 and isinstance(self.places[0], range)

    def room(
        self, widths: Mapping[str, int], count: int, share: float, claimed: int, settle: Callable[[], None]
    ) -> dict[str, Column]:
        """So many further rows of its columns, to be written to; every call names the same columns.

        Args:
            widths: column name to numbers of a row, 0 for one integer.
            count, share, settle: as of :meth:`Growing.room`.
            claimed: messages of the topic that the file claims to hold; 0 where it states no number.
        """
        for name, width in widths.items():
            if name not in self.columns:
                self.columns[name] = Growing(width, claimed)
        return {name: self.columns[name].room(count, share, settle) for name in widths}

    def take(self, name: str) -> FloatArray | IntArray | None:
        """The whole column, which the group gives away."""
        column = self.columns.pop(name, None)
        return None if column is None else column.so_far()

    def look(self, name: str) -> FloatArray | IntArray | None:
        """A copy of a column that stays in the group."""
        column = self.columns.get(name)
        return None if column is None else column.so_far().copy()

    def holds(self, name: str) -> bool:
        """Whether a column is there and any of its numbers is one."""
        column = self.columns.get(name)
        values = None if column is None else column.so_far()
        return values is not None and bool(np.isfinite(values).any())

    @property
    def rows(self) -> int:
        """Number of messages; counted on the recording times, which every group has."""
        return len(self.columns["log_ns"]) if "log_ns" in self.columns else 0


@dataclass(slots=True)
class Latency:
    """From publishing to recording, ns, over the messages whose container keeps both.

    Attributes:
        count: messages with both times.
        least, most, total: of the differences.
        unset: messages whose time of publishing is zero.
    """

    count: int = 0
    least: int = 0
    most: int = 0
    total: float = 0.0
    unset: int = 0

    def add(self, publish_ns: IntArray, log_ns: IntArray) -> None:
        """Take in some messages; equal times, which most recorders write, cost one comparison."""
        if np.array_equal(publish_ns, log_ns):
            self.least, self.most = min(self.least, 0), max(self.most, 0)
            self.count += log_ns.shape[0]
            return
        unset = publish_ns == 0
        delays = (log_ns - publish_ns)[~unset]
        self.unset += int(unset.sum())
        if delays.shape[0]:
            low, high = int(delays.min()), int(delays.max())
            self.least = low if self.count == 0 else min(self.least, low)
            self.most = high if self.count == 0 else max(self.most, high)
            self.count += delays.shape[0]
            self.total += float(delays.sum(dtype=np.float64))


@dataclass(slots=True, eq=False)
class Decoded:
    """Everything decoded of one topic.

    Attributes:
        groups: by key, in the order met.
        seen: messages met.
        skipped: messages left out.
        problem: why the first of them was left out.
        slow: messages that went through the generic decoder.
        latency: how long after publishing messages were recorded.
        share: how much of the log's bytes has been read, 0 … 1.
        claimed: messages that the file claims to hold; 0 where it states no number.
        bounds: how much may be read; None for no bounds.
        beside: does the writing of columns; None to have it done at once.
    """

    groups: dict[GroupKey, Group] = field(default_factory=dict)
    seen: int = 0
    skipped: int = 0
    problem: str | None = None
    slow: int = 0
    latency: Latency = field(default_factory=lambda: Latency())
    share: float = 0.0
    claimed: int = 0
    bounds: ReadingBounds | None = None
    beside: Beside | None = None

    def skip(self, count: int, problem: str) -> None:
        """Count messages that could not be used."""
        self.skipped += count
        self.problem = self.problem or problem

    def group(self, key: GroupKey) -> Group:
        """The group of a key, made when new."""
        found = self.groups.get(key)
        if found is None:
            found = self.groups[key] = Group(key)
            if self.bounds is not None:
                self.bounds.check_layouts(len(self.groups))
        return found

    def room(self, key: GroupKey, widths: Mapping[str, int], places: range | IntArray) -> dict[str, Column]:
        """Further rows of a group, to be written to by what :meth:`write` is given.

        Args:
            key: of the group.
            widths: column name to numbers of a row, 0 for one integer.
            places: of the rows among the messages met.

        Raises:
            LogError: they are more than is read of a log.
        """
        rows = len(places)
        if self.bounds is not None:
            self.bounds.take_values(rows, _OWN_COLUMNS + sum(count for _, count in key.present))
        group = self.group(key)
        group.place(places)
        return group.room(widths, rows, self.share, self.claimed, self._settle)

    def write(self, work: Callable[[], None], held: int) -> None:
        """Have rows written to, in any order and beside what comes next; until then so many bytes are held."""
        if self.beside is None:
            work()
            return
        self.beside.add(work)
        if held > _MOST_HELD:
            self.beside.settle()

    def _settle(self) -> None:
        if self.beside is not None:
            self.beside.settle()


def all_names(tables: Iterable[Decoded]) -> tuple[str, ...]:
    """Every joint name met, in the order met."""
    names: dict[str, None] = {}
    for table in tables:
        for key in table.groups:
            names.update(dict.fromkeys(key.names))
    return tuple(names)
