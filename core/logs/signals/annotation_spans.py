"""Annotations from what holds at each stamp: stretches of time, phases, and findings about them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from collaudit.core.data.joint_log import Annotation
from collaudit.core.findings import Finding, fact
from collaudit.core.numeric.arrays import BoolArray, FloatArray, run_bounds

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
