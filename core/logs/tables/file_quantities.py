"""Which columns of each file are which signal; files of one quantity each are told apart by their names."""

from __future__ import annotations

import fnmatch
import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from collaudit.core.config.config_table import ColumnPattern
from collaudit.core.config.schema import CsvConfig
from collaudit.core.errors import LogError
from collaudit.core.logs.signals.joint_naming import listed
from collaudit.core.logs.signals.signal_names import (
    MOTION,
    QUANTITIES,
    Found,
    counts_message,
    families,
    is_usable,
    match_pattern,
    role_of_path,
)
from collaudit.core.logs.storage.readers import TableReader
from collaudit.core.logs.tables.column_assignment import AssignedTable, assign
from collaudit.core.logs.tables.time_columns import fraction_of
from collaudit.core.vendors.vendor_words import CURRENTS, QUANTITY_WORDS, Meaning, SignalRole

#: Words in the name of a file that is one joint's; runs of one joint lie beside one another, too.
_JOINTS = frozenset({"joint", "axis", "motor", "drive"})
#: Names of files that hold the time of the others.
_TIMES = frozenset({"t", "time", "times", "timestamp", "timestamps", "stamp", "stamps"})
#: Shorter words stand in too many names for a pattern of file names.
_SHORTEST = 3
_KEYS = (*QUANTITIES, "time")
_QUANTITY = re.compile(r"(position|velocity|effort)(?=[\[._]?\{i)", re.IGNORECASE)


def assign_columns(
    readers: Sequence[TableReader], settings: CsvConfig, robot: Sequence[str] = ()
) -> list[AssignedTable]:
    """Find out what the columns of each table are.

    Raises:
        LogError: a table lacks columns the configuration names.
    """
    out = []
    first = _time_in_first(readers)
    for reader in readers:
        try:
            out.append(_assigned(reader, settings, first, robot))
        except LogError as error:
            error.where = str(reader.path)
            raise
    return _joint_a_file(out)


def of_one_joint(table: AssignedTable) -> bool:
    """Whether a table is one joint's by its file's name, such as ``axis_3.txt``, and its columns do not say whose."""
    found = [*table.quantities.values()]
    alone = bool(found) and all(len(one.columns) == 1 and one.is_numbered for one in found)
    return alone and not _JOINTS.isdisjoint(re.findall(r"[a-z]+", table.reader.path.stem.lower()))


def _joint_a_file(tables: list[AssignedTable]) -> list[AssignedTable]:
    """Tables of one joint each under the names of their files; by their numbers where these count."""
    if len(tables) < 2 or not all(of_one_joint(table) for table in tables):
        return tables
    if len({frozenset(table.quantities) for table in tables}) > 1:
        return tables  # a file a quantity
    stems = [table.reader.path.stem for table in tables]
    counted = next((family for family in families(stems) if family.counts and len(family.places) == len(stems)), None)
    names = [f"joint{counted.places.index(k) + 1}" if counted else stem for k, stem in enumerate(stems)]
    return [
        replace(table, quantities={key: replace(found, joints=(name,)) for key, found in table.quantities.items()})
        for table, name in zip(tables, names, strict=True)
    ]


def parts_of(files: Sequence[AssignedTable], quantity: str) -> list[tuple[AssignedTable, Found]]:
    """The columns of one quantity, file by file."""
    return [(f, f.quantities[quantity]) for f in files if quantity in f.quantities]


def as_stated(parts: Sequence[tuple[AssignedTable, Found]]) -> str | list[str]:
    """The columns of one quantity as the configuration states them: by their pattern, or by their names.

    In tables without names each is a number behind its file's name.
    """
    patterns = {found.pattern for _, found in parts}
    if len(patterns) == 1 and "" not in patterns:
        return patterns.pop()
    return [_front(table) + table.reader.names[column] for table, found in parts for column in found.columns]


def time_as_stated(files: Sequence[AssignedTable]) -> str | None:
    """The time column as the configuration states it; None without."""
    timed = [file for file in files if file.time]
    if not timed:
        return None
    alone = len(timed) < len(files)  # the numbers of columns without names are the other files', too
    return (_front(timed[0]) if alone else "") + (timed[0].time_name or "")


def written(files: Sequence[AssignedTable]) -> Mapping[str, str]:
    """How the tables are written; a file of one column does not show what stands between columns."""
    return max(files, key=lambda file: len(file.reader.names)).reader.stated


def _front(table: AssignedTable) -> str:
    return "" if table.reader.named else f"{table.reader.path.name}:"


def _time_in_first(readers: Sequence[TableReader]) -> int | None:
    """0 where several tables without names begin with the same column: quantities differ, their time does not."""
    unnamed = [reader for reader in readers if not reader.named and len(reader.names) > 1]
    return 0 if len(unnamed) > 1 and len({reader.first_cells(0) for reader in unnamed}) == 1 else None


def _assigned(reader: TableReader, settings: CsvConfig, first: int | None, robot: Sequence[str]) -> AssignedTable:
    own = settings.changed(_of_this_file(reader, settings))
    table = _with_rest(_with_named_joints(assign(reader, own, robot), robot))
    if table.quantities or any(getattr(settings, key) is not None for key in QUANTITIES):
        return _as_file_says(table)
    if not table.time and settings.row_period_s is None:
        time = 0 if holds_time_alone(reader) else first if not reader.named else None
        table = table if time is None else replace(table, time=(time,), guessed=("time",))
    found = _by_file_name(table)
    return table if found is None else replace(table, quantities=dict([found]), guessed=(found[0], *table.guessed))


