"""Which column of a CSV is which signal of which joint: by the configuration's patterns, or by common names."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

from collaudit.core.config.config_table import ColumnPattern
from collaudit.core.config.schema import CsvConfig
from collaudit.core.errors import LogError
from collaudit.core.logs.signals.joint_naming import listed
from collaudit.core.logs.signals.signal_names import (
    MOTION,
    QUANTITIES,
    Found,
    bare,
    column_index,
    match_pattern,
    role_of_path,
    strongest,
    words_of,
)
from collaudit.core.logs.storage.readers import TableReader
from collaudit.core.logs.tables.column_groups import (
    Choice,
    choose,
    groups_of,
    is_measured,
    meaning_of,
    with_unknown,
)
from collaudit.core.logs.tables.time_columns import guess_time
from collaudit.core.vendors.vendor_words import QUANTITY_WORDS, ROLE_WORDS, UNIT_WORDS, Meaning

#: What stands between a joint's name and the word.
_BETWEEN = re.compile("[_./ -]")
#: A joint's name in brackets behind the word; what bare() leaves of a unit has none.
_BRACKETED = re.compile(r"(?P<words>[^][]+)\[(?P<joint>[^][]+)\]")
#: Words that no joint's name begins or ends with: the column is no measurement of it, or of no joint.
_NO_JOINT = frozenset({*(word for role in ("desired", "commanded", "model", "external", "error", "derivative")
                         for word in ROLE_WORDS[role] if len(word) > 1),
                       "d", "act", "actual", "measured", "meas", "step", "index", "idx", "x", "y", "z", "w", "roll",
                       "pitch", "yaw", "rx", "ry", "rz", "norm", "rms", "mean", "std", "count", "orientation",
                       *UNIT_WORDS} - {"a", "id"})  # fmt: skip
#: Those of them that are a joint's where positions and efforts have them beside another joint: a shoulder's pitch, SP.
_DOUBTFUL = frozenset({"roll", "pitch", "yaw", "sp"})
#: Words that no joint's name holds anywhere: the column is of another quantity than the word beside it.
_QUANTITIES = frozenset({*(word for words in QUANTITY_WORDS.values() for word in words if len(word) > 1),
                         *ROLE_WORDS["derivative"]})  # fmt: skip


@dataclass(frozen=True, slots=True, eq=False)
class AssignedTable:
    """One opened table, and which of its columns is which signal.

    Attributes:
        reader: of the table.
        time: the columns that make the time together: one, whole seconds and the rest of each, a date and a time of day
            (and milliseconds); none where there is no time.
        quantities: quantity to its columns.
        wrench: six column indices, or empty.
        guessed: quantities (and ``time``) recognised by their names.
        passed_over: quantity to groups of columns of it that are not taken, each with its role.
        open: quantity to patterns between which the names do not decide.
    """

    reader: TableReader
    time: tuple[int, ...]
    quantities: Mapping[str, Found]
    wrench: tuple[int, ...]
    guessed: tuple[str, ...] = field(default=())
    passed_over: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    open: Mapping[str, tuple[str, ...]] = field(default_factory=dict)

    @property
    def time_name(self) -> str | None:
        """The time column, of several the first; None without."""
        return self.reader.names[self.time[0]] if self.time else None

    @property
    def file(self) -> str:
        """The name of the file."""
        return self.reader.path.name


def _configured(names: Sequence[str], pattern: ColumnPattern, quantity: str) -> Found | None:
    if isinstance(pattern, str):
        if "{" in pattern:
            try:
                found = match_pattern(names, pattern)
            except LogError as error:
                raise LogError(error.message, found=error.found, hint=f"[log.csv] {quantity} = {error.hint}") from error
            return None if found is None else _with_meaning(names, found)
        pattern = [pattern]
    columns = _all_of(names, pattern, quantity)
    return _with_meaning(names, Found.numbered(columns, "")) if columns else None


def _all_of(names: Sequence[str], keys: Sequence[str | int], what: str) -> tuple[int, ...]:
    """Indices of columns that are named one by one; none where the file has none of them."""
    found = {key: column_index(names, key) for key in keys}
    missing = [str(key) for key, index in found.items() if index is None]
    if missing and (what == "time" or len(missing) < len(found)):
        raise LogError(
            f"[log.csv] {what} names columns that the file does not have: {listed(missing)}", found=listed(names, 40)
        )
    return tuple(index for index in found.values() if index is not None)


def _with_meaning(names: Sequence[str], found: Found) -> Found:
    """With what the words of stated columns say, or what their source documents of them: their role and unit are used.

    Columns of which only some words are known, such as those with joints' names, have the role of these.
    """
    known = next((group.meaning for group in groups_of(names) if group.columns == found.columns), None)
    known = known or meaning_of(found.stem)
    role = strongest({role_of_path(bare(names[column])) for column in found.columns})
    return replace(found, meaning=known or replace(found.meaning, role=role))


def assign(reader: TableReader, settings: CsvConfig, robot: Sequence[str] = ()) -> AssignedTable:
    """Assign a table's columns.

    Args:
        reader: of the table; columns without names are never guessed.
        settings: the configuration's patterns; what it leaves open is recognised by common names.
        robot: the robot's joints; columns that carry their names are named, not numbered.

    Raises:
        LogError: the configuration names columns the file does not have.
    """
    names = reader.names
    if isinstance(settings.time, list):
        time = _all_of(names, settings.time, "time")
    else:
        guess = guess_time(names) if reader.named else None
        index = guess if settings.time is None else column_index(names, settings.time)
        time = (index,) if index is not None else ()
    guessed = ["time"] if time and settings.time is None else []
    stated = {quantity: pattern for quantity in QUANTITIES if (pattern := getattr(settings, quantity)) is not None}
    configured = {quantity: _configured(names, pattern, quantity) for quantity, pattern in stated.items()}
    quantities = {quantity: found for quantity, found in configured.items() if found is not None}
    choices: dict[str, Choice] = {}
    if reader.named and not stated:
        quantities, choices = recognise(names, time[0] if time else None, robot)
        guessed = [*quantities, *guessed]
    wrench = [column_index(names, key) for key in settings.wrench or ()]
    six = tuple(index for index in wrench if index is not None)
    passed = {q: tuple(group.said for group in choice.passed) for q, choice in choices.items() if choice.passed}
    undecided = {q: tuple(group.pattern for group in choice.open) for q, choice in choices.items() if choice.open}
    return AssignedTable(reader, time, quantities, six if len(six) == 6 else (), tuple(guessed), passed, undecided)


def recognise(
    names: Sequence[str], time: int | None, robot: Sequence[str] = ()
) -> tuple[dict[str, Found], dict[str, Choice]]:
    """Quantities by the names of their columns, and what the vocabulary says of them."""
    every = [name if index != time else "" for index, name in enumerate(names)]
    choices = _choices(every, ())
    joints = _joints_in(every, robot)
    counted = max((len(choice.taken.columns) for choice in choices.values() if choice.taken is not None), default=0)
    # where most joints are numbered and none is called as the robot's, they are told by their order
    own = not robot or not {*robot}.isdisjoint(joints) or 2 * counted < len(joints)
    names_tell = not {*joints} <= {*Found.numbered(range(len(joints)), "").joints} and {*joints} <= {*robot}
    if joints and own and (len(joints) > counted or names_tell):
        choices = _choices(every, joints)
    found = {quantity: choice.taken for quantity, choice in choices.items() if choice.taken is not None}
    asked = any(choice.open for choice in choices.values())
    return found if found or asked else _single_joint(every), choices


def _choices(names: Sequence[str], joints: Sequence[str]) -> dict[str, Choice]:
    """What is taken for each quantity of columns that are called by joints, and by numbers."""
    groups = groups_of(names, joints)
    first = choose(groups, "position")
    known = first.taken or next(iter(first.open), None)
    choices = {quantity: choose(groups, quantity, len(known.columns) if known else None) for quantity in QUANTITY_WORDS}
    fast = choices["velocity"]
    if first.taken is not None and fast.taken is not None and fast.taken.meaning.motor:
        choices["velocity"] = Choice(None, (fast.taken, *fast.passed))  # of the other side of the gear
    used = {column for choice in choices.values() if choice.taken is not None for column in choice.taken.columns}
    return with_unknown(choices, ["" if index in used else name for index, name in enumerate(names)], joints)


def _joints_in(names: Sequence[str], robot: Sequence[str]) -> tuple[str, ...]:
    """What columns are called but for the word of the quantity, by the way that names most joints.

    Names that only count in part, such as ``J1`` beside ``gripper``, are seen where positions and efforts share them;
    else joints are named by columns that no number tells apart.
    """
    found = _ways(names, robot)
    of_effort = [{*joints} for joints in found["effort"]]
    alike = max((joints for joints in found["position"] if {*joints} in of_effort), key=len)
    counted = {column for group in groups_of(names) for column in group.columns}
    found = _ways(["" if column in counted else name for column, name in enumerate(names)], robot)
    position, velocity, effort = (max(found[quantity], key=len) for quantity in MOTION)
    shared = not {*position}.isdisjoint(effort)
    return max(alike, tuple(dict.fromkeys((*position, *effort))) if shared else position or effort or velocity, key=len)


def _ways(names: Sequence[str], robot: Sequence[str]) -> dict[str, list[tuple[str, ...]]]:
    """The joints of each quantity by each way to cut its columns' names, the shortest words first; none is one, too."""
    ways: dict[tuple[str, str], list[str]] = {}
    for name in names:
        for pattern, joint, meaning in dict.fromkeys((*_cuts(bare(name)), *_cuts(name.strip().lstrip("/")))):
            ways.setdefault((meaning.quantity, pattern.lower()), []).append(joint)
    held = {quantity: {joint for way, joints in ways.items() if way[0] == quantity for joint in joints}
            for quantity in MOTION}  # fmt: skip
    both = held["position"] & held["effort"]
    sure = {*robot, *(both if any(_is_joint(joint, number=r"\d") for joint in both) else ())}
    sure = {joint for joint in sure if joint in robot or not _DOUBTFUL.isdisjoint(words_of(joint))}
    found: dict[str, list[tuple[str, ...]]] = {quantity: [()] for quantity in QUANTITY_WORDS}
    for (quantity, _), joints in sorted(ways.items(), key=lambda each: len(each[0][1])):
        found[quantity].append(_without_path(_of_joints(joints, sure)))
    return found


