"""What is said of a table's columns: what each may be, their units, which were taken and which passed over.

By the configuration or a column's name where these say it, else by its numbers; six may be a wrist force sensor's.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from collaudit.core.config.schema import LogConfig
from collaudit.core.errors import LogError
from collaudit.core.findings import Finding, fact
from collaudit.core.logs.log_summary import ColumnInfo
from collaudit.core.logs.signals.joint_naming import listed
from collaudit.core.logs.signals.signal_names import MARK, bare, column_index, families, unit_of
from collaudit.core.logs.tables.column_assignment import AssignedTable
from collaudit.core.logs.tables.column_groups import groups_of, is_label, is_measured
from collaudit.core.logs.tables.csv_text import is_number
from collaudit.core.logs.tables.time_columns import UNIT_OF_WORD, guess_time_unit, named_unit
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.vendors.vendor_words import UNIT_WORDS

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
#: Columns of larger files are named only.
_MOST_BYTES = 512 << 20
#: Rows that derivatives are looked for in, and the span of one difference.
_ROWS, _SPAN = 20_000, 5
#: Columns of wider tables are not compared with each other: that takes the square of their number.
_MOST_RELATED = 1000
#: A column goes as the derivative of another from this correlation on.
_ALIKE = 0.97
#: A number that stands still for so many rows in the mean is a state.
_STATE_ROWS = 20
_UNITS = {**UNIT_OF_WORD, **UNIT_WORDS}
#: What a column may be: role, evidence, joint, unit.
_Guess = tuple[str, str, str, str]
_OF_WRENCH = dict.fromkeys(("f", "force", "forces", "kraft"), "force")
_OF_WRENCH |= dict.fromkeys(("m", "t", "torque", "torques", "moment", "moments", "tau"), "torque")
_WRENCH = tuple(f"{kind} {axis}" for kind in ("force", "torque") for axis in "xyz")
#: Words before six numbered columns that hold a wrench.
_NUMBERED = re.compile(r"(wrench|ft|fts|forcetorque|tcpforce|tcpwrench|ftsensor|ftraw|fext|fexthatk)$")
#: A wrench that was computed from joint torques or currents, so that it says nothing that they do not.
_ESTIMATED = re.compile(r"ext|est|hat|virtual|model|desired|target|cmd|command")


def standard_unit(quantity: str, named: str) -> str | None:
    """The unit of the configuration that a column name states; None for one that is not converted."""
    text = named.strip().lower()
    bare = _PER_SECOND.sub("", text) if quantity == "velocity" else text
    return next((unit for unit, spelt in UNITS.get(quantity, {}).items() if bare in spelt), None)


def stated_units(files: Sequence[AssignedTable]) -> dict[str, str]:
    """Quantity to the unit that its column names state."""
    out: dict[str, str] = {}
    for file in files:
        if file.time_name is not None and (unit := named_unit(file.time_name)) is not None:
            out.setdefault("time", unit)
        for quantity, found in file.quantities.items():
            stated = {unit_of(file.reader.names[column]) for column in found.columns}
            unit = (stated.pop() if len(stated) == 1 else None) or found.meaning.unit
            if unit:
                out[quantity] = unit
    return out


def guess_findings(file: AssignedTable) -> list[Finding]:
    """Which columns were recognised by their names, or by the file's, and which were passed over for them."""
    names, where = file.reader.names, file.file
    taken = {quantity: found for quantity, found in file.quantities.items() if quantity in file.guessed}
    if not taken:
        return []
    said = []
    for quantity, found in taken.items():
        pattern = found.pattern or ", ".join(names[k] for k in found.columns)
        said.append(f"{quantity} = {pattern!r} ({len(found.columns)} columns)")
    if "time" in file.guessed:
        said.append(f"time = {file.time_name!r}")
    text = f"Columns were recognised by their names, not by the configuration: {'; '.join(said)}."
    findings = [Finding("log-guessed", "warning", text, where=where)]
    if file.passed_over:
        passed = "; ".join(f"{quantity}: {', '.join(groups)}" for quantity, groups in file.passed_over.items())
        text = f"Columns that are not the measured quantity by their names were passed over: {passed}."
        findings.append(fact(text, where=where))
    return findings


def left_out_findings(left_out: Sequence[str], rows: int, where: str) -> list[Finding]:
    """Arrays of a file that are as long as signals and have another number of rows than the table."""
    if not left_out:
        return []
    text = f"Arrays that do not have the table's {rows} rows were left out: {listed(left_out)}."
    return [Finding("log-left-out", "warning", text, where=where)]


def describe_columns(files: Sequence[AssignedTable], settings: LogConfig) -> tuple[ColumnInfo, ...]:
    """Name, unit, range and likely role of every column of one log, file after file."""
    return tuple(info for file in files for info in _of_file(file, settings))


