"""What the names of columns state and what was guessed from them, as units and findings."""

from __future__ import annotations

import re
from collections.abc import Sequence

from collaudit.core.findings import Finding, fact
from collaudit.core.logs.signals.joint_naming import listed
from collaudit.core.logs.tables.column_patterns import unit_of
from collaudit.core.logs.tables.file_quantities import AssignedTable
from collaudit.core.logs.tables.time_columns import named_unit

#: Quantity to the units that are converted, and how column names spell them.
UNITS = {
    "position": {"rad": ("rad", "radian", "radians", "m"), "deg": ("deg", "degree", "degrees", "°", "grad")},
    "velocity": {"rad/s": ("rad", "radian", "radians", "m"), "deg/s": ("deg", "degree", "degrees", "°", "grad")},
    "effort": {
        "Nm": ("nm", "n·m", "n*m", "n m", "n-m", "n.m", "n"),
        "A": ("a", "ampere", "amperes", "amps", "amp", "current"),
        "mA": ("ma", "milliampere", "milliamperes", "milliamps"),
        "percent": ("%", "percent", "pct"),
        "permille": ("‰", "permille", "per mille"),
    },
}
_PER_SECOND = re.compile(r"\s*([/·* .]?\s*(s|sec|second)(\^?-1|⁻¹)?|ps)$")


def standard_unit(quantity: str, named: str) -> str | None:
    """The unit of the configuration that a column name states; None for one that is not converted."""
    text = named.strip().lower()
    bare = _PER_SECOND.sub("", text) if quantity == "velocity" else text
    return next((unit for unit, spelt in UNITS.get(quantity, {}).items() if bare in spelt), None)


def stated_units(files: Sequence[AssignedTable]) -> dict[str, str]:
    """Quantity to the unit that its column names state."""
    out: dict[str, str] = {}
    for file in files:
        if (
            file.assignment.time is not None
            and (unit := named_unit(file.reader.names[file.assignment.time])) is not None
        ):
            out.setdefault("time", unit)
        for quantity, found in file.assignment.quantities.items():
            stated = {unit_of(file.reader.names[column]) for column in found.columns}
            unit = (stated.pop() if len(stated) == 1 else None) or found.meaning.unit
            if unit:
                out[quantity] = unit
    return out


def guess_findings(file: AssignedTable) -> list[Finding]:
    """Which columns were recognised by their names, or by the file's, and which were passed over for them."""
    assignment, names, where = file.assignment, file.reader.names, file.reader.path.name
    taken = {quantity: found for quantity, found in assignment.quantities.items() if quantity in assignment.guessed}
    if not taken:
        return []
    said = []
    for quantity, found in taken.items():
        pattern = found.pattern or ", ".join(names[k] for k in found.columns)
        said.append(f"{quantity} = {pattern!r} ({len(found.columns)} columns)")
    if "time" in assignment.guessed:
        said.append(f"time = {names[assignment.time or 0]!r}")
    text = f"Columns were recognised by their names, not by the configuration: {'; '.join(said)}."
    findings = [Finding("log-guessed", "warning", text, where=where)]
    if assignment.passed_over:
        passed = "; ".join(f"{quantity}: {', '.join(groups)}" for quantity, groups in assignment.passed_over.items())
        text = f"Columns that are not the measured quantity by their names were passed over: {passed}."
        findings.append(fact(text, where=where))
    return findings


def left_out_findings(left_out: Sequence[str], rows: int, where: str) -> list[Finding]:
    """Arrays of a file that are as long as signals and have another number of rows than the table."""
    if not left_out:
        return []
    text = f"Arrays that do not have the table's {rows} rows were left out: {listed(left_out)}."
    return [Finding("log-left-out", "warning", text, where=where)]
