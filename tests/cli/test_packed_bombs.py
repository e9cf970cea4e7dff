"""The whole command on small files that honestly hold very much: below a gigabyte, or refused, in one message."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import packed_bombs as bombs
import pytest

MEGABYTES = 1000
SECONDS = 20
#: Ends with the peak of memory that the system kept of this program. What wait4 tells includes this test's own process,
#: as it was before it became the program.
PROGRAM = """
import sys
from collaudit.cli.main import main
try:
    main()
finally:
    peak = [line for line in open("/proc/self/status") if line.startswith("VmHWM")]
    print("peak", peak[0].split()[1], file=sys.stderr, flush=True)
"""
RUN = [sys.executable, "-c", PROGRAM]


@pytest.mark.parametrize("bomb", [bombs.packed_zeros_zstd, bombs.packed_bag, bombs.packed_db3])
def test_detect_stays_small(bomb: Callable[[Path], Path], arm, tmp_path: Path) -> None:
    log = bomb(tmp_path / "bomb.mcap")
    files = [log] if log.is_file() else list(log.iterdir())
    assert sum(file.stat().st_size for file in files) < 9_500_000
    command = [
        *RUN,
        "detect",
        str(log),
        "-c",
        str(arm.config),
        "--friction",
        str(arm.friction),
        "-o",
        str(tmp_path / "run"),
    ]
    with (tmp_path / "said").open("w+") as said:
        process = subprocess.Popen(command, stdout=said, stderr=said)
        _, status, used = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        said.seek(0)
        text = said.read()
    megabytes = int(text.rpartition("peak ")[2]) / 1000
    print(bomb.__name__, process.returncode, megabytes, "MB", used.ru_utime + used.ru_stime, "s", text[:150])
    assert process.returncode in (2, 3), text
    assert "Traceback" not in text and "this is a bug" not in text
    assert megabytes < MEGABYTES
    assert used.ru_utime + used.ru_stime < SECONDS
    assert not (tmp_path / "run" / "audit.json").exists() or process.returncode == 3
