"""Miss rates of simulated pushes beside those of the same pushes injected into other, clean logs.

``python tests/bench/injection_table.py FOLDER [SEED…]`` simulates what the folder lacks (a minute of processor time a
seed), and prints the tables of docs/rule-study.md. Run it from the folder of the tests' helpers on the path:
``PYTHONPATH=tests/helpers``.
"""

from __future__ import annotations

import sys
from itertools import pairwise
from pathlib import Path

import numpy as np
from injection_truth import Outcome, difference_sd, injected_outcomes, log_paths, simulated_outcomes, wilson
from push_campaign import KINDS, free_log, kind_of, random_pushes

from collaudit.core.data.audit_result import FrictionFile
from collaudit.fixtures.compare import fit_simulated
from collaudit.fixtures.simulation import simulate_to
from collaudit.reports import read_friction
from collaudit.reports.files.run_files import write_friction

ROBOT, SECONDS = "paper6", 200.0
SCENARIOS = ("free-clean", "stop-go")


def friction_of(folder: Path) -> FrictionFile:
    """Friction of the arm, from one identification run."""
    path = folder / "friction.json"
    if not path.exists():
        write_friction(path, fit_simulated(simulate_to("friction", ROBOT, 5, "csv", folder / "fr.csv")))
    return read_friction(path)


def outcomes(folder: Path, scenario: str, seed: int, friction: FrictionFile) -> tuple[list[Outcome], list[Outcome]]:
    """Simulated and injected pushes of one seed."""
    pushes = random_pushes(ROBOT, SECONDS, seed)
    names = f"{scenario}-hit{seed}", f"{scenario}-clean{seed}"
    for name, given, shift in zip(names, (pushes, ()), (0, 500), strict=True):
        if not (folder / f"{name}.truth.json").exists():
            free_log(ROBOT, seed + shift, SECONDS, given, folder / f"{name}.csv", scenario)
    hit, clean = (log_paths(folder, name) for name in names)
    return simulated_outcomes(hit, pushes, friction, {}), injected_outcomes(clean, ROBOT, pushes, friction, {})


def rows(simulated: list[Outcome], injected: list[Outcome]) -> list[str]:
    """Table rows: each kind in three bands of force, and over all."""
    out = []
    for kind, (_, _, low, high) in KINDS.items():
        edges = np.geomspace(low, high, 4)
        bands = [*pairwise(edges), (low, high)]
        for a, b in bands:
            both = [
                np.array([not o.noticed for o in found if kind_of(o.push) == kind and a <= o.push.force_n <= b])
                for found in (simulated, injected)
            ]
            if min(x.size for x in both) < 5:
                continue
            cells = [
                f"{x.mean():.2f} ({low95:.2f}–{high95:.2f})"
                for x in both
                for low95, high95 in [wilson(int(x.sum()), x.size)]
            ]
            out.append(
                f"| {kind} | {a:.0f}–{b:.0f} | {both[0].size} | {cells[0]} | {cells[1]} | {difference_sd(*both):.1f} |"
            )
    return out


def main(folder: Path, seeds: list[int]) -> None:
    """Print one table a scenario."""
    folder.mkdir(parents=True, exist_ok=True)
    friction = friction_of(folder)
    for scenario in SCENARIOS:
        pairs = [outcomes(folder, scenario, seed, friction) for seed in seeds]
        simulated, injected = ([o for pair in pairs for o in pair[k]] for k in (0, 1))
        print(f"\n{scenario}, seeds {', '.join(map(str, seeds))}\n")
        print("| contact | force, N | number | missed, simulated (95 %) | missed, injected (95 %) | difference, SE |")
        print("|---|---|---|---|---|---|")
        print("\n".join(rows(simulated, injected)), flush=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]), [int(x) for x in sys.argv[2:]] or [401, 402, 403])
