"""Friction of simulated logs with their plateaus and without: do intervals hold the truth, and what becomes of γ?

    python tests/bench/no_plateaus.py CACHE [SEEDS] [SCENARIOS] [RUNS]

SCENARIOS are ``free-clean``, ``friction`` and ``stop-go``; CACHE keeps the simulated motions. Without plateaus the
effort of each joint is unknown in its sections of constant velocity. With RUNS the log is cut into so many runs of 2 to
6 s, which are fitted together. Compared with the truth is friction itself, at speeds of the motion: a law that is
simpler than the joint's own has no parameter in common with it.
"""

from __future__ import annotations

import sys
from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
from changed_logs import cut
from coverage_logs import logged, motion, streams

from collaudit.core import api
from collaudit.core.config import LoadedConfig, parse_config
from collaudit.core.data.audit_result import FrictionFile
from collaudit.core.data.joint_log import JointLog
from collaudit.core.friction.friction_model import FrictionModel, half_width
from collaudit.core.friction.joint_fits import sections_of
from collaudit.core.prepare.preparation import prepare
from collaudit.core.prepare.prepared import Prepared
from collaudit.fixtures.arms import robot_named
from collaudit.fixtures.simulation import plan

SECONDS, RUN_S = 90.0, (2.0, 6.0)
#: Where friction is compared: quantiles of the speeds at which it was measured.
AT = np.array([0.1, 0.3, 0.5, 0.7, 0.9])


def without_plateaus(log: Prepared, settings: LoadedConfig) -> Prepared:
    """The log with each joint's effort unknown where its speed is constant."""
    assert log.series.effort is not None
    effort = log.series.effort.copy(order="K")
    for section in sections_of([log], settings.config)[0].sections:
        around = slice(max(section.span.start - 10, 0), section.span.stop + 10)
        effort[around, log.series.column(section.joint)] = np.nan
    return replace(log, series=replace(log.series, effort=effort))


def runs_of(log: JointLog, count: int, rng: np.random.Generator) -> list[JointLog]:
    """So many runs of the log, of 2 to 6 s each, spread over it."""
    whole = float(log.time_s[-1])
    lasts = rng.uniform(*RUN_S, count)
    start = (np.arange(count) + rng.uniform(0.0, 0.2, count)) * whole / count
    return [cut(log, a / whole, (a + d) / whole) for a, d in zip(start, lasts, strict=True)]


def levels(file: FrictionFile) -> dict[str, tuple[float, float]]:
    """The motion's level of each joint that has one, of its shortest persistence, N·m; and without its margin.

    The margin is for how little motion was seen: without plateaus that is less, whatever friction is known from.
    """
    joints = {} if file.thresholds is None else file.thresholds.joints
    first = {joint: one.levels[0] for joint, one in joints.items() if one.levels}
    return {joint: (one.gamma_nm, (one.gamma_nm - one.zero_doubt_nm) / one.margin) for joint, one in first.items()}


def measure(
    arm_name: str,
    scenario: str,
    seed: int,
    runs: int,
    cache: Path,
    count: dict[str, Counter[str]],
    ratios: list[tuple[float, float]],
) -> None:
    """One log: what is fitted with its plateaus and without."""
    arm = robot_named(arm_name)
    model = arm.model()
    rngs = streams(scenario, seed)
    kept = cache / f"{arm_name}-{scenario}-{seed if scenario != 'friction' else 0}.npz"
    trace = motion(plan(scenario, arm, model, rngs[0], None if scenario == "friction" else SECONDS), arm, model, kept)
    log = logged(trace, arm, model, rngs[2])
    settings = parse_config("", None)
    logs = runs_of(log, runs, rngs[3]) if runs else [log]
    whole = [prepare(one, model, settings.config) for one in logs]
    bare = [without_plateaus(one, settings) for one in whole]
    files = {"with": api.fit(whole, settings), "without": api.fit(bare, settings)}
    for kind, file in files.items():
        for joint, dynamics in zip(arm.joints, arm.friction, strict=True):
            fit = file.joints[joint]
            law = FrictionModel.of(fit)
            its = count.setdefault(f"{arm_name} {scenario} {kind}", Counter())
            its.update({"joints": 1, f"law {fit.model}": 1, f"from {fit.motion}": law is not None})
            if law is None:
                print(arm_name, scenario, seed, kind, joint, fit.reason, fit.rejected, flush=True)
                continue
            speeds = np.quantile([point.speed_rad_s for point in fit.points], AT)
            off = law.torque(speeds) - dynamics.steady(speeds)
            half = half_width(law, speeds)
            inside = np.abs(off) <= half
            its.update({"asked": speeds.size, "held": int(inside.sum())})
            its["widths 0.1%"] += int(1000 * np.mean(half / dynamics.steady(speeds)))
            its["errors 0.1%"] += int(1000 * np.mean(np.abs(off) / dynamics.steady(speeds)))
    first, second = levels(files["with"]), levels(files["without"])
    for joint in arm.joints:
        if joint in first and joint in second:
            ratios.append((second[joint][0] / first[joint][0], second[joint][1] / first[joint][1]))
        elif joint in first:
            count[f"{arm_name} {scenario} without"]["no level"] += 1


def main(cache: Path, seeds: int, scenarios: list[str], runs: int) -> None:
    """Print what was counted."""
    cache.mkdir(parents=True, exist_ok=True)
    count: dict[str, Counter[str]] = {}
    for scenario in scenarios:
        for arm in ("paper6", "seven"):
            ratios: list[tuple[float, float]] = []
            for seed in range(1, seeds + 1):
                measure(arm, scenario, seed, runs, cache, count, ratios)
            for kind in ("with", "without"):
                its = count[f"{arm} {scenario} {kind}"]
                print(
                    arm, scenario, kind, f"{100 * its['held'] / max(its['asked'], 1):.1f} % held", dict(its), flush=True
                )
            at = np.quantile(ratios, [0.5, 0.9, 1.0], axis=0).T if ratios else []
            print(arm, scenario, "γ without / with, median, 90 %, most; less its margin:", np.round(at, 3), flush=True)


if __name__ == "__main__":
    given = sys.argv[1:]
    main(
        Path(given[0]),
        int(given[1]) if len(given) > 1 else 3,
        given[2].split(",") if len(given) > 2 else ["free-clean", "friction", "stop-go"],
        int(given[3]) if len(given) > 3 else 0,
    )
