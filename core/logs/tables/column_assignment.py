"""Which column of a CSV is which signal of which joint: by the configuration's patterns, or by common names."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache

from collaudit.core.config.config_table import ColumnPattern
from collaudit.core.config.schema import CsvConfig
from collaudit.core.errors import LogError
from collaudit.core.logs.signals.joint_naming import listed
from collaudit.core.logs.signals.signal_roles import MARK, role_of_path, strongest, words_of
from collaudit.core.logs.tables.column_groups import (
    Choice,
    choose,
    is_measured,
    numbered_groups,
    preference,
    with_unknown,
)
from collaudit.core.logs.tables.column_patterns import (
    MOTION,
    QUANTITIES,
    Found,
    bare,
    column_index,
    match_pattern,
)
from collaudit.core.logs.tables.column_vocabulary import meaning_of
from collaudit.core.logs.tables.time_columns import fraction_of, guess_time
from collaudit.core.vendors.column_words import QUANTITY_WORDS, ROLE_WORDS, UNIT_WORDS, Meaning

#: What stands between a joint's name and the word.
_BETWEEN = re.compile("[_./ -]")
#: A set point, or a shoulder's pitch: a joint where all quantities have it beside a joint's name.
_MAYBE_JOINT = frozenset({"sp", "SP", "Sp"})
#: A joint's name in brackets behind the word; what bare() leaves of a unit has none.
_BRACKETED = re.compile(r"(?P<words>[^][]+)\[(?P<joint>[^][]*[A-Za-z][^][]*)\]")
#: Words that no joint's name begins or ends with: the column is no measurement of it, or of no joint.
_NO_JOINT = frozenset({*(word for role in ("desired", "commanded", "model", "external", "error", "derivative")
                         for word in ROLE_WORDS[role] if len(word) > 1),
                       "d", "act", "actual", "measured", "meas", "step", "index", "idx", "x", "y", "z", "w", "roll",
                       "pitch", "yaw", "rx", "ry", "rz", "norm", "rms", "mean", "std", "count", "orientation",
                       *UNIT_WORDS} - {"a", "id"})  # fmt: skip
#: Those of them that are turns, and may be a joint's.
_TURNS = frozenset({"roll", "pitch", "yaw"})
#: Words that no joint's name holds anywhere: the column is of another quantity than the word beside it.
_QUANTITIES = frozenset({*(word for words in QUANTITY_WORDS.values() for word in words if len(word) > 1),
                         *ROLE_WORDS["derivative"]})  # fmt: skip


@dataclass(frozen=True, slots=True)
class Assignment:
    """The columns of one file.

    Attributes:
        time: index of the time column, or None.
        fraction: index of the column of nanoseconds where ``time`` holds whole seconds, or None.
        time_parts: indices of the columns that make the time together, where several are stated.
        quantities: quantity to its columns.
        wrench: six column indices, or empty.
        guessed: quantities (and ``time``) recognised by their names.
        passed_over: quantity to groups of columns of it that are not taken, each with its role.
        open: quantity to patterns between which the names do not decide.
    """

    time: int | None
    quantities: Mapping[str, Found]
    wrench: tuple[int, ...]
    guessed: tuple[str, ...] = field(default=())
    passed_over: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    open: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    fraction: int | None = None
    time_parts: tuple[int, ...] = ()


def _configured(names: Sequence[str], pattern: ColumnPattern, quantity: str) -> Found | None:
    if isinstance(pattern, str):
        if "{" in pattern:
            try:
                found = match_pattern(names, pattern)
            except LogError as error:
                raise LogError(error.message, found=error.found, hint=f"[log.csv] {quantity} = {error.hint}") from error
            return None if found is None else _with_meaning(names, found)
        pattern = [pattern]
    indices = [column_index(names, key) for key in pattern]
    if all(index is None for index in indices):
        return None
    missing = [str(key) for key, index in zip(pattern, indices, strict=True) if index is None]
    if missing:
        raise LogError(
            f"[log.csv] {quantity} names columns that the file does not have: {listed(missing)}",
            found=listed(names, 40),
        )
    return _with_meaning(names, Found.numbered([index for index in indices if index is not None], ""))


def _with_meaning(names: Sequence[str], found: Found) -> Found:
    """With what the words of stated columns say, or what their source documents of them: their role and unit are used.

    Columns of which only some words are known, such as those with joints' names, have the role of these.
    """
    known = next((group.meaning for group in numbered_groups(names) if group.columns == found.columns), None)
    known = known or meaning_of(re.sub(r"\{\w+\}", MARK, found.pattern))
    role = strongest({role_of_path(bare(names[column])) for column in found.columns})
    return replace(found, meaning=known or replace(found.meaning, role=role))


def assign(names: Sequence[str], settings: CsvConfig, *, header: bool, robot: Sequence[str] = ()) -> Assignment:
    """Assign a file's columns.

    Args:
        names: column names.
        settings: the configuration's patterns; what it leaves open is recognised by common names.
        header: False for files without names, which are never guessed.
        robot: the robot's joints; columns that carry their names are named, not numbered.

    Raises:
        LogError: the configuration names columns the file does not have.
    """
    time = guess_time(names) if settings.time is None and header else None
    guessed = ["time"] if time is not None else []
    parts: tuple[int, ...] = ()
    if isinstance(settings.time, list):
        parts = _time_parts(names, settings.time)
        time = parts[0]
    elif settings.time is not None:
        time = column_index(names, settings.time)
    stated = {quantity: pattern for quantity in QUANTITIES if (pattern := getattr(settings, quantity)) is not None}
    configured = {quantity: _configured(names, pattern, quantity) for quantity, pattern in stated.items()}
    quantities = {quantity: found for quantity, found in configured.items() if found is not None}
    choices: dict[str, Choice] = {}
    if header and not stated:
        quantities, choices = recognise(names, time, robot)
        guessed = [*quantities, *guessed]
    wrench = [column_index(names, key) for key in settings.wrench or ()]
    six = tuple(index for index in wrench if index is not None)
    passed = {q: tuple(group.said for group in choice.passed) for q, choice in choices.items() if choice.passed}
    undecided = {q: tuple(group.pattern for group in choice.open) for q, choice in choices.items() if choice.open}
    return Assignment(
        time,
        quantities,
        six if len(six) == 6 else (),
        tuple(guessed),
        passed,
        undecided,
        fraction_of(names, time) if time is not None and header and not parts else None,
        parts,
    )


def _time_parts(names: Sequence[str], keys: Sequence[str | int]) -> tuple[int, ...]:
    found = [column_index(names, key) for key in keys]
    missing = [str(key) for key, index in zip(keys, found, strict=True) if index is None]
    if missing:
        raise LogError(
            f"[log.csv] time names columns that the file does not have: {listed(missing)}", found=listed(names, 40)
        )
    return tuple(index for index in found if index is not None)


def recognise(
    names: Sequence[str], time: int | None, robot: Sequence[str] = ()
) -> tuple[dict[str, Found], dict[str, Choice]]:
    """Quantities by the names of their columns, and what the vocabulary says of them."""
    every = [name if index != time else "" for index, name in enumerate(names)]
    known = (*robot, *_turning(every))
    joints = _shared_joints(every, known)
    choices = _numbered(every)
    counted = max((len(choice.taken.columns) for choice in choices.values() if choice.taken is not None), default=0)
    own = not robot or not {*robot}.isdisjoint(joints)  # else the robot's joints are told by their order
    names_tell = not {*joints} <= {*Found.numbered(range(len(joints)), "").joints} and {*joints} <= {*robot}
    if joints and own and (len(joints) > counted or names_tell):
        choices = {key: _of_names(choice, joints) for key, choice in _numbered(_counted(every, joints)).items()}
        return {key: choice.taken for key, choice in choices.items() if choice.taken is not None}, choices
    groups = {column for group in numbered_groups(every) for column in group.columns}
    unnumbered = [name if index not in groups else "" for index, name in enumerate(every)]
    found: dict[str, Found] = {}
    for quantity, choice in choices.items():
        named = _guess_named(unnumbered, quantity, known)
        if choice.taken is not None and (named is None or len(named.columns) <= len(choice.taken.columns)):
            found[quantity] = choice.taken
        elif named is not None and not choice.open:
            found[quantity] = named
            unnumbered = [name if index not in named.columns else "" for index, name in enumerate(unnumbered)]
    found = found or _single_joint(every)
    return {quantity: each for quantity, each in found.items() if not choices[quantity].open}, choices


def _numbered(names: Sequence[str]) -> dict[str, Choice]:
    """What is taken of numbered columns for each quantity."""
    groups = numbered_groups(names)
    first = choose(groups, "position")
    known = first.taken or next(iter(first.open), None)
    choices = {quantity: choose(groups, quantity, len(known.columns) if known else None) for quantity in QUANTITY_WORDS}
    fast = choices["velocity"]
    if first.taken is not None and fast.taken is not None and fast.taken.meaning.motor:
        choices["velocity"] = Choice(None, (fast.taken, *fast.passed))  # of the other side of the gear
    used = {column for choice in choices.values() if choice.taken is not None for column in choice.taken.columns}
    return with_unknown(choices, ["" if index in used else name for index, name in enumerate(names)])


def _counted(names: Sequence[str], joints: Sequence[str]) -> list[str]:
    """Names with the number of its joint in place of each joint's name, so that named columns are numbered ones."""
    numbers = {joint.lower(): str(k) for k, joint in enumerate(joints, 1)}
    longest = sorted(map(re.escape, numbers), key=len, reverse=True)
    whole = re.compile(rf"(?<![^\W_])({'|'.join(longest)})(?![^\W_])", re.IGNORECASE)
    return [whole.sub(lambda hit: numbers[hit[0].lower()], name) for name in names]


