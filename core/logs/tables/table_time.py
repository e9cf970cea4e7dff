"""Time along the rows of a table: its unit by what the joints do meanwhile; where one run ends, another begins."""

from __future__ import annotations

import json
from collections.abc import Mapping

import numpy as np

from collaudit.core.config.schema import CsvConfig, LogConfig
from collaudit.core.errors import LogError
from collaudit.core.findings import Finding
from collaudit.core.logs.signals.joint_naming import listed
from collaudit.core.logs.signals.signal_names import bare, column_index
from collaudit.core.logs.signals.stamp_conflicts import set_back_findings, straighten_seconds
from collaudit.core.logs.tables.column_assignment import AssignedTable
from collaudit.core.logs.tables.time_columns import SCALES, named_unit, time_parts
from collaudit.core.numeric.arrays import FloatArray, IntArray

#: Longer steps are doubtful where nothing but the size of the numbers says seconds: few arms are recorded so slowly,
#: and milliseconds at 20 kHz step by as much.
_SLOW_S = 0.04
#: Such steps are no seconds, whatever is stated: the arm does anything between two of them.
LONGEST_STEP_S = 2.5

#: Since 2001 seconds since the epoch are a number of ten digits: no count of samples, no time since a start.
_OUR_TIME_NS = 10**18
#: Steps of a time further than this from a unit, as a share, are not in it: velocities are filtered, not scaled.
_NEAR = 0.03


def told_unit(
    file: AssignedTable,
    unit: str,
    time_s: FloatArray,
    start_ns: int | None,
    values: Mapping[str, FloatArray],
    settings: LogConfig,
) -> tuple[str | None, Finding | None]:
    """The unit that the motion tells where nothing states it, and what is said; an error where it must be stated.

    Args:
        file: the table with the time column.
        unit: what it was taken as, by what is stated, its name or the size of its numbers.
        time_s: (n,) its stamps in s by that unit, from the first.
        start_ns: absolute time of the first, ns, by that unit.
        values: quantity to (n, j).
        settings: what is stated.
    """
    if file.time_name is None or unit in ("iso", "rows"):
        return None, None
    name, where = file.time_name, file.file
    stated = settings.units.time != "auto"
    known = stated or named_unit(name) == unit
    of_our_time = start_ns is not None and start_ns >= _OUR_TIME_NS
    step_s = _usual_step_s(time_s)
    raw = step_s * SCALES[unit]
    steps = f"The steps of the time column {name!r} are {raw:.9g}"
    fitting = [json.dumps(one) for one, scale in SCALES.items() if raw / scale < LONGEST_STEP_S]
    other = f"[log.units] time = {' or '.join(fitting)}" if fitting else "[log.units] time"
    if known and step_s >= LONGEST_STEP_S:
        text = (
            f"{steps}, which are {step_s:.9g} s by its unit, {unit}: no motion of an arm can be judged by such steps. "
            f"State another unit, {other}, or the column that holds the time, [log.csv] time."
        )
    elif _repeats_most(time_s):
        pair = _parts(file) or '["sec", "nanosec"]'
        text = (
            f"Most rows have the stamp of the row before in the time column {name!r}: if it holds whole seconds, and "
            f"another column the rest of each, name both: [log.csv] time = {pair}, or their numbers."
        )
    elif not known and (step_s >= LONGEST_STEP_S or (unit == "s" and step_s >= _SLOW_S and not of_our_time)):
        per_count = _seconds_per_count(time_s * SCALES[unit], values)
        told = next((one for one, scale in SCALES.items() if abs(per_count * scale - 1.0) < _NEAR), None)
        if told is not None:
            text = (
                f"{steps}, and its unit is stated nowhere. Positions move by their velocities in one unit only: "
                f'state it, [log.units] time = "{told}".'
            )
            return told, Finding("log-unit-suspect", "error", text, where=where)
        whole = (
            f" Whole seconds seem to stand in a column of their own: [log.csv] time = {parts}."
            if (parts := _parts(file))
            else ""
        )
        hertz = f"{1.0 / (per_count * raw):.3g}" if per_count * raw > 0.0 else ""
        rate = f" = {float(hertz):g}, as positions and velocities tell," if hertz else ""
        text = (
            f"{steps}, and its unit is stated nowhere: state it, {other}.{whole} "
            f"If the column counts rows, state [log.csv] rate_hz{rate} instead."
        )
    else:
        by = f"its name {name!r}" if named_unit(name) == unit else "the size of its numbers"
        text = f"The unit of the time column was taken as {unit}, by {by}."
        return None, None if stated else Finding("log-guessed", "info", text, where=where)
    return None, Finding("log-unit-suspect", "error", text, where=where)


def _parts(file: AssignedTable) -> str:
    """The columns that make the time together, as the configuration states them; empty where none do."""
    found = time_parts(file.reader, file.time)
    return json.dumps(found, ensure_ascii=False) if found else ""


def _usual_step_s(time_s: FloatArray) -> float:
    """Median size of the steps between stamps (n,), s; 0 of fewer than two."""
    known = time_s[np.isfinite(time_s)]
    return float(np.median(np.abs(np.diff(known)))) if known.size > 1 else 0.0


