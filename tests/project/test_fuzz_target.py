"""``make fuzz`` runs a few cases of a kind of each format, and goes on where it was ended."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

FUZZ = Path(__file__).parents[1] / "bench" / "fuzz_logs.py"
KINDS = "mcap-zstd,bag-lz4,db3,csv,audit-csv"


def _fuzz(*arguments: object) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, str(FUZZ), *map(str, arguments), "--kinds", KINDS]
    return subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)


def test_kinds_are_read_and_audited_and_a_run_goes_on(tmp_path: Path) -> None:
    state = tmp_path / "state.jsonl"
    done = _fuzz(4, 5, "--state", state)
    assert done.returncode == 0, done.stdout + done.stderr
    assert [line.split()[0] for line in done.stdout.splitlines()[:-1]] == KINDS.split(",")
    assert done.stdout.splitlines()[-1] == "20 cases, 0 complaints"
    batches = [json.loads(line) for line in state.read_text().splitlines()]
    assert all(batch["seed"] == batch["first_seed"] == 5 for batch in batches)
    batches[-1]["complaints"] = ["audit-csv seed 5 number 3: a pass that says nothing"]
    state.write_text("\n".join(map(json.dumps, batches)) + '\n{"kind": "cs')
    again = _fuzz(4, "--state", state)
    assert again.returncode == 1, "an earlier complaint counts"
    assert again.stdout.splitlines()[-1] == "20 cases, 1 complaints", "nothing was judged again"
