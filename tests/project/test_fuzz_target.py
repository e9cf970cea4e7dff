"""``make fuzz`` runs: a few cases of every kind of log."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

FUZZ = Path(__file__).parents[1] / "bench" / "fuzz_logs.py"


def test_a_round_of_every_kind_ends_without_complaint() -> None:
    done = subprocess.run([sys.executable, FUZZ, "10", "5"], capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    kinds = [line.split()[0] for line in done.stdout.splitlines()]
    assert {"mcap-zstd", "bag-lz4", "db3", "csv"} <= set(kinds)
