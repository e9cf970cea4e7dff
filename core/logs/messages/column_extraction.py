"""From a layout and a profile to the byte ranges that are the wanted columns."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from collaudit.core.logs.messages.decoded_columns import MOTION, GroupKey
from collaudit.core.logs.messages.layout import Layout, LayoutError, Numbers, Path
from collaudit.core.logs.messages.profiles import ANNOTATION, Profile
from collaudit.core.logs.storage.records import NS_PER_S, ByteArray
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray

#: Guarded bytes closer than this are compared in one go, the bytes between them masked out.
_NEAR = 16
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
    view = rows[:, part.offset : part.offset + part.size].view(part.code)
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


@dataclass(slots=True)
class _Finder:
    """Finds the fields of paths in one message; ``bound`` collects strings that must stay as they are."""

    layout: Layout
    data: bytes
    bound: list[tuple[int, int]]

    def numbers(self, path: str) -> tuple[Numbers, ...]:
        """The runs of numbers of the first alternative the type has and fills; none when there is none."""
        for alternative in path.split("|"):
            parts = [self._one(single) for single in alternative.split(",")]
            runs = tuple(run for part in parts for run in part or ())
            if all(part is not None for part in parts) and _count(runs):
                return runs
        return ()

    def _one(self, path: str) -> tuple[Numbers, ...] | None:
        if "[*]" not in path:
            found = self.layout.numbers.get(key_of(path))
            return None if found is None else (found,)
        head, tail = path.split("[*]", 1)
        base = key_of(head)
        if base not in self.layout.lengths:
            return None
        items = [(*base, index) for index in range(self.layout.lengths[base])]
        if tail.startswith("{"):
            return tuple(self._chosen(item, tail) for item in items) if items else ()
        parts = [self.layout.numbers.get((*item, *key_of(tail.lstrip(".")))) for item in items]
        return tuple(part for part in parts if part is not None)

    def _chosen(self, item: Path, choice: str) -> Numbers:
        """The one of an item's values whose key is as asked."""
        keys, values, wanted = choice_of(choice)
        texts = [self.text((*item, keys, k)) for k in range(self.layout.lengths.get((*item, keys), 0))]
        run = self.layout.numbers.get((*item, values))
        if run is None or wanted not in texts or texts.index(wanted) >= run.count:
            return Numbers(0, "<f8", 0)
        return Numbers(run.offset + texts.index(wanted) * int(run.code[2:]), run.code, 1)

    def text(self, path: Path) -> str:
        """A string of the message, which from now on binds the layout."""
        chars = self.layout.texts[path]
        self.bound.append((chars.offset, chars.offset + chars.size))
        try:
            return self.data[chars.offset : chars.offset + chars.size].decode("utf-8")
        except UnicodeDecodeError as error:
            raise LayoutError("a joint name is not UTF-8") from error

    def names(self, path: str) -> tuple[str, ...]:
        """The strings at a path."""
        head, _, tail = path.partition("[*]")
        base, rest = key_of(head), key_of(tail.lstrip("."))
        if base in self.layout.texts:
            return (self.text(base),)
        if base not in self.layout.lengths:
            raise LayoutError(f"its type has no field {path}")
        return tuple(self.text((*base, index, *rest)) for index in range(self.layout.lengths[base]))


def key_of(path: str) -> Path:
    """A dotted path as a layout names it."""
    return tuple(path.split(".")) if path else ()


def choice_of(choice: str) -> tuple[str, str, str]:
    """Keys, values and the wanted key of ``{keys:values=wanted}``."""
    fields, wanted = choice.strip("{}").split("=")
    keys, values = fields.split(":")
    return keys, values, wanted


def make_plan(layout: Layout, profile: Profile, data: bytes) -> Plan:
    """Plan the extraction of a profile's columns.

    Args:
        layout: of ``data``.
        profile: which fields are meant.
        data: the message the layout was taken from.

    Raises:
        LayoutError: the message does not hold what the profile needs, or holds it inconsistently.
    """
    finder = _Finder(layout, data, list(layout.guards))
    named = finder.names(profile.names) if profile.names is not None and not _counted(profile, layout) else ()
    columns = {name: finder.numbers(path) for name, path in profile.quantities().items()}
    columns = {name: parts for name, parts in columns.items() if _count(parts)}
    counts = usable_counts({name: _count(parts) for name, parts in columns.items()})
    columns = {name: _joined(columns[name]) for name in counts}
    names = check_counts(profile, named, counts)
    stamp = finder.numbers(profile.stamp) if profile.stamp is not None else ()
    pair = (stamp[0], stamp[1]) if len(stamp) == 2 and stamp[0].count == stamp[1].count == 1 else None
    key = GroupKey(names, tuple(counts.items()), pair is not None)
    return Plan(layout.size, key, _guards(finder.bound, data), pair, columns)


def _counted(profile: Profile, layout: Layout) -> bool:
    """Whether a phase is told by a number, not by a word."""
    return profile.role == "phase" and key_of(profile.names or "") in layout.numbers


def _joined(parts: tuple[Numbers, ...]) -> tuple[Numbers, ...]:
    """Runs of numbers with those that follow each other as one: six fields of a wrench are an array of six."""
    out: list[Numbers] = []
    for part in parts:
        last = out[-1] if out else None
        if last is not None and (last.code, last.offset + last.size) == (part.code, part.offset):
            out[-1] = Numbers(last.offset, last.code, last.count + part.count)
        else:
            out.append(part)
    return tuple(out)


def _count(parts: tuple[Numbers, ...]) -> int:
    return sum(part.count for part in parts)


def usable_counts(counts: dict[str, int]) -> dict[str, int]:
    """Without temperatures and second torques that some joints lack: motion is not lost for that."""
    motion = max((counts.get(name, 0) for name in MOTION), default=0)
    beside = ("temperature", "joint_torque")
    return {name: count for name, count in counts.items() if name not in beside or count == motion}


def check_counts(profile: Profile, named: tuple[str, ...], counts: dict[str, int]) -> tuple[str, ...]:
    """Refuse messages whose arrays do not fit their names.

    Returns:
        The joint names, those the profile implies where the message has none.

    Raises:
        LayoutError: no names, a name twice, arrays of other lengths than the names, or nothing usable at all.
    """
    if profile.role == "wrench":
        if counts.get("wrench") != 6:
            raise LayoutError(f"it has {counts.get('wrench', 0)} of the six numbers of a wrench")
        return ()
    if profile.role in ("label", "phase"):
        if not named and not counts:
            paths = ", ".join(path for _, path in profile.annotations)
            raise LayoutError(f"its type has no number or text at {paths}")
        return named
    counts = {quantity: count for quantity, count in counts.items() if not quantity.startswith(ANNOTATION)}
    names = named if profile.names is not None else profile.implied_names(max(counts.values(), default=0))
    if not names:
        raise LayoutError("it names no joints")
    if len(set(names)) != len(names):
        twice = sorted({name for name in names if names.count(name) > 1})
        raise LayoutError(f"it names the joint {twice[0]!r} twice")
    for quantity, count in counts.items():
        if count != len(names):
            raise LayoutError(f"it has {len(names)} joint names and {count} values of {quantity}")
    if not counts:
        raise LayoutError("it holds no position, velocity or effort")
    return names
