"""From a layout and a profile to the byte ranges that are the wanted columns: the fields that its paths name.

Also of joints that a message lists by interface: one item a joint, or one name a joint and interface.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from collaudit.core.logs.messages.layout import MISSING, Chars, Layout, LayoutError, Node, Numbers
from collaudit.core.logs.signals.signal_names import MOTION
from collaudit.core.logs.storage.readers import NS_PER_S, ByteArray
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray
from collaudit.core.vendors.message_profiles import ANNOTATION, INTERFACES, Profile

Runs = tuple[Numbers, ...]
_MOTION = (*MOTION, "current")
#: What seconds fit a stamp in ns.
_MOST_SECONDS = (1 << 63) // NS_PER_S - 1


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


def joints_of_names(
    named: tuple[str, ...], found: dict[str, Runs], *, listed: bool
) -> tuple[tuple[str, ...], dict[str, Runs]]:
    """Joints of names such as ``joint1/position`` and ``joint1/effort``, each with its interface's value.

    It stands in the array of its quantity, or in the first array of the message where that has none of the quantity.
    What has no interface of motion or effort is no joint.

    Args:
        named: names as the message lists them; anything but joint and interface is left as it is.
        found: quantity to its runs, one number a name.
        listed: whether the message lists its interfaces by joint, so that the names are surely of both.
    """
    if listed:
        pairs = [name.rpartition("/") for name in named]
    else:
        splits = ([name.rpartition(mark) for name in named] for mark in "/._")
        pairs = next(filter(_tell_quantities, splits), [])
    values = {quantity: _each(runs) for quantity, runs in found.items() if runs}
    if not pairs or any(len(numbers) != len(named) for numbers in values.values()):
        return named, found
    first = next((values[quantity] for quantity in MOTION if quantity in values), ())
    joints = tuple(dict.fromkeys(joint for joint, _, interface in pairs if INTERFACES.get(interface) in _MOTION))
    out: dict[str, Runs] = {}
    for quantity in {INTERFACES[interface] for _, _, interface in pairs if interface in INTERFACES}:
        numbers = values.get(quantity, first)
        own = {joint: run for (joint, _, interface), run in zip(pairs, numbers, strict=True)
               if INTERFACES.get(interface) == quantity}  # fmt: skip
        out[quantity] = tuple(own.get(joint, MISSING) for joint in joints)
    return joints, {**{name: runs for name, runs in found.items() if name not in _MOTION}, **out}


def _tell_quantities(pairs: Sequence[tuple[str, str, str]]) -> bool:
    """Whether names are joints with a word of a quantity behind each, of positions and of another."""
    told = {INTERFACES.get(interface) for _, _, interface in pairs}
    return all(joint for joint, _, _ in pairs) and "position" in told and len(told - {None}) > 1


def _each(runs: Runs) -> Runs:
    """Runs of numbers as runs of one number each."""
    return tuple(Numbers(run.offset + k * int(run.code[2:]), run.code, 1) for run in runs for k in range(run.count))


@dataclass(frozen=True, slots=True, eq=False)
class Plan:
    """How to take columns out of a matrix of messages that share a layout.

    Attributes:
        key: names and quantities these messages hold.
        expected: (b,) the first bytes of such a message.
        free: (b,) which of them need not agree.
        stamp: the two numbers of the header's stamp, or None.
        columns: quantity to the runs of numbers that make it up.
    """

    key: GroupKey
    expected: ByteArray
    free: BoolArray
    stamp: Runs | None
    columns: dict[str, Runs]

    def matches(self, rows: ByteArray) -> BoolArray | None:
        """(n,) True for the rows that share this plan's layout and names; None when all of them do."""
        equal: BoolArray = rows[:, : self.expected.shape[0]] == self.expected
        np.logical_or(equal, self.free, out=equal)
        return None if equal.all() else np.asarray(equal.all(axis=1))

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
    """(n, count) numbers as a view of the bytes: copied once, to where they stay; NaN for one that is missing."""
    if part is MISSING:
        return np.full((rows.shape[0], 1), np.nan)
    view: np.ndarray[tuple[int, int], np.dtype[np.generic]]
    view = rows[:, part.offset : part.stop].view(part.code)
    return view


