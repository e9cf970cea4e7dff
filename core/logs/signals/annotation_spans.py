"""Annotations from what holds at each stamp: stretches of time, phases, a controller's modes; findings about them."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

import numpy as np

from collaudit.core.data.joint_log import Annotation
from collaudit.core.findings import Finding, fact
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray, run_bounds
from collaudit.core.vendors.vendor_words import (
    FRANKA_MODE,
    MODE_WORDS,
    ROBOT_COLUMNS,
    SAFETY_COLUMNS,
    UR_ROBOT_MODE,
    UR_RUNNING,
    UR_SAFETY_MODE,
)

#: Annotations that come and go more often than this are counted, not listed.
LISTED = 100
#: More values of a phase than this are a measurement, not phases.
MAX_PHASES = 100


def spans_of(time_s: FloatArray, holds: BoolArray) -> list[tuple[float, float]]:
    """(first, last) stamp of each run of True."""
    starts, stops = run_bounds(holds)
    return list(zip(time_s[starts].tolist(), time_s[stops - 1].tolist(), strict=True))


def until_changed(time_s: FloatArray, holds: BoolArray, end_s: float) -> tuple[tuple[float, float], ...]:
    """(start, end) of each run of True, up to the stamp that ends it; the last lasts to the end of the log."""
    starts, stops = run_bounds(holds)
    ends = np.append(time_s, max(end_s, float(time_s[-1])))
    return tuple(zip(time_s[starts].tolist(), ends[stops].tolist(), strict=True))


def phases_of(
    time_s: FloatArray, words: Sequence[str], end_s: float, source: str
) -> tuple[list[Annotation], list[Finding]]:
    """Phases from a value at each stamp; refused where there are too many values."""
    values = list(dict.fromkeys(words))
    if len(values) > MAX_PHASES:
        text = f"{source} was configured as the phase and has {len(values)} values; it was left out."
        return [], [Finding("log-label-missing", "warning", text, where=source)]
    number = {value: index for index, value in enumerate(values)}
    which = np.array([number[word] for word in words], dtype=np.int64)
    return [
        Annotation(value, source, until_changed(time_s, which == index, end_s))
        for index, value in enumerate(values)
        if value
    ], []


def absent_labels(names: Sequence[str], setting: str, where: str) -> list[Finding]:
    """That a log lacks labels which a configuration of many logs names: they are no labels, and no fault."""
    if not names:
        return []
    text = f"This log has no label {', '.join(names)}, which {setting} names: none of its time is marked by it."
    return [Finding("log-label-missing", "warning", text, where=where)]


def annotation_findings(annotations: Sequence[Annotation]) -> list[Finding]:
    """One finding for each time an annotation holds."""
    findings = []
    for annotation in annotations:
        of = f" of {annotation.joint}" if annotation.joint else ""
        for first, last in annotation.intervals_s:
            text = f"The log itself says {annotation.name}{of} from {first:.4g} s to {last:.4g} s."
            findings.append(fact(text, annotation.source, annotation.joint, first, last))
    if len(findings) > LISTED:
        text = f"Flags are raised {len(findings) - LISTED} more times."
        findings = [*findings[:LISTED], fact(text)]
    return findings


def mode_columns(names: Sequence[str]) -> tuple[str, ...]:
    """The columns of a table that hold a mode, by their names."""
    return tuple(name for name in names if _letters(name).endswith((*SAFETY_COLUMNS, *ROBOT_COLUMNS)))


def mode_annotations(
    texts: Mapping[str, Sequence[str]], rows: IntArray, stamps: FloatArray, where: str
) -> list[Annotation]:
    """The states that mode columns tell, one annotation each.

    Args:
        texts: column name to the text of each row.
        rows: (k,) rows with a stamp, in time order.
        stamps: (k,) s.
        where: the file.
    """
    out = []
    for name in mode_columns(list(texts)):
        # whole numbers without their decimals
        values = np.array([texts[name][row].strip().removesuffix(".0") for row in rows.tolist()], dtype=object)
        meaning = _meaning(name, set(values.tolist()))
        for state in dict.fromkeys(meaning.values()):
            holds = np.array([meaning.get(value) == state for value in values.tolist()], dtype=np.bool_)
            if holds.any():
                out.append(Annotation(state, f"{where}, column {name.strip()}", tuple(spans_of(stamps, holds))))
    return out


def _meaning(name: str, values: set[str]) -> dict[str, str]:
    """Value to state. A robot_mode that is ever 7, running, is UR's; libfranka's stays below."""
    of_robot = UR_ROBOT_MODE if str(UR_RUNNING) in values else FRANKA_MODE
    states = UR_SAFETY_MODE if _letters(name).endswith(SAFETY_COLUMNS) else of_robot
    bare = {value: _letters(value).removeprefix("robotmode").removeprefix("k") for value in values}
    words = {value: MODE_WORDS[word] for value, word in bare.items() if word in MODE_WORDS}
    return {**{str(number): state for number, state in states.items()}, **words}


def _letters(text: str) -> str:
    return re.sub(r"[^a-z]", "", text.lower())
