"""What is guessed of a log for its configuration: columns and layout of tables, parts of one log, several arms."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from collaudit.core.config.schema import CsvConfig, LogConfig
from collaudit.core.data.joint_log import JointLog
from collaudit.core.errors import LogError
from collaudit.core.logs.log_formats import is_table, open_tables
from collaudit.core.logs.log_summary import LogSummary, TopicInfo
from collaudit.core.logs.signals.joint_naming import guess_joints
from collaudit.core.logs.signals.sample_clock import interpolate
from collaudit.core.logs.signals.signal_names import MARK, QUANTITIES, families
from collaudit.core.logs.storage.file_content import AXIS
from collaudit.core.logs.tables.column_assignment import AssignedTable
from collaudit.core.logs.tables.column_roles import WrenchColumns, find_wrench, stated_units
from collaudit.core.logs.tables.file_quantities import (
    as_stated,
    assign_columns,
    holds_time_alone,
    of_one_joint,
    parts_of,
    quantity_of_file,
    time_as_stated,
    written,
)
from collaudit.core.logs.tables.joined_tables import join_tables
from collaudit.core.logs.tables.time_columns import time_parts

#: Keys that say how a table is written.
_LAYOUT = ("delimiter", "decimal", "header", "units_row", "comment")
#: So many lines before the names of columns, and kinds of remarks between rows, are looked for.
_MOST_LINES, _MOST_REMARKS = 20, 8
#: Poses of two topics this close, rad and share of the range, are two reports on one arm (measured and commanded …).
_SAME_POSE, _SAME_SHARE = 0.02, 0.02


@dataclass(frozen=True, slots=True)
class ColumnGuess:
    """What the names of a log's columns say.

    Attributes:
        csv: a configuration that reads them without guessing.
        joints: the joints as the columns name them.
        units: quantity to the unit that names or their source state.
        passed_over: quantity to columns that are not taken, and why.
        open: quantity to the patterns between which the names do not decide.
        wrench: six columns that may be those of a force/torque sensor.
    """

    csv: CsvConfig
    joints: tuple[str, ...]
    units: Mapping[str, str]
    passed_over: Mapping[str, tuple[str, ...]]
    open: Mapping[str, tuple[str, ...]]
    wrench: WrenchColumns | None = None


def guess_csv_columns(
    paths: Sequence[Path], robot: Sequence[str] = (), settings: CsvConfig | None = None
) -> ColumnGuess | None:
    """Column patterns and joint names recognised in tables.

    Args:
        paths: the files of one log.
        robot: the robot's joints.
        settings: how the tables are written, where that is stated.

    Returns:
        None when no position columns are recognised.
    """
    if not all(path.is_file() and is_table(path) for path in paths):
        return None
    stated = settings or CsvConfig()
    layout = CsvConfig.of({key: getattr(stated, key) for key in _LAYOUT if key in stated.given})
    try:
        tables = assign_columns(open_tables(paths, layout), CsvConfig(), robot)
    except LogError:
        return None
    found = {q: parts for q in QUANTITIES if (parts := parts_of(tables, q))}
    undecided = {q: patterns for table in tables for q, patterns in table.open.items()}
    if "position" not in found and "position" not in undecided:
        return None
    patterns = {quantity: as_stated(parts) for quantity, parts in found.items()}
    joints = tuple(dict.fromkeys(joint for _, part in found.get("position", ()) for joint in part.joints))
    timed = next((table for table in tables if table.time), tables[0])
    whole = len(timed.time) < 2
    time = (time_parts(timed.reader, timed.time) if whole else []) or time_as_stated(tables)
    columns = {"time": time, **patterns, **written(tables)}
    passed = {q: groups for table in tables for q, groups in table.passed_over.items()}
    wrench = next(filter(None, (find_wrench(table.reader.names) for table in tables if table.reader.named)), None)
    return ColumnGuess(CsvConfig.of(columns), joints, stated_units(tables), passed, undecided, wrench)


def guess_layout(paths: Sequence[Path], settings: LogConfig, robot: Sequence[str]) -> dict[str, object]:
    """Keys of the configuration without which tables are not read, by how their lines begin.

    Lines before the names of columns, a row of units below them, remarks between the rows; a JointState in a line.

    Args:
        paths: the files of one log, which cannot be read as joint signals with ``settings``.
        settings: what is stated.
        robot: the robot's joints.

    Returns:
        Dotted keys and values; of a log that these do not mend, those that were found all the same.
    """
    keys: dict[str, object] = {}
    csv = settings.csv
    for line in range(2, _MOST_LINES if csv.header == "auto" else 2):
        if guess_csv_columns(paths, robot, csv) is not None:
            break
        if guess_csv_columns(paths, robot, csv.changed({"header": line})) is not None:
            keys["log.csv.header"] = line
            csv = csv.changed({"header": line})
    for _ in range(_MOST_REMARKS):
        try:
            join_tables(open_tables(paths, csv), settings.changed({"csv": csv}), robot)
        except LogError as error:
            names = error.keys.get("log.joint_names")
            theirs = isinstance(names, dict) and bool(robot) and not {*names.values()} <= {*robot}
            told = {key: value for key, value in error.keys.items() if key != "log.joint_names" or not theirs}
            if not told or told.items() <= keys.items():
                break
            keys |= told
            changes = {key.removeprefix("log.csv."): value for key, value in told.items() if key.startswith("log.csv.")}
            csv = csv.changed(changes)
        else:
            break
    return keys


def table_part(path: Path, settings: LogConfig) -> TablePart | None:
    """The table of a file as a part of a log; None where it cannot be looked into."""
    try:
        return TablePart(assign_columns(open_tables([path], settings.csv), settings.csv)[0])
    except LogError:
        return None


class TablePart:
    """What a table holds, and the beginning of its time column."""

    def __init__(self, table: AssignedTable) -> None:
        self.folder = table.reader.path.resolve().parent
        alone = holds_time_alone(table.reader)
        self.quantities = {"time"} if alone else set(table.quantities)
        axis = AXIS.fullmatch(table.reader.path.stem) if table.reader.format == "kuka-trace" else None
        self.recording = axis[1] if axis is not None else None
        if axis is not None:  # traces hold the same quantities, each of its own axis
            self.quantities = {f"{quantity} of axis {axis[2]}" for quantity in self.quantities}
        if of_one_joint(table) and "position" in self.quantities:  # a file a joint
            self.quantities = {f"{quantity} of {table.file}" for quantity in self.quantities}
        time = () if alone else table.time[:1]
        self.stamps = tuple(cell for column in time for cell in table.reader.first_cells(column))
        self.timeless = None if time else _timeless_name(table)
        self.width = len(table.reader.names)

    @property
    def shared(self) -> tuple[object, ...]:
        """What all parts of one log have in common."""
        return self.folder, self.stamps, self.timeless, self.recording

    def joins(self, others: Sequence[TablePart]) -> bool:
        """Whether this table, which shares the log's folder and stamps, is a further part of it."""
        if not self.quantities or (not self.stamps and self.timeless is None):
            return False
        alike = self.stamps or all(part.width == self.width or "time" in {*part.quantities, *self.quantities}
                                   for part in others)  # fmt: skip
        return bool(alike) and not any(self.quantities & other.quantities for other in others)


