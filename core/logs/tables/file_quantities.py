"""Which columns of each file are which signal; files of one quantity each are told apart by their names."""

from __future__ import annotations

import fnmatch
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from collaudit.core.errors import LogError
from collaudit.core.logs.storage.table_reader import TableReader
from collaudit.core.logs.tables.column_assignment import QUANTITIES, Assignment, assign
from collaudit.core.logs.tables.column_patterns import Found, match_pattern
from collaudit.core.logs.tables.joint_name_columns import with_named_joints

if TYPE_CHECKING:
    from collaudit.core.config.config_table import ColumnPattern
    from collaudit.core.config.schema import CsvConfig

#: Words in the names of files that say which quantity all their columns hold.
_WORDS = {
    "position": ("position", "positions", "pos", "q", "angle", "angles", "jointpos", "joint_position"),
    "velocity": ("velocity", "velocities", "vel", "dq", "qd", "qdot", "speed", "speeds"),
    "effort": ("effort", "efforts", "eff", "tau", "torque", "torques", "trq", "moment", "current", "currents", "curr"),
    "temperature": ("temperature", "temperatures", "temp"),
}
#: Shorter words stand in too many names for a pattern of file names.
_SHORTEST = 3
_KEYS = (*QUANTITIES, "time")


@dataclass(frozen=True, slots=True, eq=False)
class AssignedTable:
    """One opened table, and which of its columns is which signal."""

    reader: TableReader
    assignment: Assignment


def assign_columns(readers: Sequence[TableReader], settings: CsvConfig) -> list[AssignedTable]:
    """Find out what the columns of each table are.

    Raises:
        LogError: a table lacks columns the configuration names.
    """
    out = []
    for reader in readers:
        try:
            out.append(AssignedTable(reader, _assigned(reader, settings)))
        except LogError as error:
            raise LogError(error.message, where=str(reader.path), found=error.found, hint=error.hint) from error
    return out


def _assigned(reader: TableReader, settings: CsvConfig) -> Assignment:
    own = settings.changed(_of_this_file(reader, settings))
    assignment = with_named_joints(reader, assign(reader.names, own, header=reader.named))
    if assignment.quantities or not reader.named or any(getattr(settings, key) is not None for key in QUANTITIES):
        return assignment
    found = by_file_name(reader, assignment)
    if found is None:
        return assignment
    return replace(assignment, quantities=dict([found]), guessed=(found[0], *assignment.guessed))


def _of_this_file(reader: TableReader, settings: CsvConfig) -> dict[str, ColumnPattern | int]:
    """The patterns that name this file, without its name; of a table that states its own columns, those."""
    patterns = {key: getattr(settings, key) for key in _KEYS}
    if all(pattern is None for pattern in patterns.values()):
        return {key: value for key, value in reader.stated.items() if key in _KEYS}
    return {key: _without_file(pattern, reader.path.name) for key, pattern in patterns.items() if pattern is not None}


def _without_file(pattern: ColumnPattern | int, file: str) -> ColumnPattern | int:
    if isinstance(pattern, str):
        return _strip(pattern, file)
    if isinstance(pattern, int):
        return pattern
    return [_strip(item, file) for item in pattern if isinstance(item, str)] or pattern


def _strip(pattern: str, file: str) -> str:
    """A pattern without the name of the file in front; of another file it stays, and matches no column."""
    name, colon, rest = pattern.partition(":")
    return rest if colon and (name == file or fnmatch.fnmatchcase(file, name)) else pattern


def quantity_of_file(name: str) -> tuple[str, str] | None:
    """The quantity that a file's name states, and the word that does; None for none or several."""
    words = re.split(r"[^a-z]+", name.rpartition(".")[0].lower())
    found = {quantity: word for word in words for quantity, known in _WORDS.items() if word in known}
    return next(iter(found.items())) if len(found) == 1 else None


def by_file_name(reader: TableReader, assignment: Assignment) -> tuple[str, Found] | None:
    """The quantity that the file's name states, of its numbered columns; None where they are of several kinds."""
    stated = quantity_of_file(reader.path.name)
    if stated is None:
        return None
    names = [name for index, name in enumerate(reader.names) if name and index != assignment.time]
    kinds = {re.sub(r"\d+", "#", name) for name in names}
    if len(kinds) != 1 or (kind := kinds.pop()).count("#") != 1:
        return None
    for number in ("{i0}", "{i}"):
        pattern = kind.replace("#", number)
        found = match_pattern(reader.names, pattern)
        if found is not None and len(found.columns) == len(names):
            quantity, word = stated
            file = f"*{word}*" if len(word) >= _SHORTEST else reader.path.name
            return quantity, replace(found, pattern=f"{file}:{pattern}")
    return None
