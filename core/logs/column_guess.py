"""What the columns of tables say before a log is read: a configuration, and which tables are parts of one recording."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from collaudit.core.config.schema import CsvConfig, LogConfig
from collaudit.core.errors import LogError
from collaudit.core.logs.log_formats import is_table, open_tables
from collaudit.core.logs.signals.signal_names import QUANTITIES
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
