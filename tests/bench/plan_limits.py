"""Thousands of plans against every limit, by an independent sampler at 1 kHz: plan_limits.py --data DIR --plans 10000.

Arms in turn, with random starts, limits, speed scales, tables and joints left out; plans of 10 to 30 s, every other one
from the fit of an earlier log. Every plan is a line of ``--state``: a campaign goes on where it was ended. A line names
the planner by a hash of its code, so that plans of a planner that was mended since are told apart.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path

import numpy as np

sys.path.append(str(Path(__file__).parents[1] / "helpers"))

import plan_sampler as sampler
from plan_arm import ARMS, arm_named, plan_table, short_run, write_run

import collaudit.core.plan
from collaudit.core import api
from collaudit.core.config import load_config
from collaudit.core.data.audit_result import FrictionFile, Provenance
from collaudit.core.errors import CollauditError
from collaudit.core.numeric.parallel import use_threads
from collaudit.core.plan.planning import CLEARANCE_M, PlanRequest, make_plan
from collaudit.fixtures.experiments import Experiment
from collaudit.fixtures.simulated_robot import FixtureRobot
from collaudit.fixtures.truth import config_text
from collaudit.reports.files.run_files import read_friction, write_friction
from collaudit.reports.formats.plan_files import csv_text

SECONDS = (10.0, 30.0)


@dataclass(frozen=True, slots=True, eq=False)
class Arm:
    """An arm, its configuration, and the fit of an earlier log."""

    robot: FixtureRobot
    settings: Path
    earlier: FrictionFile


def arm_of(name: str, data: Path, folder: Path) -> Arm:
    """Write an arm's description and configuration; simulate and fit an earlier log, unless its fit is there."""
    robot, known = arm_named(name, data), folder / f"{name}.json"
    folder.mkdir(parents=True, exist_ok=True)
    if not known.exists():
        log, settings = write_run(robot, short_run(robot), 1, folder / name / "earlier.mcap")
        write_friction(known, api.fit([(log,)], settings))
    description, path = robot.describe(lambda: 0.0), folder / f"{name}.toml"
    if description.urdf is not None:
        path.with_suffix(".urdf").write_text(description.urdf, encoding="utf-8")
    urdf = path.with_suffix(".urdf").name if description.urdf is not None else None
    still = Experiment(*np.zeros((3, 1, len(robot.joints))))
    path.write_text(config_text(robot, description, still, "mcap", urdf) + plan_table(robot), encoding="utf-8")
    return Arm(robot, path, read_friction(known))


def random_settings(arm: FixtureRobot, rng: np.random.Generator) -> tuple[dict[str, object], PlanRequest, float]:
    """Overrides of the configuration, the request, and the height of the table."""
    table = float(rng.uniform(-0.4, 0.0))
    start = {name: float(at + rng.uniform(-0.4, 0.4)) for name, at in zip(arm.joints, arm.home, strict=True)}
    accelerated = rng.random() < 0.5
    over: dict[str, object] = {
        "plan.table_z_m": table,
        "plan.start_rad": start,
    }
    if accelerated:
        over["plan.acceleration_rad_s2"] = {name: float(rng.uniform(0.5, 8.0)) for name in arm.joints}
    moved = tuple(name for k, name in enumerate(arm.joints) if k == 0 or rng.random() >= 0.15)
    scale = float(rng.choice([1.0, rng.uniform(0.1, 1.0)]))
    minutes = float(rng.uniform(*SECONDS)) / 60.0
    return over, PlanRequest(minutes, moved, scale, seed=int(rng.integers(1 << 30))), table


def violations(found: dict[str, float], minutes: float) -> list[str]:
    """Limits that a plan breaks."""
    wrong = [key for key in ("low", "high") if found[key] < 0.0]
    wrong += [key for key in ("speed", "acceleration", "jerk", "torque") if found[key] > 1.0]
    wrong += [key for key in ("apart", "above") if found[key] < CLEARANCE_M - 1e-9]
    return wrong + ["longer than asked"] * (found["duration"] > 60.0 * minutes)


def looked_at(arm: Arm, seed: int, number: int) -> dict[str, object]:
    """Make one plan and look at it; what to keep of it."""
    rng = np.random.default_rng([seed, number])
    over, request, table = random_settings(arm.robot, rng)
    earlier = arm.earlier if rng.random() < 0.5 else None
    row: dict[str, object] = {"seed": seed, "plan": number, "arm": arm.robot.name, "planner": planner_hash()}
    try:
        plan = make_plan(load_config(arm.settings, over), earlier, [], request, Provenance("0", {}))
    except CollauditError as error:
        return row | {"refused": error.message}
    found = sampler.limits_used(plan, csv_text(plan, plan.robot.joint_names), table, 1500, earlier)
    return row | {"wrong": violations(found, request.minutes), "used": found}


def planner_hash() -> str:
    """Of the planner's code."""
    files = sorted(Path(collaudit.core.plan.__file__).parent.glob("*.py"))
    return sha256(b"".join(file.read_bytes() for file in files)).hexdigest()[:12]


def campaign(arms: Sequence[Arm], seed: int, numbers: range, state: Path) -> Iterator[dict[str, object]]:
    """Rows of all plans, those made before too; each new one is written at once."""
    state.parent.mkdir(parents=True, exist_ok=True)
    known = [json.loads(line) for line in state.read_text().splitlines()] if state.exists() else []
    done = {row["plan"]: row for row in known if row["seed"] == seed and row["planner"] == planner_hash()}
    with state.open("a", encoding="utf-8") as file:
        for number in numbers:
            row = done.get(number) or looked_at(arms[number % len(arms)], seed, number)
            if number not in done:
                file.write(json.dumps(row) + "\n")
                file.flush()
            yield row


def main() -> None:
    """Plan and look; a line for every violation, then the counts."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--data", type=Path, required=True)
    parser.add_argument("--plans", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--arms", default=",".join(ARMS))
    parser.add_argument("--first", type=int, default=0, help="number of the first plan, to look at one again")
    parser.add_argument("--state", type=Path, default=Path("build/plan-limits.jsonl"))
    given = parser.parse_args()
    use_threads(1)
    counts, most = Counter[str](), Counter[str]()
    arms = [arm_of(name, given.data, given.state.parent / "plan-limits") for name in given.arms.split(",")]
    for row in campaign(arms, given.seed, range(given.first, given.first + given.plans), given.state):
        if "refused" in row:
            counts[f"refused: {row['refused']}"] += 1
            continue
        wrong, used = row["wrong"], row["used"]
        assert isinstance(wrong, list) and isinstance(used, dict)
        counts[f"planned: {row['arm']}"] += 1
        counts.update(f"VIOLATION: {one}" for one in wrong)
        if wrong:
            print(row, flush=True)
        for key in ("speed", "acceleration", "jerk", "torque"):
            most[key] = max(most[key], used[key])
    print(dict(counts))
    print("largest share of a limit:", {key: round(float(value), 4) for key, value in most.items()})


if __name__ == "__main__":
    main()
