"""Ever new damaged logs: ``fuzz_logs.py CASES [SEED] [--kinds KIND,…] [--state FILE]``, CASES of every kind.

Small logs are read, and judged as ``tests/logs/test_mutants.py`` judges them: the same data, a partial log that says
so, or one clear error, within limits of time and memory. Kinds that begin with ``audit-`` are logs with a push, and are
audited: the push is found, the log is refused or not judged, or the pass says what is wrong.

With ``--state`` each finished batch is noted in FILE; a run that was ended goes on there, with the seed of FILE,
and so may several one after the other with other ``--kinds``. Ends with 1 where a mutant became anything else; such
mutants are kept and named, and the other kinds go on.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections import Counter
from dataclasses import asdict, dataclass
from math import ceil
from pathlib import Path

LOGS = Path(__file__).parents[1] / "logs"
KINDS = (
    "mcap-zstd", "mcap-lz4", "mcap-none", "mcap-plain", "mcap-unchunked", "mcap-ros1", "mcap-big-endian",
    "bag-none", "bag-lz4", "bag-bz2", "db3", "csv", "csv-gz",
    "audit-mcap-none", "audit-mcap-unchunked", "audit-bag-none", "audit-db3", "audit-csv",
)  # fmt: skip
#: Mutants that one process judges, so that its memory tells of them.
BATCH = 500


@dataclass(frozen=True)
class Batch:
    """What became of the mutants of one process."""

    kind: str
    first_seed: int
    seed: int
    outcomes: dict[str, int]
    complaints: list[str]


def judged(kind: str, cases: int, first_seed: int, seed: int) -> Batch:
    """Judge one batch; its folder is kept where there is a complaint."""
    folder = Path(tempfile.mkdtemp(prefix="collaudit-fuzz-"))
    worker = LOGS / ("pushed_mutant_worker.py" if kind.startswith("audit-") else "mutant_worker.py")
    places = os.pathsep.join([str(LOGS.parent / "helpers"), os.environ.get("PYTHONPATH", "")]).rstrip(os.pathsep)
    helpers = {"PYTHONPATH": places}
    environment = {**os.environ, **helpers, "MALLOC_ARENA_MAX": "2", "OMP_NUM_THREADS": "1"}
    command = [sys.executable, str(worker), kind, str(cases), str(seed), str(folder)]
    done = subprocess.run(command, capture_output=True, text=True, env=environment, check=False)
    if done.returncode != 0:
        died = f"{kind} seed {seed}: the process died ({done.returncode}): {done.stderr[-2000:]}"
        return Batch(kind, first_seed, seed, {"died": 1}, [died, f"kept in {folder}"])
    result = json.loads(done.stdout.splitlines()[-1])
    if result["complaints"]:
        return Batch(kind, first_seed, seed, result["outcomes"], [*result["complaints"], f"kept in {folder}"])
    shutil.rmtree(folder)
    return Batch(kind, first_seed, seed, result["outcomes"], [])


def finished(state: Path | None) -> list[Batch]:
    """Batches of an earlier run; a line that was cut while it was written counts for nothing."""
    batches = []
    for line in state.read_text().splitlines() if state is not None and state.exists() else []:
        try:
            batches.append(Batch(**json.loads(line)))
        except ValueError:
            continue
    return batches


def fuzz(cases: int, seed: int, kinds: tuple[str, ...], state: Path | None) -> int:
    """Batches of all kinds in turn until each has had so many cases; the exit code."""
    batches = finished(state)
    first = batches[0].first_seed if batches else seed
    had = {(batch.kind, batch.seed) for batch in batches}
    size = min(cases, BATCH)
    for number in range(first, first + ceil(cases / size)):
        for kind in kinds:
            if (kind, number) in had:
                continue
            batch = judged(kind, size, first, number)
            batches.append(batch)
            print("\n".join(batch.complaints), end="\n" if batch.complaints else "", flush=True)
            if state is not None:
                with state.open("a") as file:
                    file.write(json.dumps(asdict(batch)) + "\n")
        print(f"seed {first}: {(number - first + 1) * size:,} cases a kind", file=sys.stderr)
    return summary(batches)


def summary(batches: list[Batch]) -> int:
    """Print what became of each kind's mutants; 1 where there was a complaint."""
    totals = {kind: Counter[str]() for kind in KINDS}
    for batch in batches:
        totals[batch.kind] += Counter(batch.outcomes)
    for name, outcomes in totals.items():
        if outcomes:
            print(f"{name:<22}" + "  ".join(f"{what} {many}" for what, many in sorted(outcomes.items())))
    complaints = [line for batch in batches for line in batch.complaints]
    print(f"{sum(sum(total.values()) for total in totals.values()):,} cases, {len(complaints)} complaints")
    return 1 if complaints else 0


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("cases", type=int, nargs="?", default=10_000)
    parser.add_argument("seed", type=int, nargs="?", default=int(time.time()))
    parser.add_argument("--kinds", default=",".join(KINDS))
    parser.add_argument("--state", type=Path)
    given = parser.parse_args()
    kinds = tuple(given.kinds.split(","))
    if unknown := set(kinds) - set(KINDS):
        parser.error(f"no such kind: {', '.join(sorted(unknown))}")
    return fuzz(given.cases, given.seed, kinds, given.state)


if __name__ == "__main__":
    sys.exit(main())
