"""Nights in which a hard push is hidden outside of a judged log: a class of docs/evidence.md (``make spoilt``).

    python tests/bench/spoilt_nights.py [--seed N] [-o docs/evidence.md]

On both simulated arms a night of one clean log and one with a push of the asked force is audited by the command. The
push is in efforts that stand beside or in place of commanded ones, in a file that is no log by its name, or in a log
that was audited the night before.
"""

from __future__ import annotations

import argparse
import csv
import shutil
import sys
import zipfile
from collections import Counter, defaultdict
from collections.abc import Callable, Iterator
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
from pathlib import Path
from tempfile import TemporaryDirectory

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "helpers"))

from push_campaign import free_log
from simulated_arm import ARMS
from tables import put

from collaudit.cli.main import run
from collaudit.fixtures.arms import robot_named
from collaudit.fixtures.pushes import Push

SECONDS = 30.0
#: Ends of names that recorders, loggers and archives leave.
ENDS = (".1", ".active", ".part", ".zip", ".bak", ".txt")
#: Names of columns of efforts that no sensor measured.
COMMANDED = ("tau_desired", "tau_J_d", "tau_target", "tau_command", "tau_ipo")
OUTCOMES = {0: "passed", 1: "found", 3: "not judged"}


def said(*command: object) -> int:
    """Exit code of one command, which prints nothing."""
    with redirect_stdout(StringIO()), redirect_stderr(StringIO()):
        return run([str(part) for part in command])


class Night:
    """One arm's clean and pushed log, and what ``fit`` makes of another clean one."""

    def __init__(self, robot: str, seed: int, folder: Path) -> None:
        self.folder = folder
        arm = robot_named(robot)
        push = Push(len(arm.links), 130.0, "around", SECONDS / 2, 0.25, 0.03)
        self.clean = free_log(robot, seed + 1, SECONDS, (), folder / "clean.csv").log[0]
        self.pushed = free_log(robot, seed + 2, SECONDS, (push,), folder / "pushed.csv").log[0]
        fitted = free_log(robot, seed, 2 * SECONDS, (), folder / "fitted.csv")
        self.config, self.friction = fitted.config, folder / "friction.json"
        assert said("fit", fitted.log[0], "-c", self.config, "-o", self.friction) == 0

    def audited(self, name: str, fill: Callable[[Path], None], *options: object) -> str:
        """The outcome of a night whose folder ``fill`` fills."""
        logs = self.folder / name
        logs.mkdir()
        shutil.copy(self.clean, logs / "one.csv")
        fill(logs)
        out = self.folder / f"{name}-out"
        code = said("audit", logs, "-c", self.config, "--friction", self.friction, "-o", out, *options)
        return OUTCOMES.get(code, f"exit {code}")

    def left_out(self) -> Iterator[str]:
        """The pushed log under a name that is no log's."""
        for end in ENDS:

            def fill(logs: Path, end: str = end) -> None:
                if end == ".zip":
                    with zipfile.ZipFile(logs / "two.zip", "w") as archive:
                        archive.write(self.pushed, "two.csv")
                else:
                    shutil.copy(self.pushed, logs / f"two.csv{end}")

            yield self.audited(f"left-out{end}", fill)

    def commanded(self) -> Iterator[str]:
        """Efforts of the clean log under a commanded name, beside the measured ones of the pushed log or alone."""
        for name in COMMANDED:
            for alone in (False, True):

                def fill(logs: Path, name: str = name, alone: bool = alone) -> None:
                    _with_commanded(self.clean, self.pushed, logs / "two.csv", name, alone)

                yield self.audited(f"{name}-{alone}", fill)

    def second_night(self) -> Iterator[str]:
        """The pushed log audited twice with one store."""
        store = ("--store", self.folder / "store", "--robot", "cell")
        for night in ("2026-01-01", "2026-01-02"):
            yield self.audited(
                f"night-{night}", lambda logs: shutil.copy(self.pushed, logs / "two.csv"), *store, "--night", night
            )


def _with_commanded(clean: Path, pushed: Path, out: Path, name: str, alone: bool) -> None:
    """The pushed table with the clean one's efforts as commanded columns; ``alone``: without measured ones."""
    with clean.open(encoding="utf-8") as one, pushed.open(encoding="utf-8") as other:
        delimiter = ";" if ";" in other.readline() else ","
        other.seek(0)
        (head, *rows), (_, *calm) = (list(csv.reader(file, delimiter=delimiter)) for file in (other, one))
    efforts = [k for k, column in enumerate(head) if column.startswith("tau")]
    kept = [k for k in range(len(head)) if not (alone and k in efforts)]
    with out.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, delimiter=delimiter)
        writer.writerow([head[k] for k in kept] + [head[k].replace("tau", name, 1) for k in efforts])
        writer.writerows(
            [row[k] for k in kept] + [still[k] for k in efforts] for row, still in zip(rows, calm, strict=False)
        )


def main(arguments: list[str]) -> None:
    """As the module's first lines say."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, default=9300)
    parser.add_argument("-o", "--output", type=Path, help="page whose table is replaced")
    given = parser.parse_args(arguments)
    found: dict[str, Counter[str]] = defaultdict(Counter)
    for robot in ARMS:
        with TemporaryDirectory() as folder:
            night = Night(robot, given.seed, Path(folder))
            for kind, outcomes in (
                ("left-out files", night.left_out()),
                ("commanded efforts", night.commanded()),
                ("second night", night.second_night()),
            ):
                found[kind].update(outcomes)
    head = sorted({name for counts in found.values() for name in counts} | {"found", "not judged", "passed"})
    lines = [f"| class | tried | {' | '.join(head)} |", "|---" * (len(head) + 2) + "|"]
    for kind, counts in found.items():
        lines.append(f"| {kind} | {counts.total()} | {' | '.join(str(counts[name]) for name in head)} |")
    print("\n".join(lines))
    if given.output:
        put(given.output, "spoilt-nights", lines)


if __name__ == "__main__":
    main(sys.argv[1:])
