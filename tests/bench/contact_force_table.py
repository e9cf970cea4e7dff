"""Where a push was and how hard: links named as possible, and intervals of the force, against simulated pushes.

    python tests/bench/contact_force_table.py [--logs 5]

Graded pushes on every link of both simulated arms in fast motion, each beside its link's line; a row an arm.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "helpers"))

import numpy as np

from collaudit.core.data.detection_result import Contact
from collaudit.fixtures.compare import audit_simulated, fit_simulated, read_truth
from collaudit.fixtures.simulation import simulate_to

ROBOTS = ("paper6", "seven")
HEAD = (
    "| arm | pushes found | true link among the possible | links on average | whole interval holds "
    "| two-sided on the true link | lower bound on it |",
    "|---|---|---|---|---|---|---|",
)


@dataclass(frozen=True, slots=True)
class Found:
    """A push and the contact that it made."""

    frame: str
    size_n: float
    contact: Contact


def found(robot: str, logs: int, folder: Path) -> Iterator[Found]:
    """Pushes that made one contact each."""
    fit = fit_simulated(simulate_to("friction", robot, 1, "csv", folder / f"{robot}-f", speeds=14))
    for seed in range(11, 11 + logs):
        files = simulate_to("free-hits", robot, seed, "csv", folder / f"{robot}-{seed}")
        contacts = audit_simulated(files, fit).result.contacts
        truth = read_truth(files.truth)
        for push in [*truth["collisions"], *truth["near_misses"], *truth["below_threshold"]]:
            end = push["onset_s"] + push["duration_s"]
            its = [contact for contact in contacts if contact.onset_s < end and contact.end_s > push["onset_s"]]
            if len(its) == 1:
                yield Found(push["frame"], float(np.linalg.norm(push["force_n"])), its[0])


def row(robot: str, pushes: list[Found]) -> str:
    """Shares as counts, so that another run can be laid beside it."""
    forces = [(one, one.contact.force) for one in pushes if one.contact.force is not None]
    own = [(one, link) for one, force in forces for link in force.links if link.frame == one.frame]
    whole = sum(f.size_ci95_n[0] <= one.size_n <= (f.size_ci95_n[1] or np.inf) for one, f in forces)
    both = [link.low_n <= one.size_n <= link.high_n for one, link in own if link.high_n is not None]
    least = [link.low_n <= one.size_n for one, link in own if link.high_n is None]
    size = np.mean([len(force.links) for _, force in forces])
    return (
        f"| {robot} | {len(pushes)} | {len(own)} | {size:.1f} | {whole} of {len(forces)} | {sum(both)} of {len(both)} "
        f"| {sum(least)} of {len(least)} |"
    )


def main(arguments: list[str]) -> None:
    """As the module's first lines say."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--logs", type=int, default=5, help="of an arm")
    given = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory() as folder:
        lines = [*HEAD, *(row(robot, list(found(robot, given.logs, Path(folder)))) for robot in ROBOTS)]
    print("\n".join(lines))


if __name__ == "__main__":
    main(sys.argv[1:])
