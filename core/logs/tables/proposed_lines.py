"""The lines of a configuration that read a table as it was recognised, and those that are still missing."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import TYPE_CHECKING

from collaudit.core.logs.log_summary import ColumnInfo
from collaudit.core.logs.tables.file_quantities import AssignedTable, as_stated, time_as_stated, written

if TYPE_CHECKING:
    from collaudit.core.config.schema import CsvConfig

_KEYS = ("position", "velocity", "effort", "temperature")
#: What is asked for where nothing was recognised.
_QUESTIONS = {
    "position": "which columns are the positions of the joints, in the robot's order?",
    "effort": "which columns are the measured efforts?",
}


def proposed_lines(
    files: Sequence[AssignedTable], columns: Sequence[ColumnInfo], settings: CsvConfig
) -> tuple[str, ...]:
    """Lines of ``[log.csv]``; none where the configuration already states the columns.

    What was recognised stands as it would be written; what is a guess by the numbers, or missing, is commented out.

    Args:
        files: the tables of one log.
        columns: what each column may be.
        settings: what is stated already.
    """
    if settings.position is not None:
        return ()
    lines = ["[log.csv]"]
    stated = written(files)
    if "delimiter" in stated and stated["delimiter"] != ",":
        lines.append(f"delimiter = {_toml(stated['delimiter'])}")
    if stated.get("decimal") == ",":
        lines.append('decimal = ","')
    if not files[0].reader.named:
        lines.append("header = false")
    lines += _time_lines(files, columns, settings)
    for key in _KEYS:
        found = [(file, file.assignment.quantities[key]) for file in files if key in file.assignment.quantities]
        if found:
            lines.append(f"{key} = {_toml(as_stated(found))}")
        else:
            lines += _asked(key, files, columns)
    labels = [column.name for column in columns if column.role == "label?"]
    if labels:
        lines.append(f"# labels = {_toml(labels)}  # if they mark true contacts")
    return tuple(lines)


def _time_lines(files: Sequence[AssignedTable], columns: Sequence[ColumnInfo], settings: CsvConfig) -> list[str]:
    if settings.row_period_s is not None or settings.time is not None:
        return []
    named = time_as_stated(files)
    if named is not None:
        return [f"time = {_toml(named)}"]
    rising = [column for column in columns if column.role == "time?"]
    if rising:
        return [f"# time = {_key(rising[0], files)}  # {rising[0].why}"]
    return ["# rate_hz = 1000.0  # no time column was recognised: state your own number of rows per second"]


def _asked(key: str, files: Sequence[AssignedTable], columns: Sequence[ColumnInfo]) -> list[str]:
    likely = [column for column in columns if column.role == f"{key}?"]
    if likely:
        listed = ", ".join(_key(column, files) for column in likely)
        return [f"# {key} = [{listed}]  # by their numbers ({likely[0].why}): check"]
    return [f"# {key} = …  # {_QUESTIONS[key]}"] if key in _QUESTIONS else []


def _key(column: ColumnInfo, files: Sequence[AssignedTable]) -> str:
    """A column as the configuration names it: by its number in a table without names."""
    named = next(file.reader.named for file in files if file.reader.path.name == column.file)
    return _toml(column.name) if named else column.name


def _toml(value: object) -> str:
    return json.dumps(value, ensure_ascii=False)