def _cuts(text: str) -> Iterator[tuple[str, str, Meaning]]:
    """Each way to cut a name: the pattern, the joint, and what the words beside it mean, where these are measured."""
    ways = [(hit["joint"], hit["words"], hit["words"] + "[{joint}]")] if (hit := _BRACKETED.fullmatch(text)) else []
    for cut in _BETWEEN.finditer(text):
        ways.append((text[: cut.start()], text[cut.end() :], "{joint}" + text[cut.start() :]))
        ways.append((text[cut.end() :], text[: cut.start()], text[: cut.end()] + "{joint}"))
    for joint, words, pattern in ways:
        meaning = meaning_of(words)
        if meaning is not None and is_measured(meaning) and not meaning.motor:
            yield pattern, joint, meaning


def _of_joints(names: Sequence[str], sure: Collection[str]) -> list[str]:
    """Those of some names that are joints' by their words, or sure to be, each once; none where they are numbers."""
    turned = any(re.fullmatch(r"(.*[^a-z])?x\d*", name.lower()) for name in names)
    number = r"\d" if turned else r"(?<!^w)\d"  # w1 beside no x is a wrist, and no part of an orientation
    named = {name: name in sure or name.rpartition("/")[2] in sure or _is_joint(name, number) for name in names}
    joints = [name for name, joint in named.items() if joint]
    return joints if any(name in sure or not name.isdecimal() for name in joints) else []


def _is_joint(name: str, number: str) -> bool:
    words = [re.sub(number, "", word) for word in words_of(name)]
    return bool(words) and _NO_JOINT.isdisjoint((words[0], words[-1])) and _QUANTITIES.isdisjoint(words)


def _without_path(joints: Sequence[str]) -> tuple[str, ...]:
    """Names of joints without what stands before all of them."""
    return tuple(joint.rpartition("/")[2] if len({name.rpartition("/")[0] for name in joints}) == 1 else joint
                 for joint in joints)  # fmt: skip


def _single_joint(names: Sequence[str]) -> dict[str, Found]:
    """One column a quantity that is called by its word alone, such as ``position``: a test bench of one joint.

    Nothing where the table holds anything else, such as the name of the joint in each row, or no effort: a position
    alone may be that of anything.
    """
    found: dict[str, Found] = {}
    for index, name in enumerate(names):
        meaning = meaning_of(bare(name).strip().lower())
        if name and (meaning is None or not is_measured(meaning) or meaning.quantity in found):
            return {}
        if meaning is not None:
            found[meaning.quantity] = Found.numbered([index], name, meaning)
    return found if {"position", "effort"} <= found.keys() else {}
