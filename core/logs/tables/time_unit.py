"""The unit of a time column: stated, by its name, by the size of its numbers, or by what the joints do meanwhile."""

from __future__ import annotations

import json
from collections.abc import Mapping

import numpy as np

from collaudit.core.config.schema import LogConfig
from collaudit.core.findings import Finding
from collaudit.core.logs.tables.file_quantities import AssignedTable
from collaudit.core.logs.tables.time_columns import (
    LONGEST_STEP_S,
    SCALES,
    is_doubtful,
    named_unit,
    repeats_most,
    time_parts,
    usual_step_s,
)
from collaudit.core.numeric.arrays import FloatArray

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
    if file.assignment.time is None or unit in ("iso", "rows"):
        return None, None
    name, where = file.reader.names[file.assignment.time], file.reader.path.name
    stated = settings.units.time != "auto"
    known = stated or named_unit(name) == unit
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
    found = time_parts(file.reader, file.assignment.time)
    return json.dumps(found, ensure_ascii=False) if found else ""


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
