"""Thousands of plans against every limit, by an independent sampler at 1 kHz: plan_limits.py --data DIR --plans 10000.

Arms in turn, with random starts, limits, speed scales, tables and joints left out; plans of half a minute.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections import Counter
from pathlib import Path

import numpy as np

sys.path.append(str(Path(__file__).parents[1] / "helpers"))

import plan_sampler as sampler
from plan_arm import ARMS, arm_named, plan_table

from collaudit.core.config import load_config
from collaudit.core.data.audit_result import Provenance
from collaudit.core.errors import CollauditError
from collaudit.core.plan.planning import PlanRequest, make_plan
from collaudit.fixtures.config import config_text
from collaudit.fixtures.experiments import Experiment
from collaudit.fixtures.robots.simulated_robot import FixtureRobot
from collaudit.reports.exports.plan_files import csv_text

MINUTES = 0.5


def random_settings(arm: FixtureRobot, rng: np.random.Generator) -> tuple[dict[str, object], PlanRequest, float]:
    """Overrides of the configuration, the request, and the height of the table."""
    table = float(rng.uniform(-0.4, 0.0))
    start = {name: float(at + rng.uniform(-0.4, 0.4)) for name, at in zip(arm.joints, arm.home, strict=True)}
    accelerated = rng.random() < 0.5
    over: dict[str, object] = {
        "plan.table_z_m": table,
        "plan.start_rad": start,
        "plan.clearance_m": rng.uniform(0.01, 0.05),
    }
    if accelerated:
        over["plan.acceleration_rad_s2"] = {name: float(rng.uniform(0.5, 8.0)) for name in arm.joints}
        over["plan.jerk_rad_s3"] = {name: float(rng.uniform(5.0, 200.0)) for name in arm.joints}
    left_out = tuple(name for name in arm.joints[1:] if rng.random() < 0.15)
    scale = float(rng.choice([1.0, rng.uniform(0.1, 1.0)]))
    return over, PlanRequest(MINUTES, None, left_out, scale, seed=int(rng.integers(1 << 30))), table


def violations(found: dict[str, float], clearance_m: float) -> list[str]:
    """Limits that a plan breaks."""
    wrong = [key for key in ("low", "high") if found[key] < 0.0]
    wrong += [key for key in ("speed", "acceleration", "jerk", "torque") if found[key] > 1.0]
    wrong += [key for key in ("apart", "above") if found[key] < clearance_m - 1e-9]
    return wrong + ["longer than asked"] * (found["duration"] > 60.0 * MINUTES)


def main() -> None:
    """Plan and look; a line for every violation, then the counts."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--data", type=Path, required=True)
    parser.add_argument("--plans", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--first", type=int, default=0, help="number of the first plan, to look at one again")
    given = parser.parse_args()
    counts, most = Counter[str](), Counter[str]()
    arms = [arm_named(name, given.data) for name in ARMS]
    with tempfile.TemporaryDirectory() as folder:
        for k in range(given.first, given.first + given.plans):
            rng, arm = np.random.default_rng([given.seed, k]), arms[k % len(arms)]
            description, path = arm.describe(lambda: 0.0), Path(folder) / f"{arm.name}.toml"
            if description.urdf is not None:
                path.with_suffix(".urdf").write_text(description.urdf, encoding="utf-8")
            urdf = path.with_suffix(".urdf").name if description.urdf is not None else None
            still = Experiment(*np.zeros((3, 1, len(arm.joints))))
            path.write_text(config_text(arm, description, still, "mcap", urdf) + plan_table(arm), encoding="utf-8")
            over, request, table = random_settings(arm, rng)
            try:
                plan = make_plan(load_config(path, over), None, [], request, Provenance("0", {}))
            except CollauditError as error:
                counts["refused: " + error.message] += 1
                continue
            found = sampler.limits_used(plan, csv_text(plan, plan.robot.joint_names), table, 1500)
            clearance = over["plan.clearance_m"]
            assert isinstance(clearance, float)
            wrong = violations(found, clearance)
            counts["planned"] += 1
            counts.update(f"VIOLATION: {one}" for one in wrong)
            if wrong:
                print(k, arm.name, wrong, found, flush=True)
            for key in ("speed", "acceleration", "jerk", "torque"):
                most[key] = max(most[key], found[key])  # type: ignore[assignment]
    print(dict(counts))
    print("largest share of a limit:", {key: round(float(value), 4) for key, value in most.items()})


if __name__ == "__main__":
    main()
