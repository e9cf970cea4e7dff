"""Stamps that several samples bear: where these contradict each other, none of them counts; else one of each does."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from collaudit.core.data.joint_log import JointLog
from collaudit.core.findings import Finding
from collaudit.core.logs.signals.stamp_conflicts import contradicting
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray, frozen
from collaudit.core.numeric.parallel import ordered_map
from collaudit.core.numeric.tables import copied

_UNITS = {"Nm": "N·m"}


def without_contradictions(log: JointLog) -> JointLog:
    """The log without the values of samples that share a stamp and contradict each other, and a finding for each joint.

    Nothing tells which of them was measured, and the order of the rows does not.
    """
    parts: dict[str, FloatArray] = {}
    findings: list[Finding] = []
    for name, values in (("position_rad", log.position_rad), ("effort", log.effort)):
        if values is None:
            continue
        rows = ordered_map(lambda column: contradicting(log.time_s, column), values.T)
        told = {j: wrong for j, wrong in enumerate(rows) if wrong is not None}
        if told:
            known = copied(values)
            unit = "rad" if name == "position_rad" else _UNITS.get(log.effort_unit, "")
            for j, wrong in told.items():
                known[wrong, j] = np.nan
                findings.append(_conflict(log, j, wrong, name.partition("_")[0], values, unit))
            parts[name] = frozen(known)
    if not parts:
        return log
    return replace(log, findings=(*log.findings, *findings), **parts)  # type: ignore[arg-type]


def _conflict(log: JointLog, j: int, wrong: BoolArray, what: str, values: FloatArray, unit: str) -> Finding:
    joint, at = log.joint_names[j], np.flatnonzero(wrong)
    _, size = _from_the_first(log.time_s[at], values[at, j : j + 1])
    first, last = float(np.min(log.time_s[at])), float(np.max(log.time_s[at]))
    text = (
        f"{at.size} samples share their stamps and give other {what}s of joint '{joint}', by up to {size.max():.3g} "
        f"{unit}, between {first:.4g} and {last:.4g} s: two publishers, two recordings in one, or one stamp for "
        "several samples. Nothing shows which are right: they count as missing, and a contact then would not be seen."
    )
    return Finding("log-publishers-conflict", "warning", text, joint=joint, start_s=first, end_s=last)


def duplicate_findings(log: JointLog, order: IntArray) -> list[Finding]:
    """What was left out because of its stamp, and by how much it differs from what was kept.

    Args:
        log: as recorded.
        order: rows that are used.
    """
    unused = np.isfinite(log.time_s)
    unused[order] = False
    if not unused.any():
        return []
    values = np.concatenate([log.position_rad, *([] if log.effort is None else [log.effort])], axis=1)
    rows, size = _from_the_first(log.time_s, values)
    here = unused[rows]
    if not here.any():
        return []
    largest = size[here].max(axis=0)
    left_out = np.count_nonzero(here)
    text = f"{left_out} samples have the stamp of the sample before and were left out (the first was kept)"
    count = len(log.joint_names)
    parts = [(largest[:count], "positions", "rad"), (largest[count:], "efforts", _UNITS.get(log.effort_unit, ""))]
    by = [
        f"{what} of up to {part.max():.3g} {unit} ({log.joint_names[int(np.argmax(part))]})".replace("  ", " ")
        for part, what, unit in parts
        if part.size and part.max() > 0.0
    ]
    if not by:
        return [Finding("time-duplicate", "info", f"{text}; they are the same.")]
    return [Finding("time-duplicate", "warning", f"{text}; they differ in {' and '.join(by)}.")]


def _from_the_first(time_s: FloatArray, values: FloatArray) -> tuple[IntArray, FloatArray]:
    """(m,) rows that are not the first of their stamp, and (m, c) how far their values are from those of the first."""
    known = np.flatnonzero(np.isfinite(time_s))
    sorting = known[np.argsort(time_s[known], kind="stable")]
    stamps = time_s[sorting]
    fresh = np.concatenate(([True], np.diff(stamps) > 0.0))
    first = sorting[np.flatnonzero(fresh)[np.cumsum(fresh) - 1]]
    rows = sorting[~fresh]
    return rows, np.nan_to_num(np.abs(values[rows] - values[first[~fresh]]))
