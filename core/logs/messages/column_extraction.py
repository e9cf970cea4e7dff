"""From a layout and a profile to the byte ranges that are the wanted columns."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from collaudit.core.logs.messages.decoded_columns import GroupKey
from collaudit.core.logs.messages.field_paths import Runs, select
from collaudit.core.logs.messages.layout import Layout, LayoutError, Numbers
from collaudit.core.logs.storage.records import NS_PER_S, ByteArray
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray
from collaudit.core.vendors.message_profiles import Profile

#: Guarded bytes closer than this are compared in one go, the bytes between them masked out.
_NEAR = 16
#: What seconds fit a stamp in ns.
_MOST_SECONDS = (1 << 63) // NS_PER_S - 1
#: Bytes of a length.
_WORD = 4


@dataclass(frozen=True, slots=True, eq=False)
class Guard:
    """Bytes from ``start`` that must equal ``expected`` wherever ``free`` is not set (None: everywhere)."""

    start: int
    expected: ByteArray
    free: BoolArray | None

    def same(self, rows: ByteArray) -> BoolArray:
        """(n, g) True where a byte, or a word, is as it must be."""
        size = self.expected.shape[0]
        if size == _WORD and self.free is None:  # a lone length: compared as one number
            return np.asarray(rows[:, self.start : self.start + size].view("u4") == self.expected.view("u4"))
        equal: BoolArray = rows[:, self.start : self.start + size] == self.expected
        if self.free is not None:
            np.logical_or(equal, self.free, out=equal)
        return equal


@dataclass(frozen=True, slots=True, eq=False)
class Plan:
    """How to take columns out of a matrix of messages that share a layout.

    Attributes:
        size: bytes of each message.
        key: names and quantities these messages hold.
        guards: the bytes that must agree.
        stamp: the two numbers of the header's stamp, or None.
        columns: quantity to the runs of numbers that make it up.
    """

    size: int
    key: GroupKey
    guards: tuple[Guard, ...]
    stamp: Runs | None
    columns: dict[str, Runs]

    def matches(self, rows: ByteArray) -> BoolArray | None:
        """(n,) True for the rows that share this plan's layout and names; None when all of them do."""
        same: BoolArray | None = None
        for guard in self.guards:
            equal = guard.same(rows)
            if not equal.all():
                each: BoolArray = np.asarray(equal.all(axis=1))
                same = each if same is None else same & each
        return same

    def columns_of(self, rows: ByteArray) -> dict[str, IntArray | FloatArray]:
        """The stamp (int64 ns) and the quantities (n, j) float64 of rows that match; views where they can be."""
        out: dict[str, IntArray | FloatArray] = {}
        if self.stamp is not None:
            seconds, rest = (_numbers(rows, part)[:, 0].astype(np.int64) for part in self.stamp)
            out["stamp_ns"] = seconds * NS_PER_S + rest
        for name, parts in self.columns.items():
            blocks = [_numbers(rows, part) for part in parts]
            joined = blocks[0] if len(blocks) == 1 else np.concatenate(blocks, axis=1)
            out[name] = joined.astype(np.float64, copy=False)
        return out


def _numbers(rows: ByteArray, part: Numbers) -> np.ndarray[tuple[int, int], np.dtype[np.generic]]:
    """(n, count) numbers as a view of the bytes: they are copied once, to where they stay."""
    view: np.ndarray[tuple[int, int], np.dtype[np.generic]]
    view = rows[:, part.offset : part.stop].view(part.code)
    return view


def _guards(ranges: list[tuple[int, int]], data: bytes) -> tuple[Guard, ...]:
    """Byte ranges as few guards."""
    whole = np.frombuffer(data, dtype=np.uint8)
    bound = np.zeros(len(data), dtype=np.bool_)
    for start, stop in ranges:
        bound[start:stop] = True
    where = np.flatnonzero(bound)
    cuts = np.flatnonzero(np.diff(where) > _NEAR) + 1
    out = []
    for part in np.split(where, cuts):
        if part.shape[0]:
            start, stop = int(part[0]), int(part[-1]) + 1
            free = ~bound[start:stop]
            out.append(Guard(start, whole[start:stop], free if free.any() else None))
    return tuple(out)


def make_plan(layout: Layout, profile: Profile) -> Plan:
    """Plan the extraction of a profile's columns from messages that share a layout.

    Raises:
        LayoutError: the message does not hold what the profile needs, or holds it inconsistently.
    """
    found = select(layout, profile)
    if found.stamp is not None and abs(int(_first(found.stamp[0], layout.data))) > _MOST_SECONDS:
        raise LayoutError("its stamp is beyond all times")
    columns = {name: _joined(runs) for name, runs in found.columns.items()}
    return Plan(len(layout.data), found.key, _guards(found.bound, layout.data), found.stamp, columns)


def _first(part: Numbers, data: bytes) -> np.generic:
    number: np.generic = np.frombuffer(data, part.code, 1, part.offset)[0]
    return number


def _joined(parts: Runs) -> Runs:
    """Runs of numbers with those that follow each other as one: six fields of a wrench are an array of six."""
    out: list[Numbers] = []
    for part in parts:
        last = out[-1] if out else None
        if last is not None and (last.code, last.stop) == (part.code, part.offset):
            out[-1] = Numbers(last.offset, last.code, last.count + part.count)
        else:
            out.append(part)
    return tuple(out)