def _repeats_most(time_s: FloatArray) -> bool:
    """Whether nine in ten stamps (n,) are that of the row before, and the others step by whole seconds."""
    steps = np.diff(time_s[np.isfinite(time_s)])
    others = steps[steps != 0]
    return 0 < others.size <= 0.1 * steps.size and bool((others % 1 == 0).all())


def _seconds_per_count(stamps: FloatArray, values: Mapping[str, FloatArray]) -> float:
    """What a step of one stands for, s, where positions and velocities share their unit; 0 where nothing tells.

    Least squares of Δq = s · v · Δstamp over all joints: noise of the positions leaves s without bias.

    Args:
        stamps: (n,) as logged.
        values: quantity to (n, j).
    """
    position, velocity = values.get("position"), values.get("velocity")
    if position is None or velocity is None:
        return 0.0
    moved = np.diff(position, axis=0)
    said = 0.5 * (velocity[1:] + velocity[:-1]) * np.diff(stamps)[:, None]
    held = np.isfinite(moved) & np.isfinite(said)
    squares = float((said[held] ** 2).sum())
    return float((moved[held] * said[held]).sum()) / squares if squares > 0.0 else 0.0


#: Name of the group of columns that holds the number of the run.
RUN = "run"
#: Common names of columns that are the same within a run, or count its rows.
_NAMES = ("run", "run_id", "trial", "trial_id", "episode", "episode_id", "experiment", "experiment_id", "recording",
          "recording_id", "sample", "sample_id", "session", "session_id", "index", "idx", "row", "frame", "step",
          "counter")  # fmt: skip
#: Runs are at least so many rows long, in the mean; what changes more often is something else.
_ROWS = 20
#: The break is given this many periods, so that nothing is judged or filtered across it.
_BREAK_PERIODS = 10


def run_column(file: AssignedTable, settings: CsvConfig) -> int | None:
    """The column that numbers the runs: the one stated, else one with a common name where no time column tells them."""
    names = file.reader.names
    if settings.run is not None:
        return column_index(names, settings.run)
    if settings.row_period_s is None or not file.reader.named:
        return None
    known = {bare(name).lower().replace(" ", "_"): index for index, name in reversed(list(enumerate(names)))}
    index = next((known[name] for name in _NAMES if name in known), None)
    cells = file.reader.first_cells(index) if index is not None else ()
    return index if all(cell.lstrip("+-").isdigit() for cell in cells) else None


def starts_of(runs: FloatArray) -> IntArray | None:
    """Rows, from 0, at which further runs begin; None where the column numbers no runs.

    Args:
        runs: (n,) the number of the run, or a counter of rows that begins again with each.
    """
    steps = np.diff(runs)
    most = runs.shape[0] / _ROWS
    changes = np.flatnonzero(steps != 0) + 1
    if changes.shape[0] <= most:
        return changes
    again = np.flatnonzero((steps < 0) & (runs[1:] <= runs[0])) + 1
    counted = np.count_nonzero(steps == steps[0])
    return again if again.shape[0] <= most and counted + again.shape[0] == steps.shape[0] else None


def split_runs(
    time_s: FloatArray, runs: FloatArray | None, settings: CsvConfig, file: AssignedTable
) -> tuple[FloatArray, list[Finding]]:
    """Let time go on where a run ends and the next begins, after a break.

    Args:
        time_s: (n,) stamps as recorded.
        runs: (n, 1) the column of :func:`run_column`, or None.
        settings: whether it was stated.
        file: of the time column, for messages.

    Returns:
        (n,) stamps, the same array where nothing was found, and what is to be said.

    Raises:
        LogError: the column stated is not there, or changes too often.
    """
    where = file.file
    straight, breaks = straighten_seconds(time_s)
    rows = np.flatnonzero(np.diff(straight - time_s) > _usual_step_s(time_s)) + 1 if breaks else np.empty(0, np.int64)
    findings: list[Finding] = []
    if rows.shape[0] and bool((np.abs(time_s[rows] - time_s[0]) <= _BREAK_PERIODS * _usual_step_s(time_s)).all()):
        findings.append(_finding(rows, "the time column begins again there", where))
    else:
        findings += set_back_findings(breaks, 0, where)
    starts = starts_of(runs[:, 0]) if runs is not None else None
    if starts is None and settings.run is not None:
        why = "the log does not have" if runs is None else "changes too often to number runs"
        text = f"[log.csv] run names a column that {why}"
        raise LogError(text, where=str(file.reader.path), found=str(settings.run))
    if starts is None or not starts.shape[0]:
        return straight, findings
    if not np.array_equal(starts, rows):
        findings.append(_finding(starts, "a column of runs, trials or rows begins anew there", where))
    return _apart(straight, starts), findings


def _apart(time_s: FloatArray, starts: IntArray) -> FloatArray:
    """Shift what follows each start so far that a break lies before it."""
    gap = time_s[starts] - time_s[starts - 1]
    shift = np.zeros(time_s.shape)
    shift[starts] = np.maximum(_BREAK_PERIODS * _usual_step_s(time_s) - gap, 0.0)
    return time_s + np.cumsum(shift)


def _finding(starts: IntArray, why: str, where: str) -> Finding:
    rows = listed([str(row + 1) for row in starts.tolist()])
    text = (
        f"The table holds {starts.shape[0] + 1} runs one after the other: the others begin at row {rows} "
        f"({why}). Each follows after a break, and time goes on."
    )
    return Finding("time-gap", "warning", text, where=where)
