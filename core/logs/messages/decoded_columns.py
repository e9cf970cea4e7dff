"""Decoded samples of one topic, grouped by what its messages hold, still in the log's own names and units."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np

from collaudit.core.logs.messages.growing_columns import Column, Growing
from collaudit.core.logs.storage.reading_bounds import ReadingBounds
from collaudit.core.numeric.arrays import FloatArray, IntArray

#: Numbers of a row besides its quantities: stamps and place.
_OWN_COLUMNS = 3
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
        columns: column name to rows: ``log_ns``, ``stamp_ns`` and ``place``, which of the topic's messages a row is,
            (n,) int64, and the quantities (n, j) float64.
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

    def group(self, key: GroupKey) -> Group:
        """The group of a key, made when new."""
        found = self.groups.get(key)
        if found is None:
            found = self.groups[key] = Group(key, claimed=self.claimed)
            self.bounds.check_layouts(len(self.groups))
        return found

    def add(self, key: GroupKey, columns: Mapping[str, Column]) -> None:
        """Take in rows of a group.

        Raises:
            LogError: they are more than is read of a log.
        """
        self.bounds.take_values(len(columns["log_ns"]), _OWN_COLUMNS + sum(count for _, count in key.present))
        self.group(key).add(columns)


def all_names(tables: Iterable[Decoded]) -> tuple[str, ...]:
    """Every joint name met, in the order met."""
    names: dict[str, None] = {}
    for table in tables:
        for key in table.groups:
            names.update(dict.fromkeys(key.names))
    return tuple(names)
