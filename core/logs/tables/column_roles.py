"""What each column of a table may be: by the configuration or its name where these say it, else by its numbers."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from collaudit.core.config.schema import CsvConfig
from collaudit.core.errors import LogError
from collaudit.core.logs.csv.csv_text import is_number
from collaudit.core.logs.log_summary import ColumnInfo
from collaudit.core.logs.tables.column_groups import is_measured, numbered_groups
from collaudit.core.logs.tables.column_patterns import QUANTITIES as _QUANTITIES
from collaudit.core.logs.tables.column_patterns import bare, column_index, unit_of
from collaudit.core.logs.tables.column_vocabulary import is_label
from collaudit.core.logs.tables.file_quantities import AssignedTable
from collaudit.core.logs.tables.table_stamps import guess_time_unit
from collaudit.core.logs.tables.wrench_columns import find_wrench
from collaudit.core.numeric.arrays import FloatArray

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
_UNITS = {"deg": "deg", "rad": "rad", "degps": "deg/s", "radps": "rad/s", "rads": "rad/s", "nm": "N·m", "a": "A",
          "ma": "mA", "s": "s", "ms": "ms", "us": "us", "ns": "ns", "sec": "s", "nsec": "ns"}  # fmt: skip


@dataclass(frozen=True, slots=True)
class _Guess:
    role: str
    why: str
    unit: str = ""


def describe_columns(files: Sequence[AssignedTable], settings: CsvConfig) -> tuple[ColumnInfo, ...]:
    """Name, unit, range and likely role of every column of one log, file after file."""
    return tuple(info for file in files for info in _of_file(file, settings))


def _of_file(file: AssignedTable, settings: CsvConfig) -> list[ColumnInfo]:
    numeric, values = _numbers(file)
    place = {index: k for k, index in enumerate(numeric)}
    derived = _derivatives(values) if values is not None else {}
    bases = frozenset(derived.values())
    follows = {place_of: file.reader.names[numeric[base]] for place_of, base in derived.items()}
    known = _known(file, settings)
    out = []
    for index, name in enumerate(file.reader.names):
        column = values[:, place[index]] if values is not None and index in place else None
        finite = column[np.isfinite(column)] if column is not None else np.empty(0)
        guess, joint = known.get(index, (None, ""))
        if guess is None:
            guess = _by_data(file, index, column, finite, follows.get(place.get(index, -1)))
            if guess.role == "signal" and place.get(index) in bases:
                guess = _Guess("position?", "another column goes as its derivative", _angle(finite))
        out.append(
            ColumnInfo(
                name=name,
                unit=_stated_unit(name) or guess.unit or (_time_unit(finite) if guess.role == "time" else ""),
                min=float(finite.min()) if finite.size else None,
                max=float(finite.max()) if finite.size else None,
                changes=int(np.count_nonzero(np.diff(finite))) if column is not None else None,
                role=guess.role,
                joint=joint,
                why=guess.why,
                file=file.reader.path.name,
            )
        )
    return out


def _known(file: AssignedTable, settings: CsvConfig) -> dict[int, tuple[_Guess, str]]:
    """What the configuration or names say: index to role and joint."""
    out: dict[int, tuple[_Guess, str]] = {}
    assignment = file.assignment
    taken = [(quantity, found.pattern, *each) for quantity, found in assignment.quantities.items()
             for each in zip(found.joints, found.columns, strict=True)]  # fmt: skip
    taken += [("time", "", "", assignment.time)] if assignment.time is not None else []
    for quantity, pattern, joint, index in taken:
        by = "by its name" if quantity in assignment.guessed else "as stated"
        out[index] = (_Guess(quantity, f"{by}, {pattern}" if pattern else by), joint)
    out |= {index: (_Guess("wrench", "as stated"), "") for index in assignment.wrench}
    for group in numbered_groups(file.reader.names):
        meaning = group.meaning
        measured = is_measured(meaning)
        text = "several groups may be the measured one" if measured else "not taken for a measurement"
        role = f"{meaning.quantity}?" if measured else f"{meaning.role} {meaning.quantity}"
        for number, index in enumerate(group.columns, 1):
            out.setdefault(index, (_Guess(role, f"by its name, {group.pattern}: {text}"), f"joint{number}"))
    for index, name in enumerate(file.reader.names):
        if file.reader.named and is_label(name):
            out.setdefault(index, (_Guess("label?", "by its name; see [log.csv] labels"), ""))
    offered = find_wrench(file.reader.names) if file.reader.named and settings.wrench is None else None
    if offered is not None:
        said = "estimated wrench" if offered.estimated else "wrench?"
        for name in offered.names:
            index = file.reader.names.index(name)
            if out.get(index, (_Guess("", ""), ""))[0].role not in _QUANTITIES:
                out[index] = (_Guess(said, "by its name; see [log.csv] wrench"), "")
    stated = [(name, "label") for name in settings.labels] + [(settings.phase, "phase"), (settings.run, "run")]
    for key, role in stated:
        place = column_index(file.reader.names, key) if key is not None else None
        if place is not None:
            out[place] = (_Guess(role, "as stated"), "")
    return out


def _numbers(file: AssignedTable) -> tuple[list[int], FloatArray | None]:
    """Columns that hold numbers, and the numbers; None where they cannot be read, or are too many."""
    reader = file.reader
    numeric = [k for k in range(len(reader.names)) if _all_numbers(reader.first_cells(k))]
    if not numeric or reader.path.stat().st_size > _MOST_BYTES:
        return numeric, None
    try:
        return numeric, reader.read({"all": numeric}, None).values["all"]
    except LogError:
        return numeric, None


def _all_numbers(cells: Iterable[str]) -> bool:
    filled = [cell.replace(",", ".") for cell in cells if cell.strip()]
    return bool(filled) and all(map(is_number, filled))


def _by_data(
    file: AssignedTable, index: int, column: FloatArray | None, finite: FloatArray, follows: str | None
) -> _Guess:
    """What a column that nobody named may be."""
    if column is None:
        cells = [cell for cell in file.reader.first_cells(index) if cell]
        if {cell.lower() for cell in cells} <= {"true", "false"} and cells:
            return _Guess("label?", "true and false")
        return _Guess("text", f"begins with {cells[0][:20]!r}") if cells else _Guess("empty", "no values")
    if not finite.size:
        return _Guess("empty", "no values")
    steps = np.diff(finite)
    middle = np.median(steps) if steps.size else 0.0
    few, again = (np.count_nonzero(which) * _STATE_ROWS <= finite.size for which in (steps, steps < 0))
    shapes = (
        ("constant", "the same in every row", not steps.any()),
        ("counter", "grows by 1 with each row", (steps == 1).all()),
        ("time?", f"grows with each row, by {middle:.4g} in the median", (steps > 0).all()),
        ("label?", "0 and 1 only", ((finite == 0) | (finite == 1)).all()),
        ("state or run?", "whole numbers that stand for many rows", few and (finite == np.round(finite)).all()),
        ("counter or time of runs?", "grows evenly and begins again",
         again and (steps[steps > 0] == steps.max(initial=0.0)).all()),
        ("velocity?", f"goes as the derivative of {follows}", follows is not None),
    )  # fmt: skip
    return next((_Guess(role, why) for role, why, holds in shapes if holds), _Guess("signal", ""))


def _derivatives(values: FloatArray) -> dict[int, int]:
    """Column to the column whose derivative it goes as."""
    rows = values[:_ROWS]
    rows = rows[np.isfinite(rows).all(axis=1)]
    if rows.shape[0] < 10 * _SPAN or rows.shape[1] > _MOST_RELATED:
        return {}
    change = rows[_SPAN:] - rows[:-_SPAN]
    summed = np.cumsum(rows, axis=0)
    mean = (summed[_SPAN:] - summed[:-_SPAN]) / _SPAN
    alike = _unit(change).T @ _unit(mean)
    np.fill_diagonal(alike, 0.0)
    best, most = np.argmax(alike, axis=0), alike.max(axis=0)
    as_base = [float(most[best == k].max(initial=0.0)) for k in range(most.shape[0])]
    return {k: int(best[k]) for k in range(most.shape[0]) if most[k] > max(_ALIKE, as_base[k])}


def _unit(values: FloatArray) -> FloatArray:
    """Columns without their mean, of length 1; zero where they do not change."""
    values = values / np.maximum(np.abs(values).max(axis=0), 1e-300)  # the square of a garbage value is no number
    centred = values - values.mean(axis=0)
    length = np.sqrt((centred**2).sum(axis=0))
    out: FloatArray = centred / np.where(length > 1e-12, length, np.inf)
    return out


def _angle(finite: FloatArray) -> str:
    return "rad?" if finite.size and float(np.abs(finite).max()) <= 2 * np.pi else "deg?"


def _time_unit(finite: FloatArray) -> str:
    return guess_time_unit(float(np.abs(finite).max())) + "?" if finite.size else "iso"


def _stated_unit(name: str) -> str:
    """The unit in a column's name: in brackets, or as a word of its own."""
    if (unit := unit_of(name)) is not None:
        return unit
    text = re.sub(r"(deg|rad)[^a-z]+(?:per[^a-z]+)?s(?:ec)?(?![a-z])", r"\1ps", bare(name).lower())
    words = re.split(r"[^a-zµ]+", text)
    return next((_UNITS[word] for word in reversed(words[1:]) if word in _UNITS), "")