def _of_names(choice: Choice, joints: tuple[str, ...]) -> Choice:
    """Of columns that :func:`_counted` numbered: a number stands for a name."""

    def named(group: Found) -> Found:
        whole = len(group.columns) == len(joints)
        return replace(group, joints=joints, pattern=group.pattern.replace("{i}", "{joint}")) if whole else group

    return Choice(
        None if choice.taken is None else named(choice.taken),
        tuple(map(named, choice.passed)),
        tuple(map(named, choice.open)),
    )


def _shared_joints(names: Sequence[str], robot: Sequence[str]) -> tuple[str, ...]:
    """What columns of positions and efforts are called but for the word of the quantity, where they are called alike.

    Names that only count in part, such as ``J1`` beside ``gripper``, are seen by this alone.
    """
    held = {quantity: {joint for name in names for _, joint, meaning in _parts(bare(name).strip())
                       if meaning.quantity == quantity} for quantity in MOTION}  # fmt: skip
    shared = set.intersection(*held.values())
    if any(_NO_JOINT.isdisjoint(words_of(joint)) for joint in shared - _MAYBE_JOINT):
        robot = (*robot, *(shared & _MAYBE_JOINT))
    of_effort = [{*one.joints} for one in _ways_named(names, "effort", robot)]
    alike = (one.joints for one in _ways_named(names, "position", robot)
             if {*one.joints} in of_effort and len({*one.joints}) == len(one.joints))  # fmt: skip
    return max(alike, key=len, default=())


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


