"""Tables to one table of joint signals: several with the same time column are one log."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pyarrow as pa

from collaudit.core.config.schema import CsvConfig, LogConfig
from collaudit.core.errors import LogError
from collaudit.core.findings import Finding, fact
from collaudit.core.logs.signals.annotation_spans import mode_columns
from collaudit.core.logs.signals.joint_naming import listed
from collaudit.core.logs.signals.sample_clock import garbage_findings
from collaudit.core.logs.signals.signal_names import MOTION, QUANTITIES, counts_message
from collaudit.core.logs.storage.readers import Damage, TableColumns, TableReader, damage_findings
from collaudit.core.logs.tables.column_assignment import AssignedTable
from collaudit.core.logs.tables.column_faults import (
    check_columns,
    check_measured,
    echoed_keys,
    echoed_lines,
    refuse_by_names,
    widening_command,
)
from collaudit.core.logs.tables.column_roles import (
    guess_findings,
    left_out_findings,
    stated_units,
)
from collaudit.core.logs.tables.file_quantities import assign_columns, parts_of
from collaudit.core.logs.tables.table_time import RUN, run_column, split_runs, told_unit
from collaudit.core.logs.tables.time_columns import (
    FRACTION,
    dated_stamps,
    guess_time,
    joined_stamps,
    named_unit,
    seconds_of,
    time_parts,
    unwrapped,
)
from collaudit.core.numeric.arrays import FloatArray

#: Two files share their time column when their stamps agree within this.
SAME_TIME_S = 1e-6
#: The line to add for a table without a time column.
NO_TIME_HINT = (
    "state the rows per second, with your own number: [log.csv] rate_hz = 1000.0; "
    'or name the time column: [log.csv] time = "…"'
)


@dataclass(slots=True, eq=False)
class JointTable:
    """The joint signals of one log.

    Attributes:
        names: joint names, as the columns name them; ``joint1`` … where they are numbered.
        numbered: True when the names come from numbers only.
        message_order: True when the numbers count the joints of a ROS message, whose order is the publisher's.
        units: quantity to the unit its column names state, where they do.
        time_s: (n,) seconds from the first row; runs one after the other follow after breaks.
        start_ns: absolute time of the first row, or None.
        columns: quantity to (n, j).
        wrench: (n, 6) or None.
        findings: what was guessed.
        texts: column name to the text of each row, of the columns of annotations and of the phase.
        obstacle: why nothing can be done by its stamps, one of the findings; None where something can.
        time_unit: of its stamps, by the motion, where the obstacle is that nothing states it.
    """

    names: tuple[str, ...]
    numbered: bool
    message_order: bool
    units: dict[str, str]
    time_s: FloatArray = field(default_factory=lambda: np.empty(0))
    start_ns: int | None = None
    columns: dict[str, FloatArray] = field(default_factory=dict)
    wrench: FloatArray | None = None
    findings: list[Finding] = field(default_factory=list)
    texts: dict[str, tuple[str, ...]] = field(default_factory=dict)
    obstacle: Finding | None = None
    time_unit: str | None = None


def join_tables(readers: Sequence[TableReader], settings: LogConfig, robot: Sequence[str] = ()) -> JointTable:
    """Read one log from one or several tables.

    Args:
        readers: the tables, those of :func:`~collaudit.core.logs.log_formats.also_files` among them.
        settings: patterns and units.
        robot: the robot's joints, as of :func:`collaudit.core.logs.tables.column_assignment.assign`.

    Raises:
        LogError: no time or position column, tables whose time columns differ, or a cell that is no number.
    """
    files = sorted(assign_columns(readers, settings.csv, robot), key=lambda file: not file.time)
    check_columns(files)
    check_measured(files, settings)
    _check_signals(files, settings.csv)
    motion = [f for file in files for quantity, f in file.quantities.items() if quantity in MOTION]
    table = JointTable(
        _joints_of(files),
        numbered=all(("{i" in found.pattern or not found.pattern) and found.is_numbered for found in motion),
        message_order=any(counts_message(found.pattern) for found in motion),
        units=stated_units(files),
    )
    runs: FloatArray | None = None
    for file in files:
        where = file.file
        own_time, start, unit, read, wrapped = _read_one(file, settings)
        runs = read.values.pop(RUN, runs)
        table.texts |= {file.reader.names[index]: words for index, words in read.texts.items()}
        if file.reader.damage is not None:
            table.findings += damage_findings([Damage(file.reader.damage)], where)
        if file is files[0]:
            table.time_s, table.start_ns = own_time, start
            table.findings += garbage_findings(np.isinf(own_time), "row", where)
            table.time_unit, said = told_unit(file, unit, own_time, start, read.values, settings)
            table.findings += [said] if said is not None else []
            table.obstacle = said if said is not None and said.severity == "error" else None
        else:
            _check_same_time(files[0].reader.path, table.time_s, file, own_time)
        table.wrench = read.values.pop("wrench", table.wrench)
        for quantity, block in read.values.items():
            joints = file.quantities[quantity].joints
            whole = joints == table.names
            before = table.columns.get(quantity)
            table.columns[quantity] = block if whole else _placed(block, joints, table.names, before)
        table.findings += [fact(wrapped, where=where)] if wrapped else []
        table.findings += [fact(f"Left out: {note}.", where=where) for note in file.reader.notes]
        table.findings += left_out_findings(file.reader.left_out, own_time.shape[0], where)
        table.findings += guess_findings(file)
    table.findings += _rows_matched(files) if settings.csv.row_period_s is None else []
    if table.obstacle is None:
        table.time_s, said_of_runs = split_runs(table.time_s, runs, settings.csv, files[0])
        table.findings += said_of_runs
    return table


def _check_signals(files: Sequence[AssignedTable], settings: CsvConfig) -> None:
    where = " + ".join(str(file.reader.path) for file in files)
    columns = [name for file in files for name in file.reader.names if name]
    held = {quantity for file in files for quantity in file.quantities}
    guessed = all(getattr(settings, quantity) is None for quantity in QUANTITIES)
    for quantity in ("position", "effort"):
        if quantity not in held and guessed:
            refuse_by_names(files, quantity)
    if "position" not in held:
        raise _without_positions(files, where, columns, held)
    timeless = [file for file in files if not file.time]
    if len(timeless) == len(files) and settings.row_period_s is None and settings.time is not None:
        own = timeless[0].reader.names
        named = guess_time(own)
        raise LogError(
            "[log.csv] time names a column that the log does not have",
            where=str(timeless[0].reader.path),
            found=f"{settings.time}, and columns {listed(own, 40)}",
            hint=f"[log.csv] time = {json.dumps(own[named], ensure_ascii=False)}"
            if named is not None
            else "correct the name; without such a column, take the line out and state [log.csv] rate_hz",
        )
    if len(timeless) == len(files) and settings.row_period_s is None:
        raise LogError(
            "no time column was recognised",
            where=str(timeless[0].reader.path),
            found=f"columns {listed(timeless[0].reader.names, 40)}",
            hint=f"name those that make it together: [log.csv] time = {json.dumps(parts, ensure_ascii=False)}"
            if (parts := time_parts(timeless[0].reader))
            else NO_TIME_HINT,
        )


def _without_positions(files: Sequence[AssignedTable], where: str, columns: Sequence[str], held: set[str]) -> LogError:
    """That a log has no positions by its columns, and what reads it all the same where that is seen."""
    by_number = "name them by their numbers from 1: [log.csv] time = 1, position = [2, 3], effort = [4, 5]; "
    echoed = {} if files[0].reader.named else echoed_keys(files[0].reader)
    wide = widening_command(files[0].reader)
    hint = (
        f"it is a JointState as ros2 topic echo --csv writes it: {echoed_lines(echoed)}"
        if echoed
        else f"it has one row a joint and stamp; this makes one row of each stamp: {wide}"
        if wide
        else by_number + "collaudit inspect LOG shows what each column may be"
        if not files[0].reader.named
        else 'name them in the configuration: [log.csv] time = "…", position = "q{i}", effort = "tau{i}", or by their '
        "numbers from 1, position = [2, 3]; collaudit inspect LOG lists every column with its likely role"
    )
    kinds = f" (taken as {' and '.join(sorted(held))})" if held else ""
    short = [array for file in files for array in file.reader.left_out]
    kinds += f"; arrays of another length {listed(short)}" if short else ""
    return LogError(
        "no columns of joint positions were recognised",
        where=where,
        found=f"columns {listed(columns, 40)}{kinds}",
        expected="a time column and one position column per joint",
        hint=hint,
        keys=echoed,
    )


def _rows_matched(files: Sequence[AssignedTable]) -> list[Finding]:
    """That files without a time column took that of another one."""
    timeless = [file.file for file in files if not file.time]
    if not timeless:
        return []
    timed = next(file.file for file in files if file.time)
    text = f"{listed(timeless)} hold no time: their rows, which are as many, were taken to be those of {timed}."
    return [Finding("log-guessed", "warning", text, where=timed)]


def _read_one(file: AssignedTable, settings: LogConfig) -> tuple[FloatArray, int | None, str, TableColumns, str | None]:
    """Time in s, absolute start, the unit of time, the columns by quantity (or ``wrench``, or ``run``), and a fact.

    The time is NaN where the file has none.

    Raises:
        LogError: there are no rows, or the columns that are stated make no time together.
    """
    period_s = settings.csv.row_period_s
    time = file.time if period_s is None else ()
    dated = len(time) > 1 and not file.reader.first_cells(time[0])[0].isdigit()
    groups = {quantity: found.columns for quantity, found in file.quantities.items()}
    groups |= {"wrench": file.wrench} if file.wrench else {}
    groups |= {FRACTION: time[1:]} if len(time) > 1 and not dated else {}
    run = run_column(file, settings.csv)
    groups |= {RUN: (run,)} if run is not None else {}
    asked = {*settings.labels, settings.phase, *mode_columns(file.reader.names)}
    texts = [index for index, name in enumerate(file.reader.names) if name in asked]
    apart = set(time if dated else ()) - set(texts)
    columns = file.reader.read(groups, time[0] if time and not dated else None, [*texts, *apart])
    rows = len(next(iter(columns.values.values()))) if columns.stamps is None else len(columns.stamps)
    if rows == 0:
        raise LogError("the file holds no rows of data", where=str(file.reader.path))
    if period_s is not None:
        return np.arange(rows, dtype=np.float64) * np.float64(period_s), None, "rows", columns, None
    where = f"{file.reader.path}, [log.csv] time"
    if dated:
        stamps = dated_stamps([columns.texts[index] for index in time], where)
        for index in apart:
            del columns.texts[index]
        return *seconds_of(stamps, "auto"), columns, None
    if columns.stamps is None:
        return np.full(rows, np.nan), None, "rows", columns, None
    if len(time) > 1:
        names = [file.reader.names[index] for index in time]
        time_s, start, _ = seconds_of(joined_stamps(columns.stamps, columns.values.pop(FRACTION), names, where), "ns")
        return time_s, start, "s", columns, None
    said: str = settings.units.time
    if said == "auto" and file.time_name is not None:
        named = named_unit(file.time_name)
        said = named if named in ("ms", "us", "ns") else said
    stamps, wrapped = unwrapped(columns.stamps)
    time_s, start, unit = seconds_of(stamps, said)
    return time_s, start if not pa.types.is_time(columns.stamps.type) else None, unit, columns, wrapped


def _check_same_time(first: Path, time_s: FloatArray, file: AssignedTable, own_s: FloatArray) -> None:
    """Refuse a further file whose rows are not those of the first; one without a time must have as many."""
    if time_s.shape != own_s.shape:
        found = f"{time_s.shape[0]} and {own_s.shape[0]} rows"
    else:
        apart = np.flatnonzero(~np.isclose(time_s, own_s, rtol=0.0, atol=SAME_TIME_S, equal_nan=True))
        if not apart.size or not file.time:
            return
        row = apart[0]
        found = f"row {row + 1}: {time_s[row]:.9g} s and {own_s[row]:.9g} s after the first row"
    raise LogError("the files do not share their time column", where=f"{first} and {file.reader.path}", found=found)


def _joints_of(files: Sequence[AssignedTable]) -> tuple[str, ...]:
    """The joints of all files.

    Raises:
        LogError: two columns hold the same quantity of one joint.
    """
    for quantity in QUANTITIES:
        joints = [joint for _, found in parts_of(files, quantity) for joint in found.joints]
        twice = sorted({joint for joint in joints if joints.count(joint) > 1})
        if twice:
            where = " + ".join(str(file.reader.path) for file, _ in parts_of(files, quantity))
            raise LogError(f"two columns hold the {quantity} of {listed(twice)}", where=where)
    return tuple(dict.fromkeys(joint for key in MOTION for _, found in parts_of(files, key) for joint in found.joints))


def _placed(values: FloatArray, joints: Sequence[str], names: Sequence[str], before: FloatArray | None) -> FloatArray:
    """Columns of some joints among those of all, beside what other files hold; NaN where none does."""
    out = np.full((values.shape[0], len(names)), np.nan) if before is None else before
    known = [k for k, name in enumerate(joints) if name in names]  # a sensor alone makes no joint
    out[:, [names.index(joints[k]) for k in known]] = values[:, known]
    return out
