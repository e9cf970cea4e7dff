"""A table as a part of a log: what it holds, and whether another table is a further part of the same recording."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

from collaudit.core.config.schema import LogConfig
from collaudit.core.errors import LogError
from collaudit.core.logs.opening import open_tables
from collaudit.core.logs.tables.file_quantities import AssignedTable, assign_columns, holds_time_alone, quantity_of_file


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
        self.quantities = {"time"} if alone else set(table.assignment.quantities)
        time = None if alone else table.assignment.time
        self.stamps = () if time is None else table.reader.first_cells(time)
        self.timeless = _timeless_name(table) if time is None else None
        self.width = len(table.reader.names)

    @property
    def shared(self) -> tuple[object, ...]:
        """What all parts of one log have in common."""
        return self.folder, self.stamps, self.timeless

    def joins(self, others: Sequence[TablePart]) -> bool:
        """Whether this table, which shares the log's folder and stamps, is a further part of it."""
        if not self.quantities or (not self.stamps and self.timeless is None):
            return False
        alike = self.stamps or all(part.width == self.width or "time" in {*part.quantities, *self.quantities}
                                   for part in others)  # fmt: skip
        return bool(alike) and not any(self.quantities & other.quantities for other in others)


def _timeless_name(table: AssignedTable) -> tuple[str, ...] | None:
    """What files without a time column that belong together share: the numbers in their names."""
    name = table.reader.path.name
    if quantity_of_file(name) is None and not holds_time_alone(table.reader):
        return None
    return tuple(re.findall(r"\d+", name))
