"""How soon a causal detector alarms on a torque of twice its threshold, at 100 and at 500 Hz (part ``delay``)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from changed_logs import fitted, judged, named, of_rows, prepared
from simulated_arm import ARMS, settings_of, simulated

from collaudit.core import api
from collaudit.core.data.audit_result import Audit, FrictionFile
from collaudit.core.data.joint_log import JointLog
from collaudit.core.data.signals import State
from collaudit.core.errors import CollauditError

DETECTORS, EVERY = ("direct", "momentum"), {500: 1, 100: 5}
SIZE, LASTS_S, APART_S, FITTED_S, JUDGED_S = 2.0, 0.3, 1.2, 120.0, 120.0
_AFTER_S = 0.4


def measure(asked: Any, known: frozenset[str]) -> Iterator[tuple[str, dict[str, Any]]]:
    """Each arm at each rate with each detector."""
    for robot in ARMS:
        for rate, every in EVERY.items():
            for detector in DETECTORS:
                name = f"{robot}, {rate} Hz, {detector}"
                if name not in known:
                    try:
                        yield name, of_arm(asked.work / "simulated", robot, every, detector, asked.seed)
                    except CollauditError as error:
                        yield name, {"refused": error.message}


def of_arm(folder: Path, robot: str, every: int, detector: str, seed: int) -> dict[str, Any]:
    """Delays of the pushes found, how many were made, and contacts at no push."""
    first = simulated(folder, "free-clean", seed, robot=robot, seconds=FITTED_S)
    other = simulated(folder, "free-clean", seed + 1, robot=robot, seconds=JUDGED_S)
    settings = settings_of(first, {"detect.causal": True, "detect.detector": detector})
    logs = [_thinned(api.open_log((path,), settings), every) for path in (first, other)]
    friction: FrictionFile = fitted([prepared(logs[0], settings)], settings)
    plain = judged(logs[1], settings, friction)
    spoilt, pushes = with_steps(logs[1], plain, np.random.default_rng([seed, every]))
    audit = judged(spoilt, settings, friction)
    alarms = [(one.onset_s, one.onset_s + one.duration_s, one.detected_s) for one in audit.result.collisions]
    delays = []
    for start in pushes:
        hits = [seen for a, b, seen in alarms if a < start + LASTS_S and b > start]
        delays += [min(hits) - start] if hits else []
    false = sum(
        not any(one.onset_s < start + LASTS_S + _AFTER_S and one.end_s > start for start in pushes)
        for one in audit.result.contacts
    )
    return {
        "pushes": len(pushes), "delays_s": delays, "false": false, "contacts": len(plain.result.contacts),
        "n": audit.result.rule.n, "gamma_nm": dict(audit.result.rule.gamma_nm),
    }  # fmt: skip


def _thinned(log: JointLog, every: int) -> JointLog:
    return of_rows(log, np.arange(0, log.time_s.size, every), f"1 of {every}")


def with_steps(log: JointLog, audit: Audit, rng: np.random.Generator) -> tuple[JointLog, list[float]]:
    """Steps of torque on one judged joint after the other, and when each begins."""
    signals, level = audit.signals, audit.signals.gamma_nm
    assert log.effort is not None
    effort, starts, at = log.effort.copy(), [], 1.0
    while at < signals.time_s[-1] - LASTS_S - 1.0:
        a, b = np.searchsorted(signals.time_s, [at, at + LASTS_S])
        open_to = np.flatnonzero((signals.state[a:b] == State.JUDGED).all(axis=0) & np.isfinite(level[a]))
        if not open_to.size:
            at += 0.05
            continue
        j = int(rng.choice(open_to))
        rows = (log.time_s >= at) & (log.time_s < at + LASTS_S)
        column = log.joint_names.index(signals.joint_names[j])
        effort[rows, column] += rng.choice([-1.0, 1.0]) * SIZE * level[a, j]
        starts.append(float(log.time_s[np.argmax(rows)]))
        at += APART_S * rng.uniform(1.0, 1.5)
    return named(replace(log, effort=effort), "pushed"), starts


def tables(found: Mapping[str, Any], before: Mapping[str, Any]) -> Iterator[tuple[str, list[str]]]:
    """One row an arm, rate and detector."""
    lines = ["| arm, rate, detector | n | pushes found | median delay | 95 % below | at no push | median before |",
             "|---|---|---|---|---|---|---|"]  # fmt: skip
    for name, its in found.items():
        if "refused" in its:
            lines.append(f"| {name} | refused: {its['refused']} | | | | | |")
            continue
        delays, old = 1000 * np.array(its["delays_s"]), 1000 * np.array(before.get(name, {}).get("delays_s", []))
        lines.append(
            f"| {name} | {its['n']} | {len(delays)} of {its['pushes']} | {_ms(delays, 0.5)} | {_ms(delays, 0.95)} "
            f"| {its['false']} | {_ms(old, 0.5)} |"
        )
    yield "delay", lines


def _ms(values: np.ndarray, share: float) -> str:
    return f"{np.quantile(values, share):.0f} ms" if values.size else "–"
