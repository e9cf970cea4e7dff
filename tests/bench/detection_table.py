"""Writes the tables of docs/evidence.md from simulated logs: ``python detection_table.py LOGS [DOCS [NAME...]]``.

LOGS is a folder for the simulated logs (made when they are not there; ten hours of arm time, about an hour on one
core). DOCS is the page whose tables, between ``<!-- name -->`` and ``<!-- /name -->``, are replaced ("-" for none);
NAMEs choose some of them.
"""

from __future__ import annotations

import sys
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from detection_runs import FACTOR, Total, add_up, bench, friction_of, off_calibration, simulated
from tables import put

from collaudit.core.data.detection_result import Score
from collaudit.core.residual.detector import DETECTORS
from collaudit.fixtures.arms import robot_named

#: Seeds that nothing was tuned on.
SEEDS = range(7101, 7111)
#: (robot, scenario, seed, seconds): an hour each of fast motion and of stop-and-go, on stiff and soft joints.
HOURS = [
    (robot, scenario, seed, seconds)
    for robot, parts in (
        ("paper6", ((1, 600.0), (2, 1000.0), (3, 1000.0), (4, 1000.0))),
        ("paper6-soft", ((1, 300.0), (2, 1100.0), (3, 1100.0), (4, 1100.0))),
        ("seven", ((1, 300.0), (2, 1000.0), (3, 1000.0), (4, 1300.0))),
    )
    for scenario in ("free-clean", "stop-go")
    for seed, seconds in parts
]
OFF = {"as calibrated": 0.0, "15 % below": -0.15, "10 % above": 0.10}
RUNS = (("offline", False), ("causal", True))


def pushes(logs: Path) -> Iterator[str]:
    """Recall, precision, delay of every detector: free-hits on all joints, polishing on the watched ones."""
    yield (
        "| scenario | detector | mode | all above γ: found | above 1.3 γ: found | of these hidden | "
        "time judged by value (at all) | false | delay ms: median (5–95 %) | AUC |"
    )
    yield "|---|---|---|---|---|---|---|---|---|---|"
    for title, robot, scenario in (
        ("free-hits, paper6", "paper6", "free-hits"),
        ("free-hits, seven", "seven", "free-hits"),
        ("run A, paper6", "paper6", "polish-const"),
        ("run B, paper6", "paper6", "polish-sine"),
        ("run A, seven", "seven", "polish-const"),
        ("run B, seven", "seven", "polish-sine"),
    ):
        friction = friction_of(logs, robot)
        watch = None if scenario == "free-hits" else [robot_named(robot).joints[0]]
        scores: dict[tuple[str, str], list[tuple[Score, Score, tuple[float, float]]]] = defaultdict(list)
        for seed in SEEDS:
            made = bench(simulated(logs, robot, scenario, seed), friction, watch)
            for name in [detector.name for detector in DETECTORS]:
                for mode, causal in RUNS:
                    found = made.judged(name, causal)
                    (every, _), (clear, share) = (made.score(found, watch, factor) for factor in (1.0, FACTOR))
                    scores[name, mode].append((every, clear, share))
        for (name, mode), its in scores.items():
            every, clear = (add_up([one[k] for one in its]) for k in (0, 1))
            yield _row(title, name, mode, every, clear, np.mean([one[2] for one in its], axis=0))


def _row(title: str, name: str, mode: str, every: Total, clear: Total, judged: np.ndarray) -> str:
    delay = "–"
    if clear.delay_ms:
        low, middle, high = np.percentile(clear.delay_ms, [5, 50, 95])
        delay = f"{middle:.0f} ({low:.0f}–{high:.0f})"
    return (
        f"| {title} | {name} | {mode} | {_found(every)} | {_found(clear)} | {clear.not_observable} | "
        f"{100 * judged[0]:.0f} % ({100 * judged[1]:.0f} %) | {every.false_alarms} | {delay} | {clear.auc:.4f} |"
    )


def _found(total: Total) -> str:
    """Of all pushes, those that were hidden included."""
    return f"{100 * total.found / max(1, total.events):.1f} % ({total.found}/{total.events})"


def hours(logs: Path, causal: bool = False) -> Iterator[str]:
    """False alarms in clean motion, by detector and by how friction is off its calibration."""
    names = [detector.name for detector in DETECTORS]
    yield "| motion | friction | hours | " + " | ".join(names) + " |"
    yield "|---|---|---|" + "---|" * len(names)
    for robot, scenario in dict.fromkeys((r, s) for r, s, _, _ in HOURS):
        false: dict[tuple[str, str], int] = defaultdict(int)
        total_h = 0.0
        for its_robot, its_scenario, seed, seconds in HOURS:
            if (its_robot, its_scenario) != (robot, scenario):
                continue
            log = simulated(logs, robot, scenario, seed, seconds)
            made = bench(log, friction_of(logs, robot))
            total_h += float(made.prepared.series.time_s[-1]) / 3600.0
            for state, share in OFF.items():
                other = made.with_friction(off_calibration(friction_of(logs, robot), share))
                for name in names:
                    false[state, name] += len(other.judged(name, causal).detected.collisions)
        for state in OFF:
            cells = " | ".join(str(false[state, name]) for name in names)
            yield f"| {scenario}, {robot.replace('-', ', ')} | {state} | {total_h:.2f} | {cells} |"


def main(arguments: list[str]) -> None:
    logs = Path(arguments[0])
    tables = {"pushes": pushes, "hours": hours, "causal-hours": lambda folder: hours(folder, True)}
    for name, table in tables.items():
        if arguments[2:] and name not in arguments[2:]:
            continue
        lines = []
        for line in table(logs):
            print(line, flush=True)
            lines.append(line)
        if len(arguments) > 1 and arguments[1] != "-":
            put(Path(arguments[1]), f"detection-{name}", lines)


if __name__ == "__main__":
    main(sys.argv[1:])