def _of_file(file: AssignedTable, settings: LogConfig) -> list[ColumnInfo]:
    values = _numbers(file)
    derived = _derivatives(values)
    known = _known(file, settings)
    out = []
    for index, name in enumerate(file.reader.names):
        column = values.get(index)
        finite = np.empty(0) if column is None else column[np.isfinite(column)]
        role, why, joint, unit = known.get(index) or _by_data(file, index, values, derived)
        if role == "time":
            unit = guess_time_unit(float(np.abs(finite).max())) + "?" if finite.size else "iso"
        out.append(
            ColumnInfo(
                name=name,
                unit=_stated_unit(name) or unit,
                min=float(finite.min()) if finite.size else None,
                max=float(finite.max()) if finite.size else None,
                changes=int(np.count_nonzero(np.diff(finite))) if column is not None else None,
                role=role,
                joint=joint,
                why=why,
                file=file.file,
            )
        )
    return out


def _known(file: AssignedTable, settings: LogConfig) -> dict[int, _Guess]:
    """What names or the configuration say of columns; what is taken or stated comes last and wins."""
    out: dict[int, _Guess] = {}
    names = file.reader.names
    labels = [index for index, name in enumerate(names) if file.reader.named and is_label(name)]
    out |= dict.fromkeys(labels, ("label?", "by its name; see [log] labels", "", ""))
    for group in groups_of(names):
        measured, quantity = is_measured(group.meaning), group.meaning.quantity
        text = "several groups may be the measured one" if measured else "not taken for a measurement"
        role = f"{quantity}?" if measured else f"{group.meaning.role} {quantity}"
        why = f"by its name, {group.pattern}: {text}"
        out |= {index: (role, why, f"joint{number}", "") for number, index in enumerate(group.columns, 1)}
    offered = find_wrench(names) if file.reader.named and settings.csv.wrench is None else None
    if offered is not None:
        role = "estimated wrench" if offered.estimated else "wrench?"
        out |= {names.index(name): (role, "by its name; see [log.csv] wrench", "", "") for name in offered.names}
    for quantity, found in file.quantities.items():
        by = "by its name" if quantity in file.guessed else "as stated"
        why = f"{by}, {found.pattern}" if found.pattern else by
        out |= {index: (quantity, why, joint, "") for joint, index in zip(found.joints, found.columns, strict=True)}
    by = "by its name" if "time" in file.guessed else "as stated"
    out |= dict.fromkeys(file.time[:1], ("time", by, "", ""))
    out |= dict.fromkeys(file.wrench, ("wrench", "as stated", "", ""))
    stated = [*((name, "label") for name in settings.labels), (settings.phase, "phase"), (settings.csv.run, "run")]
    places = ((column_index(names, key), role) for key, role in stated if key is not None)
    return out | {place: (role, "as stated", "", "") for place, role in places if place is not None}


def _numbers(file: AssignedTable) -> dict[int, FloatArray]:
    """Columns of numbers by their index; none where they cannot be read, or are too many."""
    reader = file.reader
    numeric = [k for k in range(len(reader.names)) if _all_numbers(reader.first_cells(k))]
    if not numeric or reader.path.stat().st_size > _MOST_BYTES:
        return {}
    try:
        return dict(zip(numeric, reader.read({"all": numeric}, None).values["all"].T, strict=True))
    except LogError:
        return {}


def _all_numbers(cells: Iterable[str]) -> bool:
    filled = [cell.replace(",", ".") for cell in cells if cell.strip()]
    return bool(filled) and all(map(is_number, filled))


def _by_data(file: AssignedTable, index: int, values: Mapping[int, FloatArray], derived: Mapping[int, int]) -> _Guess:
    """What a column that nobody named may be."""
    if index not in values:
        cells = [cell for cell in file.reader.first_cells(index) if cell]
        if {cell.lower() for cell in cells} <= {"true", "false"} and cells:
            return "label?", "true and false", "", ""
        return ("text", f"begins with {cells[0][:20]!r}", "", "") if cells else ("empty", "no values", "", "")
    finite = values[index][np.isfinite(values[index])]
    if not finite.size:
        return "empty", "no values", "", ""
    steps = np.diff(finite)
    middle = np.median(steps) if steps.size else 0.0
    few, again = (np.count_nonzero(which) * _STATE_ROWS <= finite.size for which in (steps, steps < 0))
    base = file.reader.names[derived.get(index, 0)]
    shapes = (
        ("constant", "the same in every row", not steps.any()),
        ("counter", "grows by 1 with each row", (steps == 1).all()),
        ("time?", f"grows with each row, by {middle:.4g} in the median", (steps > 0).all()),
        ("label?", "0 and 1 only", ((finite == 0) | (finite == 1)).all()),
        ("state or run?", "whole numbers that stand for many rows", few and (finite == np.round(finite)).all()),
        ("counter or time of runs?", "grows evenly and begins again",
         again and (steps[steps > 0] == steps.max(initial=0.0)).all()),
        ("velocity?", f"goes as the derivative of {base}", index in derived),
        ("position?", "another column goes as its derivative", index in derived.values()),
        ("signal", "", True),
    )  # fmt: skip
    role, why = next((role, why) for role, why, holds in shapes if holds)
    angle = "rad?" if float(np.abs(finite).max()) <= 2 * np.pi else "deg?"
    return role, why, "", angle if role == "position?" else ""