def make_plan(layout: Layout, profile: Profile) -> Plan:
    """Plan the extraction of a profile's columns from messages that share a layout.

    Raises:
        LayoutError: the message does not hold what the profile needs, or holds it inconsistently.
    """
    finder = _Finder(layout, list(layout.guards))
    counted = profile.role == "phase" and isinstance(_at(layout.root, profile.names or ""), Numbers)
    named = finder.names(profile.names) if profile.names is not None and not counted else ()
    paths = {} if named and profile.role == "phase" else profile.quantities()
    found = {name: finder.numbers(path) for name, path in paths.items()}
    if profile.role == "joint_states" and profile.names is not None:
        named, found = joints_of_names(named, found, listed="&" in profile.names)
    current = found.pop("current", ())
    currents = bool(_count(current)) and not _count(found.get("effort", ()))
    found |= {"effort": current} if currents else {}
    counts = _usable(found)
    names = _checked(profile, named, counts)
    stamp = _stamp(finder, profile.stamp) if profile.stamp is not None else None
    key = GroupKey(names, tuple(counts.items()), stamp is not None, currents)
    columns = {name: found[name] for name in counts}
    free = np.ones(max((stop for _, stop in finder.bound), default=0), dtype=np.bool_)
    for start, stop in finder.bound:
        free[start:stop] = False
    expected = np.frombuffer(layout.data, np.uint8)[: free.shape[0]]
    return Plan(key, expected, free, stamp, columns)


def _stamp(finder: _Finder, path: str) -> Runs | None:
    """Seconds and nanoseconds of a stamp; None where they are no two whole numbers."""
    try:
        stamp = finder.numbers(path)
    except LayoutError:
        return None
    if len(stamp) != 2 or any(run.count != 1 or run.code[1] == "f" for run in stamp):
        return None
    (seconds,) = np.frombuffer(finder.layout.data, stamp[0].code, 1, stamp[0].offset).tolist()
    if abs(seconds) > _MOST_SECONDS:
        raise LayoutError("its stamp is beyond all times")
    return stamp


@dataclass(slots=True)
class _Finder:
    """Finds the fields of paths in one message; ``bound`` collects strings that must stay as they are."""

    layout: Layout
    bound: list[tuple[int, int]]

    def numbers(self, path: str) -> Runs:
        """The numbers of the first alternative that the type has and the message fills; none when there is none."""
        for alternative in path.split("|"):
            parts = [self._one(single) for single in alternative.split(",")]
            runs = tuple(run for part in parts for run in part or ())
            if all(part is not None for part in parts) and any(run.count for run in runs):
                return runs
        return ()

    def _one(self, path: str) -> Runs | None:
        head, several, tail = path.partition("[*]")
        node = _at(self.layout.root, head)
        if not several:
            return None if node is None else (_run(node, path),)
        nodes = [_at(item, tail.lstrip(".")) for item in _items(node)]
        if all(node is None for node in nodes):
            return None
        return tuple(MISSING if node is None else _run(node, path) for node in nodes)

    def text(self, node: Node | None) -> str:
        """A string of the message, which from now on binds the layout."""
        if not isinstance(node, Chars):
            raise LayoutError("a joint name is no text")
        self.bound.append((node.offset, node.offset + node.size))
        try:
            return self.layout.data[node.offset : node.offset + node.size].decode("utf-8")
        except UnicodeDecodeError as error:
            raise LayoutError("a joint name is not UTF-8") from error

    def names(self, path: str) -> tuple[str, ...]:
        """The text, or the texts, at a path; of ``a&b[*].c``, each text of ``a`` with those of its item of ``b``."""
        path, _, within = path.partition("&")
        head, _, tail = path.partition("[*]")
        node = _at(self.layout.root, head)
        if node is None:
            raise LayoutError(f"it has no field {path}")
        items = (node,) if isinstance(node, Chars) else _items(node)
        named = tuple(self.text(_at(item, tail.lstrip("."))) for item in items)
        if not within:
            return named
        head, _, tail = within.partition("[*].")
        lists = [_items(_at(item, tail)) for item in _items(_at(self.layout.root, head))]
        if len(lists) != len(named):
            raise LayoutError(f"it has {len(named)} joint names and {len(lists)} lists of interfaces")
        return tuple(f"{name}/{self.text(one)}" for name, texts in zip(named, lists, strict=True) for one in texts)


def _at(node: Node | None, path: str) -> Node | None:
    """A field by its dotted path; None where there is none."""
    for name in path.split(".") if path else ():
        node = node.get(name) if isinstance(node, dict) else None
    return node


def _items(node: Node | None) -> Sequence[Node | None]:
    """The items of a sequence; none of what is none."""
    return node if isinstance(node, list) else ()


def _run(node: Node | None, path: str) -> Numbers:
    if not isinstance(node, Numbers):
        raise LayoutError(f"{path} is no number and no row of numbers")
    return node


def _count(runs: Runs) -> int:
    return sum(1 if run is MISSING else run.count for run in runs)


def _usable(found: dict[str, Runs]) -> dict[str, int]:
    """Numbers of each quantity; none of temperatures and second torques that some joints lack."""
    counts = {name: _count(runs) for name, runs in found.items() if any(run.count for run in runs)}
    motion = max((counts.get(name, 0) for name in MOTION), default=0)
    beside = ("temperature", "joint_torque")
    return {
        name: count
        for name, count in counts.items()
        if name not in beside or (count == motion and MISSING not in found[name])
    }


def _checked(profile: Profile, named: tuple[str, ...], counts: dict[str, int]) -> tuple[str, ...]:
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
