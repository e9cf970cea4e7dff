"""From a layout and a profile to the byte ranges that are the wanted columns."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from collaudit.core.logs.layout import Chars, Layout, LayoutError, Numbers, Path
from collaudit.core.logs.profiles import Profile
from collaudit.core.logs.records import ByteArray
from collaudit.core.logs.tables import GroupKey
from collaudit.core.series import BoolArray, FloatArray, IntArray

NS = 1_000_000_000


#: Guarded bytes closer than this are compared in one go, the bytes between them masked out.
_NEAR = 16


@dataclass(frozen=True, slots=True, eq=False)
class Guard:
    """Bytes from ``start`` that must equal ``expected`` wherever ``free`` is not set (None: everywhere)."""

    start: int
    expected: ByteArray
    free: BoolArray | None

    def same(self, rows: ByteArray) -> BoolArray:
        """(n, g) True where a byte is as it must be."""
        equal: BoolArray = rows[:, self.start : self.start + self.expected.shape[0]] == self.expected
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
    stamp: tuple[Numbers, Numbers] | None
    columns: dict[str, tuple[Numbers, ...]]

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
        """The stamp (int64 ns) and the quantities (n, j) float64 of rows that match."""
        out: dict[str, IntArray | FloatArray] = {}
        if self.stamp is not None:
            seconds, rest = (_numbers(rows, part)[:, 0].astype(np.int64) for part in self.stamp)
            out["stamp_ns"] = seconds * NS + rest
        for name, parts in self.columns.items():
            blocks = [_numbers(rows, part) for part in parts]
            joined = blocks[0] if len(blocks) == 1 else np.concatenate(blocks, axis=1)
            out[name] = np.ascontiguousarray(joined, dtype=np.float64)
        return out


def _numbers(rows: ByteArray, part: Numbers) -> np.ndarray[tuple[int, int], np.dtype[np.generic]]:
    block = np.ascontiguousarray(rows[:, part.offset : part.offset + part.size])
    view: np.ndarray[tuple[int, int], np.dtype[np.generic]] = block.view(part.code)
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


def _key(path: str) -> Path:
    return tuple(path.split(".")) if path else ()


def _find(layout: Layout, path: str) -> tuple[Numbers, ...] | None:
    """The runs of numbers at a dotted path, ``[*]`` standing for every item; None when the type lacks it."""
    if "[*]" not in path:
        found = layout.numbers.get(_key(path))
        return None if found is None else (found,)
    head, tail = path.split("[*]", 1)
    base = _key(head)
    if base not in layout.lengths:
        return None
    rest = _key(tail.lstrip("."))
    parts = [layout.numbers.get((*base, index, *rest)) for index in range(layout.lengths[base])]
    return tuple(part for part in parts if part is not None)


def _names(layout: Layout, path: str, data: bytes) -> tuple[tuple[str, ...], list[Chars]]:
    head, _, tail = path.partition("[*]")
    base, rest = _key(head), _key(tail.lstrip("."))
    if base not in layout.lengths:
        raise LayoutError(f"its type has no field {path}")
    chars = [layout.texts[(*base, index, *rest)] for index in range(layout.lengths[base])]
    try:
        names = tuple(data[c.offset : c.offset + c.size].decode("utf-8") for c in chars)
    except UnicodeDecodeError as error:
        raise LayoutError("a joint name is not UTF-8") from error
    return names, chars


def _stamp(layout: Layout, path: str | None) -> tuple[Numbers, Numbers] | None:
    if path is None:
        return None
    seconds, rest = (layout.numbers.get(_key(f"{path}.{part}")) for part in ("sec", "nanosec"))
    return (seconds, rest) if seconds is not None and rest is not None else None


def make_plan(layout: Layout, profile: Profile, data: bytes) -> Plan:
    """Plan the extraction of a profile's columns.

    Args:
        layout: of ``data``.
        profile: which fields are meant.
        data: the message the layout was taken from.

    Raises:
        LayoutError: the message does not hold what the profile needs, or holds it inconsistently.
    """
    names: tuple[str, ...] = ()
    ranges = list(layout.guards)
    if profile.names is not None:
        names, chars = _names(layout, profile.names, data)
        ranges += [(c.offset, c.offset + c.size) for c in chars]
    if profile.role == "wrench":
        columns = {"wrench": tuple(part for path in profile.wrench for part in _find(layout, path) or ())}
    else:
        found = {name: _find(layout, path) for name, path in profile.quantities().items()}
        columns = {name: parts for name, parts in found.items() if parts}
    columns = {name: parts for name, parts in columns.items() if _count(parts)}
    check_counts(profile, names, {name: _count(parts) for name, parts in columns.items()})
    stamp = _stamp(layout, profile.stamp)
    key = GroupKey(names, tuple((name, _count(parts)) for name, parts in columns.items()), stamp is not None)
    return Plan(layout.size, key, _guards(ranges, data), stamp, columns)


def _count(parts: tuple[Numbers, ...]) -> int:
    return sum(part.count for part in parts)


def check_counts(profile: Profile, names: tuple[str, ...], counts: dict[str, int]) -> None:
    """Refuse messages whose arrays do not fit their names.

    Raises:
        LayoutError: no names, a name twice, arrays of other lengths than the names, or nothing usable at all.
    """
    if profile.role == "wrench":
        if counts.get("wrench") != 6:
            raise LayoutError(f"it has {counts.get('wrench', 0)} of the six numbers of a wrench")
        return
    if len(set(names)) != len(names):
        twice = sorted({name for name in names if names.count(name) > 1})
        raise LayoutError(f"it names the joint {twice[0]!r} twice")
    if profile.names is not None and not names:
        raise LayoutError("it names no joints")
    for quantity, count in counts.items():
        if names and count != len(names):
            raise LayoutError(f"it has {len(names)} joint names and {count} values of {quantity}")
    if not counts:
        raise LayoutError("it holds no position, velocity or effort")
