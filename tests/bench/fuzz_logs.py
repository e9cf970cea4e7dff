"""Ever new damaged logs, so many of every format: ``python tests/bench/fuzz_logs.py CASES [SEED]``.

The judge is the one of ``tests/logs/test_mutants.py``: the same data, a partial log that says so, or one clear
error, within limits of time and memory. Ends with 1 at the first mutant that is not; the mutant is kept and named.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections import Counter
from math import ceil
from pathlib import Path

WORKER = Path(__file__).parents[1] / "logs" / "mutant_worker.py"
KINDS = (
    "mcap-zstd", "mcap-lz4", "mcap-none", "mcap-plain", "mcap-unchunked", "mcap-ros1", "mcap-big-endian",
    "bag-none", "bag-lz4", "bag-bz2", "db3", "csv", "csv-gz",
)  # fmt: skip
#: Mutants a process judges before the next kind has its turn.
ROUND = 200


def judged(kind: str, cases: int, seed: int, folder: Path) -> tuple[Counter[str], list[str]]:
    """Outcomes and complaints of one round."""
    helpers = {"PYTHONPATH": str(WORKER.parents[1] / "helpers")}
    environment = {**os.environ, **helpers, "MALLOC_ARENA_MAX": "2", "OMP_NUM_THREADS": "1"}
    command = [sys.executable, str(WORKER), kind, str(cases), str(seed), str(folder)]
    done = subprocess.run(command, capture_output=True, text=True, env=environment, check=False)
    if done.returncode != 0:
        return Counter(died=1), [f"{kind} seed {seed}: the process died ({done.returncode}): {done.stderr[-2000:]}"]
    result = json.loads(done.stdout.splitlines()[-1])
    return Counter(result["outcomes"]), result["complaints"]


def fuzz(cases: int, first_seed: int) -> int:
    """Rounds over all kinds until each has had so many cases; the exit code."""
    totals = {kind: Counter[str]() for kind in KINDS}
    for seed in range(first_seed, first_seed + ceil(cases / ROUND)):
        for kind in KINDS:
            folder = Path(tempfile.mkdtemp(prefix="collaudit-fuzz-"))
            outcomes, complaints = judged(kind, min(cases, ROUND), seed, folder)
            totals[kind] += outcomes
            if complaints:
                print("\n".join(complaints), f"\nkept in {folder}")
                return 1
            shutil.rmtree(folder)
        print(
            f"seeds {first_seed} to {seed}: {(seed - first_seed + 1) * min(cases, ROUND):,} cases a format",
            file=sys.stderr,
        )
    for name, outcomes in totals.items():
        print(f"{name:<16}" + "  ".join(f"{what} {many}" for what, many in sorted(outcomes.items())))
    return 0


if __name__ == "__main__":
    seed = int(sys.argv[2]) if len(sys.argv) > 2 else int(time.time())
    sys.exit(fuzz(int(sys.argv[1]) if len(sys.argv) > 1 else 10_000, seed))