def _timeless_name(table: AssignedTable) -> tuple[str, ...] | None:
    """What files without a time column that belong together share: the numbers in their names."""
    name = table.file
    if quantity_of_file(name) is None and not holds_time_alone(table.reader):
        return None
    return tuple(re.findall(r"\d+", name))


@dataclass(frozen=True, slots=True)
class Arm:
    """One arm of a log.

    Attributes:
        keys: dotted keys of the configuration that state its signals.
        topics: its topic, where that tells the arm from the others.
        joints: its joints in the log (of a table without their names its columns), where these tell it.
    """

    keys: Mapping[str, object]
    topics: tuple[str, ...] = ()
    joints: tuple[str, ...] = field(default=())


def arms_of(
    summary: LogSummary, robot: Sequence[str], prismatic: Sequence[str], columns: Mapping[str, Mapping[str, str]]
) -> dict[str, Arm]:
    """The arms of a log by name; empty where it is of one, or where names do not tell.

    Args:
        summary: of the log.
        robot: joints of the description in model order: of one arm, or of all.
        prismatic: those that are prismatic.
        columns: side to quantity to pattern, of a table whose columns are of several sides; one without efforts, such
            as a second encoder's, is no arm.
    """
    if not robot:
        return {}
    columns = {side: patterns for side, patterns in columns.items() if "effort" in patterns}
    if len(columns) > 1:
        return {side: _of_columns(patterns, summary.csv_columns) for side, patterns in columns.items()}
    tables = [topic for topic in summary.topics if topic.role == "joint_states" and topic.readable and topic.joints]
    tables = [topic for topic in tables if topic.has_effort is not False]
    turning = [name for name in robot if name not in set(prismatic)]
    for topic in tables:
        groups = _groups(topic.joints, turning)
        if len(groups) > 1:
            stated = {} if summary.csv_columns else {"log.joint_states": topic.name}
            return {
                name: Arm({**stated, "log.joint_names": dict(names)}, joints=tuple(names))
                for name, names in groups.items()
            }
    return _by_topics(tables, robot, prismatic)


