"""Decoded samples of one topic, grouped by what its messages hold, still in the log's own names and units."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import cast

import numpy as np

from collaudit.core.series import FloatArray, IntArray

QUANTITIES = ("position", "velocity", "effort")


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
    """Stacked columns of one :class:`GroupKey`, collected piece by piece.

    Attributes:
        key: what its messages hold.
        pieces: column name to arrays to be concatenated: ``log_ns``, ``stamp_ns``, ``order`` (n,) int64 and the
            quantities (n, j) float64.
    """

    key: GroupKey
    pieces: dict[str, list[IntArray | FloatArray]] = field(default_factory=dict)

    def add(self, columns: dict[str, IntArray | FloatArray]) -> None:
        """Append rows; every call names the same columns."""
        for name, values in columns.items():
            self.pieces.setdefault(name, []).append(values)

    def take(self, name: str) -> FloatArray | IntArray | None:
        """The whole column; its pieces are released, so that a column is never held twice for long."""
        pieces = self.pieces.pop(name, None)
        if pieces is None:
            return None
        return pieces[0] if len(pieces) == 1 else cast(FloatArray | IntArray, np.concatenate(pieces))

    @property
    def rows(self) -> int:
        """Number of messages; counted on the recording times, which every group has."""
        return sum(piece.shape[0] for piece in self.pieces.get("log_ns", ()))


@dataclass(slots=True, eq=False)
class Decoded:
    """Everything decoded of one topic.

    Attributes:
        groups: by key, in the order met.
        seen: messages met.
        skipped: messages left out.
        problem: why the first of them was left out.
        slow: messages that went through the generic decoder.
    """

    groups: dict[GroupKey, Group] = field(default_factory=dict)
    seen: int = 0
    skipped: int = 0
    problem: str | None = None
    slow: int = 0

    def skip(self, count: int, problem: str) -> None:
        """Count messages that could not be used."""
        self.skipped += count
        self.problem = self.problem or problem

    def group(self, key: GroupKey) -> Group:
        """The group of a key, made when new."""
        return self.groups.setdefault(key, Group(key))


def all_names(tables: Iterable[Decoded]) -> tuple[str, ...]:
    """Every joint name met, in the order met."""
    names: dict[str, None] = {}
    for table in tables:
        for key in table.groups:
            names.update(dict.fromkeys(key.names))
    return tuple(names)
