"""A logger that stalls: the same sample again and again while the arm moves on. Those samples are a gap."""

from __future__ import annotations

from dataclasses import fields, replace
from typing import Any

import numpy as np

from collaudit.core.data.joint_log import JointLog
from collaudit.core.data.uniform_series import MOVING_RAD_S
from collaudit.core.findings import Finding
from collaudit.core.numeric.arrays import BoolArray
from collaudit.core.numeric.runs import run_bounds

#: This many repeats in a row, and this many times the usual number, are a stall and not a slow source.
_LEAST, _TIMES = 8, 4
_LISTED = 20


def without_stalls(log: JointLog) -> JointLog:
    """The log without samples that only repeat the one before while the arm moved, and a finding for each stall.

    The arm moved if a velocity is logged that says so, or if it stands elsewhere after the stall.
    """
    repeats = _repeats(log)
    if not repeats.any():
        return log
    starts, stops = run_bounds(repeats)
    usual = float(np.median(stops - starts)) if starts.size >= 20 else 0.0
    drop = np.zeros(repeats.size, dtype=bool)
    findings = []
    for a, b in zip(starts, stops, strict=True):
        if b - a >= max(_LEAST, _TIMES * usual) and _moved(log, int(a), int(b)):
            drop[a:b] = True
            first, last = float(log.time_s[a - 1]), float(log.time_s[min(b, repeats.size - 1)])
            text = (
                f"The log repeats one sample {b - a} times from {first:.4g} to {last:.4g} s while the arm moves: the "
                "logger stalled. The repeats were left out; a contact then would not be seen."
            )
            findings.append(Finding("log-stalled", "warning", text, start_s=first, end_s=last))
    if not findings:
        return log
    return _only(log, ~drop, tuple(findings[:_LISTED]))


def _repeats(log: JointLog) -> BoolArray:
    """(n,) samples whose every value is that of the sample before."""
    first = log.position_rad[:, 0]
    at = np.flatnonzero(first[1:] == first[:-1]) + 1  # the first joint says where a closer look is needed
    out = np.zeros(log.time_s.size, dtype=bool)
    out[at] = True
    for values in (log.position_rad, log.velocity_rad_s, log.effort):
        if values is not None:
            now, before = values[at], values[at - 1]
            out[at] &= ((now == before) | (np.isnan(now) & np.isnan(before))).all(axis=1)
    return out


def _moved(log: JointLog, start: int, stop: int) -> bool:
    speed = np.zeros(1) if log.velocity_rad_s is None else np.nan_to_num(np.abs(log.velocity_rad_s[start]))
    if float(speed.max()) > MOVING_RAD_S:
        return True
    if stop >= log.time_s.size:
        return False
    way = np.nan_to_num(np.abs(log.position_rad[stop] - log.position_rad[start - 1]))
    return float(way.max()) > MOVING_RAD_S * float(log.time_s[stop] - log.time_s[start - 1])


def _only(log: JointLog, keep: BoolArray, findings: tuple[Finding, ...]) -> JointLog:
    values = {field.name: getattr(log, field.name) for field in fields(log)}
    rows: dict[str, Any] = {  # every array of a log is by sample
        name: value[keep] for name, value in values.items() if isinstance(value, np.ndarray)
    }
    return replace(log, findings=(*log.findings, *findings), **rows)