def _derivatives(values: Mapping[int, FloatArray]) -> dict[int, int]:
    """Column to the column whose derivative it goes as."""
    if not 1 < len(values) <= _MOST_RELATED:
        return {}
    rows = np.column_stack([column[:_ROWS] for column in values.values()])
    rows = rows[np.isfinite(rows).all(axis=1)]
    if rows.shape[0] < 10 * _SPAN:
        return {}
    count, places = len(values), list(values)
    with np.errstate(all="ignore"):  # of columns that stand still, or hold garbage
        summed = np.cumsum(rows, axis=0)
        pairs = np.corrcoef(rows[_SPAN:] - rows[:-_SPAN], summed[_SPAN:] - summed[:-_SPAN], rowvar=False)
    alike = np.nan_to_num(pairs[:count, count:])
    np.fill_diagonal(alike, 0.0)
    least = np.maximum(_ALIKE, alike.max(axis=1))
    best = alike.argmax(axis=0).tolist()
    return {places[k]: places[best[k]] for k in np.flatnonzero(alike.max(axis=0) > least).tolist()}


def _stated_unit(name: str) -> str:
    """The unit in a column's name: in brackets, or as a word of its own."""
    if (unit := unit_of(name)) is not None:
        return unit
    text = re.sub(r"(deg|rad)[^a-z]+(?:per[^a-z]+)?s(?:ec)?(?![a-z])", r"\1ps", bare(name).lower())
    words = re.split(r"[^a-zµ]+", text)
    return next((_UNITS[word] for word in reversed(words[1:]) if word in _UNITS), "")


@dataclass(frozen=True, slots=True)
class WrenchColumns:
    """Six columns: forces, then torques.

    Attributes:
        names: as the file has them.
        estimated: the names say that no sensor measured them.
    """

    names: tuple[str, ...]
    estimated: bool


def find_wrench(names: Sequence[str]) -> WrenchColumns | None:
    """The six columns whose names say force and torque along x, y and z; measured ones before estimated ones.

    They are offered, never taken.
    """
    found: dict[str, dict[str, str]] = {}
    for name in names:
        rest, place = _kind_and_axis(name)
        found.setdefault(rest, {}).setdefault(place, name)
    for family in families(names):
        front, _, behind = family.stem.partition(MARK)
        stem = re.sub(r"[^a-z]", "", front.lower())
        if _NUMBERED.search(stem) and not re.search(r"\d", behind) and family.counts and len(family.places) == 6:
            found[stem] = {place: names[index] for place, index in zip(_WRENCH, family.places, strict=True)}
    whole = [
        (rest, tuple(columns[place] for place in _WRENCH))
        for rest, columns in found.items()
        if {*_WRENCH} <= {*columns}
    ]
    wrenches = (WrenchColumns(six, bool(_ESTIMATED.search(rest))) for rest, six in whole)
    return min(wrenches, key=lambda each: each.estimated, default=None)


def _kind_and_axis(name: str) -> tuple[str, str]:
    """What remains of a name without its kind and axis, and these; empty where it has none."""
    text = re.sub(r"[\[(].*$", "", re.sub(r"(?<=[a-z])(?=[A-Z])", "_", name)).lower()
    text = re.sub(rf"(?<![a-z])({'|'.join(_OF_WRENCH)})([xyz])(?![a-z])", r"\1_\2", text)  # fx is the force along x
    words = re.findall(r"[a-z]+|\d+", text)
    axes = [place for place, word in enumerate(words) if word in ("x", "y", "z")]
    kinds = [place for place, word in enumerate(words) if word in _OF_WRENCH]
    if len(axes) != 1 or not kinds:
        return "", ""
    left = [word for place, word in enumerate(words) if place not in (axes[0], kinds[-1])]
    return "/".join(left), f"{_OF_WRENCH[words[kinds[-1]]]} {words[axes[0]]}"
