"""Commands whose caller closed stdin, stdout or stderr, or ends them while a library computes."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from histories import history

from collaudit.reports.files.result_store import ResultStore

PROGRAM = (sys.executable, "-c", "from collaudit.cli.main import main; main()")
ENDLESS = "select count(*) from range(1000000) a, range(1000000) b where a.range * b.range % 7 = 3"


@pytest.mark.parametrize("closed", [(0,), (1,), (2,), (0, 1, 2)])
def test_a_closed_stream_changes_no_answer(closed: tuple[int, ...], tmp_path: Path) -> None:
    log = tmp_path / "log.csv"
    rows = "".join(f"{0.002 * k:.3f},0.1,1\n" for k in range(200))
    log.write_text(f"time_s,q1,tau1\n{rows}", encoding="utf-8")
    before = log.read_bytes()
    done = subprocess.run(
        [*PROGRAM, "inspect", str(log)],
        preexec_fn=lambda: [os.close(number) for number in closed],
        stdin=subprocess.DEVNULL,
        capture_output=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert b"Error" not in done.stdout + done.stderr
    assert log.read_bytes() == before


@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_a_question_is_ended_by_a_signal(number: int, code: int, tmp_path: Path) -> None:
    """DuckDB makes an error of its own of the exception that a signal raises."""
    pytest.importorskip("duckdb")
    store = tmp_path / "store"
    ResultStore(str(store)).append(history("arm", 2))
    process = subprocess.Popen(
        [*PROGRAM, "query", str(store), ENDLESS],
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
        stderr=subprocess.PIPE,
    )
    while threads_of(process.pid) < 2:  # DuckDB's own begin with the question's connection
        time.sleep(0.05)
    time.sleep(0.5)
    process.send_signal(number)
    _, said = process.communicate(timeout=30)
    assert process.returncode == code
    assert b"bug" not in said


def threads_of(pid: int) -> int:
    return len(list(Path(f"/proc/{pid}/task").iterdir()))
