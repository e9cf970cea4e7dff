"""Decoded samples of one topic, grouped by what its messages hold, still in the log's own names and units."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from collaudit.core.logs.storage.reading_bounds import ReadingBounds
from collaudit.core.numeric.arrays import FloatArray, IntArray

#: Rows of room that a column grows by at least.
_LEAST_ROWS = 4096
#: And how many times as long it becomes at most.
_MOST_TIMES = 64
Column = IntArray | FloatArray
#: Numbers of a row besides its quantities: stamps, place and source.
_OWN_COLUMNS = 4


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


@dataclass(frozen=True, slots=True)
class GroupKey:
    """Messages that may be stacked: same names in the same order, same quantities present.

    Attributes:
        names: joint names in message order; empty for a wrench.
        present: which of the quantities the messages hold, with how many numbers each.
        stamped: whether they carry a header's stamp.
        currents: whether their efforts are currents of the drives, A.
    """

    names: tuple[str, ...]
    present: tuple[tuple[str, int], ...]
    stamped: bool
    currents: bool = False


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


def all_names(tables: Iterable[Decoded]) -> tuple[str, ...]:
    """Every joint name met, in the order met."""
    names: dict[str, None] = {}
    for decoded in tables:
        for key in decoded.groups:
            names.update(dict.fromkeys(key.names))
    return tuple(names)
