"""What the names of columns state and what was guessed from them, as units and findings."""

from __future__ import annotations

import json
import re
from collections.abc import Sequence

from collaudit.core.config.schema import LogConfig
from collaudit.core.findings import Finding, fact
from collaudit.core.logs.signals.joint_naming import listed
from collaudit.core.logs.tables.column_patterns import unit_of
from collaudit.core.logs.tables.file_quantities import AssignedTable
from collaudit.core.logs.tables.time_columns import (
    LONGEST_STEP_S,
    SCALES,
    is_doubtful,
    named_unit,
    repeats_most,
    usual_step_s,
)
from collaudit.core.logs.tables.time_parts import time_parts
from collaudit.core.numeric.arrays import FloatArray

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


def unusable_time(
    file: AssignedTable, unit: str, time_s: FloatArray, start_ns: int | None, settings: LogConfig
) -> Finding | None:
    """That the unit of time cannot be: nothing is done with such a log; None where it can.

    Args:
        file: the table with the time column.
        unit: what it was taken as.
        time_s: (n,) its stamps in s by that unit, from the first.
        start_ns: absolute time of the first, ns, by that unit.
        settings: what is stated.
    """
    if file.assignment.time is None or unit in ("iso", "rows"):
        return None
    name, where = file.reader.names[file.assignment.time], file.reader.path.name
    known = settings.units.time != "auto" or named_unit(name) == unit
    step_s = usual_step_s(time_s)
    raw = step_s * SCALES[unit]
    steps = f"The steps of the time column {name!r} are {raw:.9g}"
    fitting = [json.dumps(one) for one, scale in SCALES.items() if raw / scale < LONGEST_STEP_S]
    other = f"[log.units] time = {' or '.join(fitting)}" if fitting else "[log.units] time"
    if known and step_s >= LONGEST_STEP_S:
        text = (
            f"{steps}, which are {step_s:.9g} s by its unit, {unit}: no motion of an arm can be judged by such steps. "
            f"State another unit, {other}, or the column that holds the time, [log.csv] time."
        )
    elif repeats_most(time_s):
        pair = _parts(file) or '["sec", "nanosec"]'
        text = (
            f"Most rows have the stamp of the row before in the time column {name!r}: if it holds whole seconds, and "
            f"another column the rest of each, name both: [log.csv] time = {pair}, or their numbers."
        )
    elif not known and (step_s >= LONGEST_STEP_S or (unit == "s" and is_doubtful(step_s, start_ns))):
        whole = (
            f" Whole seconds seem to stand in a column of their own: [log.csv] time = {parts}."
            if (parts := _parts(file))
            else ""
        )
        text = (
            f"{steps}, and its unit is stated nowhere: state it, {other}.{whole} "
            "If the column counts rows, state [log.csv] rate_hz instead."
        )
    else:
        return None
    return Finding("log-unit-suspect", "error", text, where=where)


def _parts(file: AssignedTable) -> str:
    """The columns that make the time together, as the configuration states them; empty where none do."""
    found = time_parts(file.reader, file.assignment.time)
    return json.dumps(found, ensure_ascii=False) if found else ""


def time_unit_findings(file: AssignedTable, unit: str, settings: LogConfig) -> list[Finding]:
    """That the unit of time was guessed, and by what."""
    if settings.units.time != "auto" or unit in ("iso", "rows") or file.assignment.time is None:
        return []
    name = file.reader.names[file.assignment.time]
    by = f"its name {name!r}" if named_unit(name) == unit else "the size of its numbers"
    text = f"The unit of the time column was taken as {unit}, by {by}."
    return [Finding("log-guessed", "info", text, where=file.reader.path.name)]


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
