"""Joint names that stand in columns of their own, as ``rostopic echo -p`` writes a message's ``name``."""

from __future__ import annotations

import re
from dataclasses import replace

from collaudit.core.errors import LogError
from collaudit.core.logs.signals.joint_naming import listed
from collaudit.core.logs.storage.table_reader import TableReader
from collaudit.core.logs.tables.column_assignment import Assignment
from collaudit.core.logs.tables.column_patterns import MOTION, Found, counts_message, is_numbered, match_pattern

_QUANTITY = re.compile(r"(position|velocity|effort)(?=[\[._]?\{i)", re.IGNORECASE)


def with_named_joints(reader: TableReader, assignment: Assignment) -> Assignment:
    """Numbered columns of a message under the names that the table holds beside them; else as they are.

    Raises:
        LogError: the names differ from row to row: several publishers take turns, and no column is one joint's.
    """
    quantities = dict(assignment.quantities)
    for quantity in MOTION:
        found = quantities.get(quantity)
        if found is not None and counts_message(found.pattern) and is_numbered(found):
            joints = _names_beside(reader, found)
            if joints is not None:
                quantities[quantity] = replace(found, joints=joints)
    return replace(assignment, quantities=quantities)


def _names_beside(reader: TableReader, found: Found) -> tuple[str, ...] | None:
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
