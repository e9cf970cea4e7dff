"""What the names of columns state and what was guessed from them, as units and findings."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from collaudit.core.findings import Finding
from collaudit.core.logs.tables.column_assignment import CURRENT_WORDS
from collaudit.core.logs.tables.column_patterns import unit_of
from collaudit.core.logs.tables.file_quantities import AssignedTable

if TYPE_CHECKING:
    from collaudit.core.config.schema import LogConfig


def stated_units(files: Sequence[AssignedTable]) -> dict[str, str]:
    """Quantity to the unit that its column names state."""
    out: dict[str, str] = {}
    for file in files:
        for quantity, found in file.assignment.quantities.items():
            stated = {unit_of(file.reader.names[column]) for column in found.columns}
            if len(stated) == 1 and (unit := stated.pop()) is not None:
                out[quantity] = unit
            elif found.unit:
                out[quantity] = found.unit
            elif any(word in found.pattern.lower() for word in (*CURRENT_WORDS, "*curr*")) and quantity == "effort":
                out.setdefault(quantity, "current")
    return out


def time_findings(file: AssignedTable, unit: str, settings: LogConfig) -> list[Finding]:
    """That the unit of time was guessed."""
    if settings.units.time == "auto" and unit not in ("iso", "rows"):
        text = f"The unit of the time column was taken as {unit}, by the size of its numbers."
        return [Finding("log-units-guessed", "info", text, where=file.reader.path.name)]
    return []


def guess_findings(file: AssignedTable) -> list[Finding]:
    """Which columns were recognised by their names, or by the file's."""
    assignment = file.assignment
    recognised = []
    for quantity in assignment.guessed:
        if quantity == "time":
            recognised.append(f"time = {file.reader.names[assignment.time or 0]!r}")
        else:
            found = assignment.quantities[quantity]
            recognised.append(f"{quantity} = {found.pattern!r} ({len(found.columns)} columns)")
    if not any(quantity in assignment.quantities for quantity in assignment.guessed):
        return []
    text = f"Columns were recognised by their names, not by the configuration: {'; '.join(recognised)}."
    return [Finding("log-columns-guessed", "warning", text, where=file.reader.path.name)]
