"""How often 95 % intervals of drive gains hold the truth: ``python gain_coverage.py CACHE [SEEDS] [DOCS]``.

CACHE is a folder for the simulated motions, one minute of fast motion a seed; SEEDS (100) is their number for each arm,
from 101 on, since the method was chosen on the seeds before. DOCS is the page whose table between
``<!-- coverage-gain -->`` marks is replaced.
"""

from __future__ import annotations

import sys
from collections import defaultdict
from collections.abc import Iterator
from multiprocessing import Pool
from pathlib import Path

import numpy as np
from coverage_logs import logged, motion, streams
from tables import put

from collaudit.core.config.schema import Config
from collaudit.core.identification.identification import identify
from collaudit.core.prepare.prepared import prepare
from collaudit.fixtures.robots.robot_registry import robot_named
from collaudit.fixtures.robots.simulated_robot import FixtureRobot
from collaudit.fixtures.simulation import plan

SCENARIO, SECONDS, FIRST, WORKERS = "free-clean", 60.0, 101, 2
Row = tuple[str, bool, float, float]


def true_gain(arm: FixtureRobot) -> np.ndarray:
    """(j,) effort as logged per N·m."""
    constant = np.array(arm.log.torque_constant_nm_per_a or [1.0] * len(arm.joints))
    return np.array(arm.log.effort_sign, dtype=float) / constant


def of_seed(job: tuple[str, int, Path]) -> list[Row]:
    """Joint, whether its interval held the truth, error and half width as shares of the true gain."""
    robot, seed, cache = job
    arm = robot_named(robot)
    model = arm.model()
    config = Config.of({"fit": {"estimate": ["gain"], "blocks": 2}, "log": {"units": {"effort": "raw"}}})
    rngs = streams(SCENARIO, seed)
    trace = motion(plan(SCENARIO, arm, model, rngs[0], SECONDS), arm, model, cache / f"{robot}-free60-{seed}.npz")
    identified = identify([prepare(logged(trace, arm, model, rngs[2], raw=True), model, config)], config)
    assert identified is not None
    rows = []
    for joint, true in zip(arm.joints, true_gain(arm), strict=True):
        facts = identified.joints[joint]
        if facts.gain is not None and facts.gain_ci95 is not None:
            low, high = sorted((x or 0.0) / true for x in facts.gain_ci95)
            rows.append((joint, low <= 1.0 <= high, facts.gain / true - 1.0, 0.5 * (high - low)))
    return rows


def table(cache: Path, seeds: int) -> Iterator[str]:
    """Coverage, bias, error and half width of each joint's gain, relative to the true one."""
    yield "| arm, joint | gain shown | held the truth | bias | RMS error | half width |"
    yield "|---|---|---|---|---|---|"
    everyone: list[float] = []
    for robot in ("paper6", "seven"):
        found: dict[str, list[Row]] = defaultdict(list)
        with Pool(WORKERS) as pool:
            for rows in pool.imap(of_seed, [(robot, seed, cache) for seed in range(FIRST, FIRST + seeds)]):
                for row in rows:
                    found[row[0]].append(row)
        for joint, its in found.items():
            held, error, half = (np.array([row[k] for row in its], dtype=float) for k in (1, 2, 3))
            everyone += list(held)
            yield (
                f"| {robot}, {joint} | {len(its)} of {seeds} | {100 * held.mean():.0f} % | {100 * error.mean():+.2f} % "
                f"| {100 * np.sqrt(np.mean(error**2)):.2f} % | {100 * half.mean():.2f} % |"
            )
    yield f"| all | {len(everyone)} | {100 * np.mean(everyone):.1f} % | | | |"


def main(cache: Path, seeds: int, docs: Path | None) -> None:
    """Print the table; put it into the page when one is given."""
    cache.mkdir(parents=True, exist_ok=True)
    lines = list(table(cache, seeds))
    print("\n".join(lines))
    if docs is not None:
        put(docs, "coverage-gain", lines)


if __name__ == "__main__":
    main(
        Path(sys.argv[1]),
        int(sys.argv[2]) if len(sys.argv) > 2 else 100,
        Path(sys.argv[3]) if len(sys.argv) > 3 else None,
    )
