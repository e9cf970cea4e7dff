"""Pushes added to real logs: how many are found, and what alarms without one (part ``pushes``).

A force of random direction acts for 0.2 s on the tool, on the last link but one or on the fourth, and loads the joints
by J(q)^T f through the log's own poses. Its size gives one joint, which moves all the while, 1.5 times the 99.9 %
quantile of what a day's script leaves on it. Thresholds stand at the motion's level ("sharpest").
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from changed_logs import judged, named
from plain_script import MOVING_RAD_S, left_over, samples_of, split
from real_log_list import REAL_LOGS, RealLog

from collaudit.core import api
from collaudit.core.config import LoadedConfig
from collaudit.core.data.audit_result import Audit
from collaudit.core.data.joint_log import JointLog
from collaudit.core.data.signals import State
from collaudit.core.errors import CollauditError
from collaudit.core.robot.robot_model import RobotModel

SIZE, LASTS_S, EDGE_S, APART_S, PASSES, LEAST_MOTION_S = 1.5, 0.2, 0.02, 1.5, 4, 20.0
#: A push is found by a contact that begins so long after it at most, s; until then a contact is no false one.
_AFTER_S = 0.4


@dataclass(frozen=True, slots=True)
class Push:
    """One push: when, on which frame, of which joint's torque it is a multiple, and whether that joint was judged."""

    start_s: float
    frame: str
    joint: str
    judged: bool


def measure(asked: Any, known: frozenset[str]) -> Iterator[tuple[str, dict[str, Any]]]:
    """Every log with so much motion."""
    for number, log in enumerate(REAL_LOGS):
        if log.name in known or (asked.logs and log.name not in asked.logs):
            continue
        settings = log.settings(asked.data, asked.work, "sharpest")
        try:
            found = pushed(log, settings, asked.data, asked.work, asked.seed + 100 * number)
        except CollauditError as error:
            found = {"refused": error.message}
        yield log.name, {"left_out": log.left_out, **found}


def pushed(log: RealLog, settings: LoadedConfig, data: Path, work: Path, seed: int) -> dict[str, Any]:
    """Found and false of one log, with friction fitted on the log as it is, or on the other."""
    read = api.open_log(log.files(data, work), settings)
    friction = api.fit([log.fitted_files(data, work)], settings)
    plain = judged(read, settings, friction)
    moving_s = _moving_s(plain)
    out: dict[str, Any] = {"moving_s": moving_s, "contacts": len(plain.result.contacts), "pushes": {}}
    if moving_s < LEAST_MOTION_S:
        return out
    model = api.load_robot(settings, plain.signals.joint_names)
    first, rest = split(samples_of(plain.signals, model))
    left = left_over(first, rest)
    unit = SIZE * np.array([_p999(left[rest.moving[:, j], j]) for j in range(left.shape[1])])
    own = [(one.onset_s, one.end_s) for one in plain.result.contacts]
    found: dict[str, dict[str, int]] = {}
    false = 0
    for number in range(PASSES):
        spoilt, pushes = with_pushes(read, plain, model, unit, np.random.default_rng([seed, number]))
        contacts = [(one.onset_s, one.end_s) for one in judged(spoilt, settings, friction).result.contacts]
        for push in pushes:
            row = found.setdefault(f"{push.frame}", {"pushes": 0, "found": 0, "judged": 0, "judged_found": 0})
            hit = any(a < push.start_s + LASTS_S + _AFTER_S and b > push.start_s for a, b in contacts)
            row["pushes"] += 1
            row["found"] += hit
            row["judged"] += push.judged
            row["judged_found"] += hit and push.judged
        spans = own + [(push.start_s, push.start_s + LASTS_S + _AFTER_S) for push in pushes]
        false += sum(not any(a < end and b > start for start, end in spans) for a, b in contacts)
    return {**out, "pushes": found, "false": false, "passes": PASSES}


def _p999(values: np.ndarray) -> float:
    return float(np.quantile(np.abs(values), 0.999)) if values.size > 200 else np.inf


def _moving_s(audit: Audit) -> float:
    """Time in which any joint moves."""
    fast = (np.abs(np.asarray(audit.signals.velocity_rad_s)) > MOVING_RAD_S).any(axis=1)
    return float(np.count_nonzero(fast)) * audit.result.log.sample_period_s