@lru_cache(maxsize=1024)
def _parts(text: str) -> tuple[tuple[str, str, Meaning], ...]:
    """Each way to cut a name: the pattern, the joint, and what the words beside it mean, where these are measured.

    Of a name it is asked for every quantity.
    """
    return tuple(_cut(text))


def _cut(text: str) -> Iterator[tuple[str, str, Meaning]]:
    ways = [(hit["joint"], hit["words"], hit["words"] + "[{joint}]")] if (hit := _BRACKETED.fullmatch(text)) else []
    for cut in () if ways else _BETWEEN.finditer(text):
        ways.append((text[: cut.start()], text[cut.end() :], "{joint}" + text[cut.start() :]))
        ways.append((text[cut.end() :], text[: cut.start()], text[: cut.end()] + "{joint}"))
    for joint, words, pattern in ways:
        meaning = meaning_of(words)
        if meaning is not None and is_measured(meaning) and not meaning.motor:
            yield pattern, joint, meaning


def _turning(names: Sequence[str]) -> list[str]:
    """Joints that are called by a turn, such as ``wrist_roll``: in positions and efforts, beside joints that are not.

    An orientation has no efforts, and no joints beside it under the same words.
    """
    held: dict[str, set[str]] = {"position": set(), "effort": set()}
    for text in {form.strip() for name in names for form in (name, bare(name))}:
        for _, joint, meaning in _parts(text):
            held.setdefault(meaning.quantity, set()).add(joint)
    alike = held["position"] & held["effort"]
    words = {joint: words_of(joint) for joint in alike}
    others = [joint for joint in alike if words[joint] and _NO_JOINT.isdisjoint((words[joint][0], words[joint][-1]))]
    return [joint for joint in alike if others and not _TURNS.isdisjoint(words[joint])]