def same_arm(one: JointLog, other: JointLog) -> bool:
    """Whether two topics report the same poses of the same joints at the same time."""
    if one.joint_names != other.joint_names:
        return False
    later_s = ((other.source.start_ns or 0) - (one.source.start_ns or 0)) / 1e9
    there = interpolate(one.time_s, other.time_s + later_s, other.position_rad)
    known = np.isfinite(there).all(axis=1)
    near = _SAME_POSE + _SAME_SHARE * np.ptp(one.position_rad, axis=0)
    return bool(known.any() and (np.abs(one.position_rad - there)[known] <= near).all(axis=1).mean() > 0.5)


def _of_columns(patterns: Mapping[str, str], names: Sequence[str]) -> Arm:
    first = re.escape(patterns["position"]).replace(r"\{i\}", r"\d+").replace(r"\{i0\}", r"\d+")
    own = tuple(name for name in names if re.fullmatch(first, name.strip()))
    return Arm({f"log.csv.{quantity}": pattern for quantity, pattern in patterns.items()}, joints=own)


def _groups(names: Sequence[str], robot: Sequence[str]) -> dict[str, dict[str, str]]:
    """Names of one topic by arm, each log name with the robot's: by the words they have beyond the robot's names.

    Where the robot's names are none of the log's, names that differ in one number are an arm's if they are as many.
    """
    found: dict[str, dict[str, str]] = {}
    by_words = sorted(robot, key=lambda joint: -len(_words(joint)))
    for name in names:
        for joint in by_words:
            if (more := _beyond(_words(name), _words(joint))) is not None:
                found.setdefault("_".join(more) or "arm", {}).setdefault(name, joint)
                break
    if found := {arm: pairs for arm, pairs in found.items() if set(pairs.values()) == set(robot)}:
        return found
    arms = [family for family in families(names) if len(family.places) == len(robot)]
    guesses = [guess_joints([names[place] for place in family.places], robot) for family in arms]
    called = _distinguished([_words(family.stem.replace(MARK, "_")) for family in arms])
    return {name: dict(guess.mapping) for name, guess in zip(called, guesses, strict=True) if guess.sure}


def _by_topics(tables: Sequence[TopicInfo], robot: Sequence[str], prismatic: Sequence[str]) -> dict[str, Arm]:
    """Topics with equally many of the robot's joints, the same ones or others each, under different namespaces."""
    known: dict[str, frozenset[str]] = {}
    for topic in tables:
        guess = guess_joints(topic.joints, robot, prismatic)
        mapping = guess.mapping if guess.sure else {}
        known[topic.name] = frozenset(mapping.get(name, name) for name in topic.joints) & frozenset(robot)
    most = max((len(joints) for joints in known.values()), default=0)
    names = [name for name, joints in known.items() if len(joints) == most > 1]
    called = _distinguished([name.strip("/").split("/")[:-1] or [""] for name in names])
    if len(names) < 2 or len(set(called)) < len(names):
        return {}
    return {arm: Arm({"log.joint_states": topic}, (topic,)) for arm, topic in zip(called, names, strict=True)}


def _distinguished(names: Sequence[Sequence[str]]) -> list[str]:
    """Of each name the words that not all have."""
    common = set[str]().union(*names).intersection(*names) if names else set()
    return ["_".join(_plain(word for word in words if word not in common)) or "arm" for words in names]


def _plain(words: Iterable[str]) -> list[str]:
    return [plain for word in words if (plain := re.sub(r"\W+", "_", word).strip("_"))]


def _words(name: str) -> list[str]:
    return re.findall(r"[^\W_]+", name)


def _beyond(name: Sequence[str], joint: Sequence[str]) -> tuple[str, ...] | None:
    """Words of a name beyond those of a joint, which all are in it, in order and the last one at its end."""
    rest, left = [], list(joint)
    for word in reversed(name):
        if left and word == left[-1]:
            left.pop()
        else:
            rest.append(word)
    return None if left else tuple(reversed(rest))
