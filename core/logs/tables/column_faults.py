"""Refusals of a table's columns: no measured ones of a quantity, several, or those of different joints; what to add."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any

from collaudit.core.config.config_table import ColumnPattern
from collaudit.core.config.schema import LogConfig
from collaudit.core.errors import LogError
from collaudit.core.logs.signals.joint_naming import listed
from collaudit.core.logs.signals.signal_names import (
    MARK,
    MOTION,
    NO_CONTACT,
    QUANTITIES,
    Found,
    families,
    is_usable,
    refusal_hint,
    stated_line,
    without_unit,
)
from collaudit.core.logs.storage.file_content import python_line
from collaudit.core.logs.storage.readers import TableReader
from collaudit.core.logs.tables.column_assignment import AssignedTable
from collaudit.core.logs.tables.column_groups import groups_of, is_measured, meaning_of, word_dropped
from collaudit.core.logs.tables.csv_text import is_number
from collaudit.core.logs.tables.file_quantities import parts_of
from collaudit.core.logs.tables.time_columns import guess_time

_FEWEST = 2


def check_columns(files: Sequence[AssignedTable]) -> None:
    """Refuse tables whose column names do not decide what is measured, or whose quantities do not fit together.

    Raises:
        LogError: naming the lines of [log.csv] that decide.
    """
    for file in files:
        for quantity, patterns in file.open.items():
            message = f"several groups of columns could be the measured {quantity}"
            line = _line(files, quantity, patterns[0])
            hint = f"say which: {line}"
            if len(patterns) == 1:
                message = f"the only columns of joint {quantity}s are the motors' by their names"
                hint = (
                    f"say which side of the gear they are of: {line} where they are already angles of the joints; the "
                    "same and [robot] reduction = [100.0, …] where they are the motors' own, with your number of motor "
                    "turns per turn of each joint"
                )
            passed = [group for groups in file.passed_over.values() for group in groups]
            found = listed(patterns) + (f"; passed over: {', '.join(passed)}" if passed else "")
            raise LogError(message, where=str(file.reader.path), found=found, hint=hint)
    positions = [found for _, found in parts_of(files, "position")]
    joints = {joint for found in positions for joint in found.joints}
    for quantity in ("velocity", "effort"):
        parts = [found for _, found in parts_of(files, quantity)]
        own = {joint for found in parts for joint in found.joints}
        numbered = any("{i" in found.pattern for found in (*positions, *parts))
        if not positions or not own or own == joints or (own & joints and not numbered):
            continue
        where = " + ".join(str(file.reader.path) for file in files)
        raise LogError(
            f"the columns of position and of {quantity} are of different joints",
            where=where,
            found=f"position: {_said(positions)}; {quantity}: {_said(parts)}",
            expected="as many columns of each as the log has joints",
            hint=f'name the columns joint by joint: [log.csv] position = ["…", "…"], {quantity} = ["…", "…"]',
        )


def check_measured(files: Sequence[AssignedTable], settings: LogConfig) -> None:
    """Refuse stated efforts that are desired, commanded or a model's by their names, unless their kind is stated.

    Raises:
        LogError: naming the key that says so.
    """
    for file, found in parts_of(files, "effort"):
        role = found.meaning.role
        if settings.effort_kind != "auto" or is_usable(role):
            continue
        names = found.pattern or listed([file.reader.names[column] for column in found.columns])
        raise LogError(
            f"no efforts are measured by their names: these are {role}",
            where=str(file.reader.path),
            found=names,
            expected=NO_CONTACT,
            hint=refusal_hint(_line(files, "effort", found.pattern or [file.reader.names[k] for k in found.columns])),
        )


def _said(parts: Sequence[Found]) -> str:
    return ", ".join(f"{found.pattern or 'named columns'} ({len(found.columns)} columns)" for found in parts)


def _line(files: Sequence[AssignedTable], quantity: str, pattern: ColumnPattern) -> str:
    """The lines of [log.csv]: one that is stated switches the guessing off, so all are."""
    known = {
        name: parts[0][1].pattern for name in QUANTITIES if (parts := parts_of(files, name)) and parts[0][1].pattern
    }
    return stated_line({**known, quantity: pattern})


def refuse_by_names(files: Sequence[AssignedTable], quantity: str) -> None:
    """Say why a quantity has no columns, where their names show it.

    Args:
        files: the tables.
        quantity: position or effort.

    Raises:
        LogError: with the cause and the line to add.
    """
    known = {key: found.pattern for file in files for key, found in file.quantities.items()}
    for file in (file for file in files if file.reader.named):
        taken = {index for found in file.quantities.values() for index in found.columns}
        taken.update(file.time)
        free = ["" if index in taken else name for index, name in enumerate(file.reader.names)]
        fault = _broken_numbers(free, quantity, known) or _several_arms(free, quantity)
        fault = fault or _not_measured(free, quantity, known)
        if fault is not None:
            fault.where = str(file.reader.path)
            raise fault


def _broken_numbers(names: Sequence[str], quantity: str, known: Mapping[str, str]) -> LogError | None:
    """Numbered columns with a number twice, with one missing, or that begin with another than 0 or 1."""
    known_words = ((meaning_of(family.stem), family) for family in families([without_unit(name) for name in names]))
    measured = [(meaning.quantity, family) for meaning, family in known_words
                if meaning is not None and is_usable(meaning.role) and len(family.places) >= _FEWEST]  # fmt: skip
    broken = next((family for of, family in measured if of == quantity and not family.counts), None)
    if broken is None:
        return None
    first = dict(reversed(measured))
    numbers = broken.numbers
    found = listed([names[place] for place in broken.places], 40)
    twice = next((number for number in numbers if numbers.count(number) > 1), None)
    if twice is not None:
        columns = {of: [place + 1 for place in family.places] for of, family in first.items()}
        name = broken.stem.replace(MARK, str(twice))
        return LogError(
            f"two columns are called {name}, so that the columns of the {quantity} cannot be told apart",
            found=found,
            hint="give them different names in the table; or name the columns by their numbers in the file, from 1: "
            + stated_line({**columns, **known}),
        )
    lacking = [number for number in range(min(numbers[0], 1), numbers[-1] + 1) if number not in numbers]
    gone = listed([broken.stem.replace(MARK, str(number)) for number in lacking])
    named = {of: [names[place] for place in family.places] for of, family in first.items()}
    return LogError(
        f"the {quantity} columns are numbered and {gone} {'is' if len(lacking) == 1 else 'are'} missing",
        found=found,
        expected="numbers that follow each other, from 0 or 1",
        hint="add the missing column; or if these are all joints, name as many of each quantity: "
        f"{stated_line({**named, **known})}, and which of the robot's joints they are by [log] joint_names",
    )


def sides_of(names: Sequence[str], quantity: str = "position") -> dict[str, dict[str, str]]:
    """Numbered columns with a word more than the quantity's, such as an arm's side: word to quantity to pattern."""
    sides: dict[str, dict[str, str]] = {}
    for family in sorted(families([without_unit(name) for name in names]), key=lambda family: family.stem):
        for word, meaning in word_dropped(family.stem):
            sides.setdefault(word, {}).setdefault(meaning.quantity, family.pattern)
    return {word: patterns for word, patterns in sides.items() if quantity in patterns}


def _several_arms(names: Sequence[str], quantity: str) -> LogError | None:
    sides = sides_of(names, quantity)
    if not sides:
        return None
    several = f"the {quantity} columns are of several arms or sides: {', '.join(sides)}"
    one = f"the {quantity} columns have a word in their names that is not known: {next(iter(sides))}"
    return LogError(
        several if len(sides) > 1 else one,
        found=", ".join(patterns[quantity] for patterns in sides.values()),
        hint=("one configuration an arm, " if len(sides) > 1 else "if they are measured, say so, ")
        + ", or ".join(map(stated_line, sides.values())),
    )


def _not_measured(names: Sequence[str], quantity: str, known: Mapping[str, str]) -> LogError | None:
    """Columns of the quantity, all of them desired, commanded, modelled or in a unit that is not converted."""
    groups = [group for group in groups_of(names) if not is_measured(group.meaning)]
    own = [group.said for group in groups if group.meaning.quantity == quantity]
    if not own:
        return None
    columns = {group.meaning.quantity: group.pattern for group in reversed(groups)} | dict(known)
    line = stated_line(columns)
    kinds = {group.meaning.role for group in groups if group.pattern == columns.get("effort")}
    asked = any(not is_usable(role) for role in kinds)
    otherwise = "record what was measured; or, if these are measured although their names say otherwise: "
    return LogError(
        f"no column of a measured {quantity} was recognised",
        found=", ".join(own),
        expected=f"one column of measured {quantity} per joint",
        hint=refusal_hint(line) if asked else otherwise + line,
    )


#: Columns before the joints' names of a JointState in a line: seconds, nanoseconds, frame.
_HEADER = 3
_MOST_NS = 1_000_000_000


def echoed_keys(reader: TableReader) -> dict[str, object]:
    """The keys that read a JointState as ``ros2 topic echo --csv`` writes it; none for another table.

    A line holds the stamp's seconds and nanoseconds, the frame, then the names, positions, velocities and efforts of
    all joints (ros2topic, ``ros2 topic echo --csv``).
    """
    first = [(reader.first_cells(k) or ("",))[0] for k in range(len(reader.names))]
    stamp = len(first) > _HEADER and first[0].isdigit() and first[1].isdigit() and int(first[1]) < _MOST_NS
    names = 0
    while stamp and _HEADER + names < len(first) and not is_number(first[_HEADER + names]):
        names += 1
    values = first[_HEADER + names :]
    if not names or len(values) != len(MOTION) * names or not all(map(is_number, values)):
        return {}
    begin = _HEADER + names + 1
    columns = {f"log.csv.{q}": list(range(begin + k * names, begin + (k + 1) * names)) for k, q in enumerate(MOTION)}
    joints = {f"joint{k + 1}": first[_HEADER + k] for k in range(names)}
    return {"log.joint_names": joints, "log.csv.time": [1, 2], **columns}


def echoed_lines(keys: Mapping[str, Any]) -> str:
    """Such keys as lines."""
    joints = ", ".join(f"{joint} = {json.dumps(name)}" for joint, name in keys["log.joint_names"].items())
    columns = "; ".join(f"{key.rpartition('.')[2]} = {keys[key]}" for key in keys if key != "log.joint_names")
    return f"[log] joint_names = {{ {joints} }}; [log.csv] {columns}"


def widening_command(reader: TableReader) -> str | None:
    """The command that makes rows of samples of a table with one row a joint and stamp; None for another table."""
    time = guess_time(reader.names) if reader.named else None
    quantities = [name for name in reader.names if (held := meaning_of(name)) is not None and held.quantity in MOTION]
    joint = next((name for k, name in enumerate(reader.names) if _takes_turns(reader.first_cells(k))), None)
    if time is None or joint is None or not any("pos" in name.lower() or name == "q" for name in quantities):
        return None
    wide = f"{reader.path.stem}.wide.csv"
    separator = reader.stated.get("delimiter", ",")
    chosen = {"index": reader.names[time], "columns": joint, "values": quantities}
    pivot = ", ".join(f"{key}={json.dumps(value)}" for key, value in chosen.items())
    code = (
        f"import pandas as pd; long = pd.read_csv({json.dumps(reader.path.name)}, sep={json.dumps(separator)}); "
        f'wide = long.pivot({pivot}); wide.columns = ["_".join(name) for name in wide.columns]; '
        f"wide.to_csv({json.dumps(wide)})"
    )
    return python_line(code)


def _takes_turns(cells: tuple[str, ...]) -> bool:
    """Whether texts come again in the same order."""
    period = len(set(cells))
    return 1 < period <= len(cells) // 2 and not any(map(is_number, cells)) and cells[:-period] == cells[period:]
