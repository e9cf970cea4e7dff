"""Samples that share a stamp: those that contradict each other are missing, of others the first counts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from collaudit.core.data.joint_log import JointLog
from collaudit.core.findings import Finding
from collaudit.core.logs.signals.stamp_conflicts import contradicting
from collaudit.core.numeric.arrays import FloatArray, IntArray, frozen
from collaudit.core.numeric.parallel import ordered_map


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
        for j, wrong in enumerate(rows):
            if wrong is None:
                continue
            parts.setdefault(name, values.copy(order="F"))[wrong, j] = np.nan
            times, joint, what = log.time_s[wrong], log.joint_names[j], name.partition("_")[0]
            text = (
                f"{times.size} samples share their stamps and give other {what}s of joint '{joint}', between "
                f"{times.min():.4g} and {times.max():.4g} s: two publishers, two recordings in one, or one stamp for "
                "several samples. Nothing shows which are right: they count as missing, and a contact then would not "
                "be seen."
            )
            span = float(times.min()), float(times.max())
            findings.append(Finding("log-publishers-conflict", "warning", text, None, joint, *span))
    if not parts:
        return log
    known = {name: frozen(values) for name, values in parts.items()}
    return replace(log, findings=(*log.findings, *findings), **known)  # type: ignore[arg-type]


def duplicate_findings(log: JointLog, order: IntArray) -> list[Finding]:
    """What was left out because of its stamp, and by how much it differs from what was kept.

    Args:
        log: as recorded.
        order: rows that are used, in time order.
    """
    unused = np.isfinite(log.time_s)
    unused[order] = False
    rows = np.flatnonzero(unused)
    kept = order[np.minimum(np.searchsorted(log.time_s[order], log.time_s[rows]), order.size - 1)]
    same = log.time_s[kept] == log.time_s[rows]
    rows, kept = rows[same], kept[same]
    if not rows.size:
        return []
    text = f"{rows.size} samples have the stamp of the sample before and were left out (the first was kept)"
    by = []
    for what, values in (("positions", log.position_rad), ("efforts", log.effort)):
        apart = 0.0 if values is None else float(np.nanmax(np.abs(values[rows] - values[kept]), initial=0.0))
        if apart > 0.0:
            by.append(f"{what} of up to {apart:.3g}")
    if not by:
        return [Finding("time-duplicate", "info", f"{text}; they are the same.")]
    return [Finding("time-duplicate", "warning", f"{text}; they differ in {' and '.join(by)}.")]
