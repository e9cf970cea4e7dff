"""Rows that are no samples of one run: those of other sensors, merged by time; where one run ends, another begins."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from collaudit.core.config.schema import CsvConfig
from collaudit.core.errors import LogError
from collaudit.core.findings import Finding, fact
from collaudit.core.logs.signals.joint_naming import listed
from collaudit.core.logs.signals.sample_clock import interpolate
from collaudit.core.logs.signals.stamp_conflicts import set_back_findings, straighten_seconds
from collaudit.core.logs.tables.column_patterns import bare, column_index
from collaudit.core.logs.tables.file_quantities import AssignedTable
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray

#: A quantity stands on rows of its own where so few of its rows have positions: two topics have the same stamp now and
#: then. A quantity with missing values shares the rows that it has.
_SHARED = 0.05


def rows_with_joints(columns: Mapping[str, FloatArray]) -> BoolArray | None:
    """(n,) rows that hold a value of any joint; None where all have a position.

    Args:
        columns: quantity to (n, j), NaN where a cell is empty.
    """
    position = columns.get("position")
    if position is None or not position.size or not np.isnan(position[:, 0]).any():
        return None
    held: BoolArray = np.logical_or.reduce([np.isfinite(values).any(axis=1) for values in columns.values()])
    return None if held.all() else held


def joint_samples(
    time_s: FloatArray, columns: dict[str, FloatArray], where: str
) -> tuple[BoolArray | None, list[Finding]]:
    """Leave the rows that are samples in the columns of joints, and bring quantities on other rows to these.

    Between the first and the last row with a value of a joint, rows without any are no samples, as if they were not in
    the file. Before and behind they stay: time in which the joints were lost.

    Args:
        time_s: (n,) stamps.
        columns: quantity to (n, j), NaN where a cell is empty; changed in place to (m, j).
        where: the file, for findings.

    Returns:
        (n,) the m rows that are samples, None where all are; and what is to be said.
    """
    filled = {quantity: np.isfinite(values).any(axis=1) for quantity, values in columns.items()}
    shared = {quantity: np.count_nonzero(filled[quantity] & filled["position"]) for quantity in filled}
    apart = sorted(q for q in filled if filled[q].any() and shared[q] <= _SHARED * np.count_nonzero(filled[q]))
    held = np.logical_or.reduce([filled[quantity] for quantity in filled if quantity not in apart])
    if not held.any() or held.all():
        return None, []
    first, last = np.flatnonzero(held)[[0, -1]]
    empty = ~np.logical_or.reduce([*filled.values()])
    empty[first:last] = False
    samples = held | empty
    for quantity, values in columns.items():
        own = filled[quantity]
        at = interpolate(time_s[samples], time_s[own], values[own]) if quantity in apart else values[samples]
        columns[quantity] = np.asfortranarray(at)
    left_out = int(np.count_nonzero(~samples))
    text = f"{left_out} of {held.size} rows hold no sample of the joints, but other signals or nothing."
    if apart:
        text += f" Rows of its own has: {', '.join(apart)}; its values were brought to the stamps of the positions."
    return samples, [fact(text, where=where)] if left_out else []


def held_words(words: Sequence[str], samples: BoolArray) -> tuple[str, ...]:
    """Text of each row, of rows that are no samples the last before where they have none.

    Args:
        words: n texts; samples: (n,).
    """
    out, last = [], ""
    for word, sample in zip(words, samples.tolist(), strict=True):
        last = word if sample or word.strip() else last
        out.append(last)
    return tuple(out)


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
    where = file.reader.path.name
    straight, breaks = straighten_seconds(time_s)
    rows = np.flatnonzero(np.diff(straight - time_s) > _period(time_s)) + 1 if breaks else np.empty(0, np.int64)
    findings: list[Finding] = []
    if rows.shape[0] and bool((np.abs(time_s[rows] - time_s[0]) <= _BREAK_PERIODS * _period(time_s)).all()):
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
    shift[starts] = np.maximum(_BREAK_PERIODS * _period(time_s) - gap, 0.0)
    return time_s + np.cumsum(shift)


def _period(time_s: FloatArray) -> float:
    steps = np.abs(np.diff(time_s))
    return float(np.median(steps[np.isfinite(steps)])) if np.isfinite(steps).any() else 0.0


def _finding(starts: IntArray, why: str, where: str) -> Finding:
    rows = listed([str(row + 1) for row in starts.tolist()])
    text = (
        f"The table holds {starts.shape[0] + 1} runs one after the other: the others begin at row {rows} "
        f"({why}). Each follows after a break, and time goes on."
    )
    return Finding("time-gap", "warning", text, where=where)