def _guess_named(names: Sequence[str], quantity: str, robot: Sequence[str]) -> Found | None:
    """Columns that are named by their joints, beside words of a measurement; "" for columns that are taken."""
    return max(_ways_named(names, quantity, robot), key=lambda found: len(found.columns), default=None)


def _ways_named(names: Sequence[str], quantity: str, robot: Sequence[str]) -> list[Found]:
    """Columns of joints by each pattern that fits, the usual words of the quantity first."""
    known: dict[str, Meaning] = {}
    for text in {form.strip().lower() for name in names for form in (name, bare(name))}:
        for pattern, _, meaning in _parts(text):
            if meaning.quantity == quantity:
                known[pattern] = meaning
    ranked = sorted(known.items(), key=lambda each: (preference(each[1]), len(each[0]), each[0]))
    matched = ((match_pattern(names, pattern), meaning) for pattern, meaning in ranked)
    ways = (_of_joints(replace(found, meaning=meaning), robot) for found, meaning in matched if found is not None)
    return [found for found in ways if found is not None]


def _of_joints(found: Found, robot: Sequence[str]) -> Found | None:
    """Without columns of no joint, and with what stands before all joints' names as part of the pattern.

    A joint of the robot is one whatever it is called: those of a gantry are x, y and z.
    """
    turned = any(re.fullmatch(r"(.*[^a-z])?x\d*", joint.lower()) for joint in found.joints)
    number = r"\d" if turned else r"(?<!^w)\d"  # w1 beside no x is a wrist, and no part of an orientation
    kept = [
        (joint, column)
        for joint, column in zip(found.joints, found.columns, strict=True)
        if joint.rpartition("/")[2] in robot
        or (
            (words := [re.sub(number, "", word) for word in words_of(joint)])
            and _NO_JOINT.isdisjoint((words[0], words[-1]))
            and _QUANTITIES.isdisjoint(words)
        )
    ]
    if not kept:
        return None
    paths = {joint.rpartition("/")[0] for joint, _ in kept}
    if len(paths) == 1 and (path := paths.pop()):
        found = replace(found, pattern=found.pattern.replace("{joint}", path + "/{joint}"))
        kept = [(joint.rpartition("/")[2], column) for joint, column in kept]
    joints, columns = zip(*kept, strict=True)
    return replace(found, joints=joints, columns=columns)