def _with_rest(table: AssignedTable) -> AssignedTable:
    """Whole seconds with the column of the rest of each, where the names say that they go together."""
    whole = table.reader.named and len(table.time) == 1 and "".join(table.reader.first_cells(table.time[0])).isdigit()
    rest = fraction_of(table.reader.names, table.time[0]) if whole else None
    return table if rest is None else replace(table, time=(*table.time, rest))


def holds_time_alone(reader: TableReader) -> bool:
    """Whether a file is named as the time of others, and holds one column."""
    return len(reader.names) == 1 and not _TIMES.isdisjoint(_words(reader.path.name))


def _words(name: str) -> list[str]:
    """Words of a file's name; ``joint`` in front of one says nothing."""
    text = re.sub(r"(?<=[a-z])(?=[A-Z])", "_", name.rpartition(".")[0]).lower()
    return [word.removeprefix("joints").removeprefix("joint") for word in re.split(r"[^a-z]+", text)]


def _of_this_file(reader: TableReader, settings: CsvConfig) -> dict[str, ColumnPattern | int]:
    """The patterns that name this file, without its name; of a table that states its own columns, those."""
    patterns = {key: getattr(settings, key) for key in _KEYS}
    if all(pattern is None for pattern in patterns.values()):
        return {key: value for key, value in reader.stated.items() if key in _KEYS}
    return {key: _without_file(pattern, reader.path.name) for key, pattern in patterns.items() if pattern is not None}


def _without_file(pattern: Any, file: str) -> Any:
    """Patterns without the name of the file in front; those of another file stay, and match no column."""
    if isinstance(pattern, list):
        return [_without_file(item, file) for item in pattern]
    if isinstance(pattern, int):
        return pattern
    name, colon, rest = pattern.partition(":")
    return rest if colon and (name == file or fnmatch.fnmatchcase(file, name)) else pattern


def quantity_of_file(name: str) -> tuple[str, str] | None:
    """The quantity that a file's name states, and the word that does; None for none or several."""
    found = {quantity: word for word in _words(name) for quantity, known in QUANTITY_WORDS.items() if word in known}
    return next(iter(found.items())) if len(found) == 1 else None


def _role_of_file(name: str) -> SignalRole:
    return role_of_path(name.rpartition(".")[0].replace(".", "_"))


def _as_file_says(table: AssignedTable) -> AssignedTable:
    """Stated columns of one quantity in a file of that name have the role that the name says."""
    stated, role = quantity_of_file(table.file), _role_of_file(table.file)
    if stated is None or is_usable(role) or [*table.quantities] != [stated[0]]:
        return table
    found = table.quantities[stated[0]]
    return replace(table, quantities={stated[0]: replace(found, meaning=replace(found.meaning, role=role))})


def _by_file_name(table: AssignedTable) -> tuple[str, Found] | None:
    """The quantity that the file's name states, of its numbered columns; None where they are of several kinds.

    In a table without names all columns but the time are numbered.
    """
    stated, role, names = quantity_of_file(table.file), _role_of_file(table.file), table.reader.names
    if stated is None or not is_usable(role):
        return None
    quantity, word = stated
    meaning = Meaning(quantity, role, word, "current" if word in CURRENTS else "")
    file = f"*{word}*" if len(word) >= _SHORTEST else table.file
    columns = [index for index, name in enumerate(names) if name and index not in table.time]
    if not table.reader.named:
        pattern = "" if table.time else f"{file}:{{i}}"
        return quantity, Found.numbered(columns, pattern, meaning)
    whole = [family for family in families(names) if family.counts and set(family.places) == set(columns)]
    return (quantity, Found.numbered(whole[0].places, f"{file}:{whole[0].pattern}", meaning)) if whole else None


def _with_named_joints(table: AssignedTable, robot: Sequence[str]) -> AssignedTable:
    """Numbered columns under the names that the table holds beside a message's, or the robot's in theirs.

    Raises:
        LogError: the names differ from row to row: several publishers take turns, and no column is one joint's.
    """
    quantities = dict(table.quantities)
    for quantity, found in quantities.items():
        if not found.is_numbered:
            continue
        joints = _joint_names_of(table.reader, found) if quantity in MOTION and counts_message(found.pattern) else None
        joints = joints or _robot_names_of(table.reader, found, robot)
        if joints is not None:
            quantities[quantity] = replace(found, joints=joints)
    return replace(table, quantities=quantities)


def _robot_names_of(reader: TableReader, found: Found, robot: Sequence[str]) -> tuple[str, ...] | None:
    """The robot's joint whose whole name is in each column's, where each has one of its own."""
    whole = [(joint, re.compile(rf"(?<![^\W_]){re.escape(joint)}(?![^\W_])")) for joint in robot]
    hits = [[joint for joint, name in whole if name.search(reader.names[index])] for index in found.columns]
    joints = tuple(max(hit, key=len) for hit in hits if hit)
    return joints if len(set(joints)) == len(found.columns) else None


def _joint_names_of(reader: TableReader, found: Found) -> tuple[str, ...] | None:
    """What the columns ``name`` of the same message say, where there are as many."""
    columns = match_pattern(reader.names, _QUANTITY.sub("name", found.pattern))
    if columns is None or len(columns.columns) != len(found.columns):
        return None
    held = [tuple(dict.fromkeys(reader.first_cells(index))) for index in columns.columns]
    varying = [reader.names[index] for index, cells in zip(columns.columns, held, strict=True) if len(cells) > 1]
    if varying:
        raise LogError(
            f"the joints' names change from row to row in {listed(varying)}: several publishers take turns",
            found=listed([cell for cells in held for cell in cells]),
            hint="export one publisher's messages; or read the bag itself, which keeps them apart",
        )
    names = tuple(cells[0] for cells in held if cells and cells[0])
    return names if len(set(names)) == len(found.columns) else None
