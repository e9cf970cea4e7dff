"""Damaged and hostile files: each gives the same data, a partial log that says so, or one clear error.

At least 250 mutants of every format are read, in a process whose memory is limited and each within a time
limit (see ``mutant_worker.py``). ``COLLAUDIT_MUTANTS`` asks for so many of each kind, ``COLLAUDIT_MUTANT_SEED``
for others.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

WORKER = Path(__file__).with_name("mutant_worker.py")
#: Mutants of each kind, 250 or more for each format; ``make fuzz`` reads ever new ones. One process reads a format's.
COUNTS = {
    "mcap": {"mcap-zstd": 75, "mcap-lz4": 40, "mcap-none": 50, "mcap-plain": 40, "mcap-unchunked": 40,
             "mcap-ros1": 25},
    "bag": {"bag-none": 125, "bag-lz4": 75, "bag-bz2": 50},
    "db3": {"db3": 250},
    "csv": {"csv": 200, "csv-gz": 50},
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("form", COUNTS)
def test_mutants(form: str, tmp_path: Path) -> None:
    counts = {kind: int(os.environ.get("COLLAUDIT_MUTANTS") or count) for kind, count in COUNTS[form].items()}
    seed = os.environ.get("COLLAUDIT_MUTANT_SEED", "1")
    # Before what the caller names: in a tree of its own the worker is to read with that tree's readers.
    places = os.pathsep.join([str(WORKER.parents[1] / "helpers"), os.environ.get("PYTHONPATH", "")]).rstrip(os.pathsep)
    environment = {**os.environ, "PYTHONPATH": places, "MALLOC_ARENA_MAX": "2", "OMP_NUM_THREADS": "1"}
    done = subprocess.run(
        [sys.executable, str(WORKER), ",".join(counts), ",".join(map(str, counts.values())), seed, str(tmp_path)],
        capture_output=True,
        text=True,
        timeout=max(300.0, sum(counts.values()) * 0.5),
        env=environment,
        check=False,
    )
    assert done.returncode == 0, done.stderr[-3000:]
    for (kind, count), line in zip(counts.items(), done.stdout.splitlines(), strict=True):
        result = json.loads(line)
        print(kind, result["outcomes"])
        assert not result["complaints"], "\n".join(result["complaints"])
        assert sum(result["outcomes"].values()) == count
        assert result["outcomes"].get("refused", 0) < count


@pytest.mark.parametrize(
    ("endless", "limit"),
    [(lambda: None, "0.05 s of the processor"), (lambda: time.sleep(1), "0.6 s by the clock")],
    ids=["working", "waiting"],
)
def test_a_mutant_that_goes_on_for_ever_is_noticed(endless: Callable[[], None], limit: str, monkeypatch) -> None:
    monkeypatch.syspath_prepend(WORKER.parent)
    from mutant_worker import Overtime, at_most

    end = time.monotonic() + 20
    with pytest.raises(Overtime, match=limit), at_most(0.05):
        while time.monotonic() < end:
            endless()
    with at_most(0.05):
        pass
    end = time.process_time() + 0.1
    while time.process_time() < end:  # a timer that was left on would go off here
        pass