def with_pushes(
    log: JointLog, audit: Audit, model: RobotModel, unit_nm: np.ndarray, rng: np.random.Generator
) -> tuple[JointLog, list[Push]]:
    """A copy of the log with pushes of ``unit_nm`` (j,) on one joint each, and what they are."""
    signals = audit.signals
    gain = effort_per_nm(log, audit)
    frames = [model.link_of(model.joint_names[k]) for k in (3, -2)] + [model.frame_names[-1]]
    assert log.effort is not None
    effort, pushes = log.effort.copy(), []
    order = [log.joint_names.index(name) for name in signals.joint_names]
    end = float(signals.time_s[-1]) - LASTS_S - 0.5
    at = 0.5 + rng.uniform(0.0, APART_S)
    while at < end:
        push = _drawn(at, frames[int(rng.integers(3))], audit, model, unit_nm, rng)
        if push is None:
            at += 0.05  # nothing moves here that it would load
            continue
        made, torque_nm = push
        rows = np.flatnonzero((log.time_s >= at) & (log.time_s < at + LASTS_S))
        away = np.minimum(log.time_s[rows] - at, at + LASTS_S - log.time_s[rows])
        shape = np.sin(0.5 * np.pi * np.clip(away / EDGE_S, 0.0, 1.0)) ** 2
        for k, column in enumerate(order):
            there = np.interp(log.time_s[rows], *torque_nm(k))
            effort[rows, column] += gain[k] * shape * there
        pushes.append(made)
        at += APART_S * rng.uniform(1.0, 1.5)
    return named(replace(log, effort=effort), f"pushed {rng.integers(10**9)}"), pushes


def _drawn(
    at: float, frame: str | None, audit: Audit, model: RobotModel, unit_nm: np.ndarray, rng: np.random.Generator
) -> tuple[Push, Any] | None:
    """A push at this time, and its torque over time by joint; None where the joint it loads most does not move."""
    signals = audit.signals
    a, b = np.searchsorted(signals.time_s, [at, at + LASTS_S])
    rows = slice(max(int(a) - 1, 0), int(b) + 1)
    q = np.ascontiguousarray(signals.position_rad[rows])
    if frame is None or not np.isfinite(q).all():
        return None
    force = rng.normal(size=3)
    wrench = np.tile(np.r_[force / np.linalg.norm(force), np.zeros(3)], (len(q), 1))
    load = model.wrench_torque(q, wrench, frame)
    share = np.abs(load).mean(axis=0) / unit_nm
    j = int(np.argmax(share))
    if share[j] < 1e-9 or not (np.abs(signals.velocity_rad_s[rows, j]) > MOVING_RAD_S).all():
        return None
    load = load / share[j]
    seen = bool((np.asarray(signals.state[rows, j]) == State.JUDGED).all())
    return Push(at, frame, signals.joint_names[j], seen), lambda k: (signals.time_s[rows], load[:, k])


def effort_per_nm(log: JointLog, audit: Audit) -> np.ndarray:
    """(j,) effort as read for a N·m as judged: 1, or the gain that the fit found."""
    signals = audit.signals
    assert log.effort is not None
    out = np.ones(len(signals.joint_names))
    for k, name in enumerate(signals.joint_names):
        measured = np.asarray(signals.measured_nm[:, k])
        raw = np.interp(signals.time_s, log.time_s, log.effort[:, log.joint_names.index(name)])
        known = np.isfinite(measured) & np.isfinite(raw)
        if np.count_nonzero(known) > 2 and np.ptp(measured[known]) > 0.0:
            out[k] = np.polyfit(measured[known], raw[known], 1)[0]
    return out


def tables(found: Mapping[str, Any], before: Mapping[str, Any]) -> Iterator[tuple[str, list[str]]]:
    """One row a log."""
    lines = ["| log | in motion | found | of those in judged time | by frame | contacts of the log as it is "
             "| contacts at no push | found before |", "|---|---|---|---|---|---|---|---|"]  # fmt: skip
    for left_out in (False, True):
        total = np.zeros(4, dtype=int)
        for log, its in found.items():
            if its["left_out"] != left_out:
                continue
            if not its.get("pushes"):
                why = its.get("refused", f"{its.get('moving_s', 0.0):.1f} s of motion: too little")
                lines.append(f"| {log} | {why} | | | | {its.get('contacts', '')} | | |")
                continue
            count = _sum(its)
            total += count
            frames = ", ".join(f"{name} {row['found']}/{row['pushes']}" for name, row in its["pushes"].items())
            old = _sum(before.get(log, {"pushes": {}}))
            lines.append(
                f"| {log} | {its['moving_s']:.1f} s | {_share(*count[:2])} | {_share(*count[2:])} | {frames} "
                f"| {its['contacts']} | {its['false']} in {its['passes']} passes | {_share(*old[:2])} |"
            )
        if total[0]:
            which = "arms left out" if left_out else "all others"
            lines.append(f"| **{which}** | | **{_share(*total[:2])}** | {_share(*total[2:])} | | | | |")
    yield "pushes", lines


def _sum(its: Mapping[str, Any]) -> np.ndarray:
    """Pushes and those found, of all and of those in judged time."""
    rows = its.get("pushes", {}).values()
    return np.array([sum(row[key] for row in rows) for key in ("pushes", "found", "judged", "judged_found")], dtype=int)


def _share(count: int, found: int) -> str:
    return f"{found} of {count} ({100 * found / count:.0f} %)" if count else "–"
