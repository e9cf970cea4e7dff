"""``make bench``: whole commands beside the script, with memory; see ``whole_commands``."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.bench


def test_whole_commands() -> None:
    lengths = os.environ.get("COLLAUDIT_BENCH_MINUTES", "1 10 60").split()
    subprocess.run([sys.executable, str(Path(__file__).with_name("whole_commands.py")), *lengths], check=True)
