"""Evidence that is not what it seems: contaminated, drifting, of slow motion only, short.

    python tests/bench/recommend_evidence.py RUN... > tables.md

RUN: as of ``recommend_truth.py``. Every row takes three logs (15 min) as evidence, of which something is spoilt.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from collaudit.core.config.schema_detect import EvidenceConfig
from collaudit.core.data.audit_result import Audit
from collaudit.core.data.signals import State
from collaudit.core.recommend.arm_evidence import ArmEvidence, gather_evidence
from collaudit.core.recommend.evidence_range import range_findings, ranges_of_evidence
from collaudit.core.recommend.joint_thresholds import JointEvidence, recommend_joints
from collaudit.core.recommend.outlying_peaks import outlying_stretches, without_outliers
from collaudit.reports.files.run_files import read_run

PERSISTENCE_S, LOGS, PUSHES = 0.026, 3, 6
Rules = dict[str, float]


def row(*cells: object) -> None:
    print("| " + " | ".join(f"{c:.3g}" if isinstance(c, float) else str(c) for c in cells) + " |", flush=True)


def head(title: str, *cells: str) -> None:
    print(f"\n### {title}\n")
    row(*cells)
    row(*["---"] * len(cells))


def gammas(evidence: ArmEvidence) -> tuple[Rules, dict[str, JointEvidence]]:
    rules, found = recommend_joints(evidence, PERSISTENCE_S)
    return {joint: rule.gamma_nm or np.nan for joint, rule in rules.items()}, found


def spoilt(audit: Audit, change: Callable[[np.ndarray], np.ndarray]) -> Audit:
    changed = change(audit.signals.residual_nm.copy())
    return replace(audit, signals=replace(audit.signals, residual_nm=changed))


def contaminated(groups: Sequence[list[Audit]]) -> None:
    """Pushes on random joints, of 50 to 400 ms, half-sine or square, that no rule noticed."""
    cells = ("push / largest clean", "pushes found", "stretches besides", "gamma / clean gamma", "without the test")
    head("Contaminated: unlabelled pushes", *cells)
    rng = np.random.default_rng(1)
    clean = [gammas(gather_evidence(group))[0] for group in groups]
    for size in (0.7, 1.0, 1.5, 2.0, 4.0, 10.0):
        hits, besides, after, before = [], 0, [], []
        for group, usual in zip(groups, clean, strict=True):
            pushed, when = zip(*[push(audit, size, rng) for audit in group], strict=True)
            evidence = gather_evidence(pushed)
            out = outlying_stretches(evidence, PERSISTENCE_S)
            for audit, times in zip(pushed, when, strict=True):
                own = [s for s in out if s.log == audit.result.log.name]
                hits += [any(s.start_s <= t + 0.2 and t <= s.end_s for s in own) for t in times]
                besides += sum(not any(s.start_s <= t + 0.5 and t <= s.end_s for t in times) for s in own)
            now, plain = gammas(without_outliers(evidence, out))[0], gammas(evidence)[0]
            after += [now[j] / usual[j] for j in usual]
            before += [plain[j] / usual[j] for j in usual]
        spread = [f"{np.median(x):.2f} (up to {np.max(x):.2f})" for x in (after, before)]
        row(size, f"{100 * np.mean(hits):.0f} %", besides, *spread)


def push(audit: Audit, size: float, rng: np.random.Generator) -> tuple[Audit, list[float]]:
    largest = np.nanmax(np.abs(audit.signals.residual_nm), axis=0)
    period, n = audit.result.log.sample_period_s, audit.signals.time_s.size
    times = []

    def change(x: np.ndarray) -> np.ndarray:
        for _ in range(PUSHES):
            at, length = int(rng.integers(2000, n - 2000)), int(rng.integers(25, 200))
            shape = np.ones(length) if rng.random() < 0.5 else np.sin(np.linspace(0, np.pi, length))
            feels = rng.random(x.shape[1]) < 0.4
            feels[rng.integers(0, x.shape[1])] = True
            x[at : at + length] += size * shape[:, None] * largest * feels * rng.choice([-1, 1])
            times.append(at * period)
        return x

    return spoilt(audit, change), times


def drifting(groups: Sequence[list[Audit]]) -> None:
    """A residual that grows evenly from the first to the last log."""
    head("Drifting: a residual that grows over the 15 min", "growth", "joints called drifting", "gamma / clean gamma")
    clean = [gammas(gather_evidence(group))[0] for group in groups]
    for growth in (1.0, 1.2, 1.5, 2.0):
        called, ratio = [], []
        for group, usual in zip(groups, clean, strict=True):
            n = sum(a.signals.time_s.size for a in group)
            parts = np.split(np.linspace(1, growth, n), np.cumsum([a.signals.time_s.size for a in group])[:-1])
            grown = [spoilt(a, lambda x, p=p: x * p[:, None]) for a, p in zip(group, parts, strict=True)]
            now, found = gammas(gather_evidence(grown))
            called += [item.tail is not None and item.tail.drift is not None for item in found.values()]
            ratio += [now[j] / usual[j] for j in usual]
        row(growth, f"{100 * np.mean(called):.0f} %", float(np.median(ratio)))


def regimes(groups: Sequence[list[Audit]]) -> None:
    """Evidence of the slow part of the motion only, and the whole motion judged by it."""
    head("Slow evidence, whole motion", "evidence", "joints told so (evidence-range)", "share of the log, median")
    for name, slowest in (("the whole motion", np.inf), ("below 0.7 rad/s", 0.7), ("below 0.4 rad/s", 0.4)):
        told, share = [], []
        for group, other in zip(groups, [*groups[1:], groups[0]], strict=True):
            ranges = ranges_of_evidence(gather_evidence([slowed(a, slowest) for a in group]))
            stated = {
                j: EvidenceConfig(
                    fastest_rad_s=r.fastest_rad_s, hardest_rad_s2=r.hardest_rad_s2, load_nm=(r.least_nm, r.most_nm)
                )
                for j, r in ranges.items()
            }
            signals = other[0].signals
            found = range_findings(signals, other[0].result.log.sample_period_s, (), None, stated)
            warned = [f for f in found if f.severity == "warning"]
            told.append(len(warned) / len(stated))
            share += [float(f.text.split(" %")[0]) for f in warned]
        row(name, f"{100 * np.mean(told):.0f} %", f"{np.median(share):.0f} %" if share else "")


def slowed(audit: Audit, slowest: float) -> Audit:
    fast = np.abs(audit.signals.velocity_rad_s) > slowest
    state = np.where(fast, np.int8(State.TOO_FAST), audit.signals.state).astype(np.int8)
    return replace(audit, signals=replace(audit.signals, state=state))


def short(audits: Sequence[Audit]) -> None:
    """The first seconds of a log as evidence; alarms that its gamma would give in all the other logs."""
    head(
        "Short: one log's beginning", "minutes", "refused", "gamma / that of 50 min", "false alarms in the others, 1/h"
    )
    usual, found = gammas(gather_evidence(audits))
    for minutes in (0.5, 1.0, 2.0, 3.2, 4.5):
        refused, ratio, alarms = [], [], []
        for audit in audits[:6]:
            state = np.where((audit.signals.time_s > 60 * minutes)[:, None], np.int8(State.EDGE), audit.signals.state)
            part = replace(audit, signals=replace(audit.signals, state=state.astype(np.int8)))
            now, _ = gammas(gather_evidence([part]))
            refused += [not np.isfinite(g) for g in now.values()]
            known = {j: g for j, g in now.items() if np.isfinite(g)}
            ratio += [g / usual[j] for j, g in known.items()]
            alarms += [(found[j].peaks.level_nm > g).sum() / found[j].peaks.hours for j, g in known.items()]
        told = (float(np.median(ratio)), float(np.sum(alarms) / 6)) if ratio else ("", "")
        row(minutes, f"{100 * np.mean(refused):.0f} %", *told)


def main(folders: Sequence[str]) -> None:
    audits = [read_run(Path(folder)) for folder in folders]
    groups = [list(audits[k : k + LOGS]) for k in range(0, len(audits) - LOGS + 1, LOGS)]
    contaminated(groups)
    drifting(groups)
    regimes(groups)
    short(audits[:12])


if __name__ == "__main__":
    main(sys.argv[1:])
