"""Audits on a cluster: a real scheduler and two worker processes, one of which dies; and what each task costs."""

from __future__ import annotations

import json
import operator
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from collaudit.reports.files.result_store import ResultStore

pytest.importorskip("distributed")
LOGS = 8


@pytest.fixture
def cluster(tmp_path: Path) -> Iterator[tuple[str, list[subprocess.Popen[bytes]]]]:
    """A scheduler's address, and its two workers."""
    told = tmp_path / "scheduler.json"
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "cwd": tmp_path}
    dask = [sys.executable, "-m", "dask"]
    address = ["--host", "127.0.0.1", "--port", "0", "--no-dashboard", "--scheduler-file", str(told)]
    processes = [subprocess.Popen([*dask, "scheduler", *address], **quiet)]
    deadline = time.monotonic() + 60
    while not told.exists() and time.monotonic() < deadline:
        time.sleep(0.1)
    where = json.loads(told.read_text())["address"]
    lone = ["--nthreads", "1", "--no-nanny", "--no-dashboard"]
    processes += [subprocess.Popen([*dask, "worker", where, *lone], **quiet) for _ in range(2)]
    yield where, processes[1:]
    for process in processes:
        process.kill()
        process.wait(30)


def test_a_worker_that_dies_loses_no_log_and_none_is_judged_twice(arm, cluster, tmp_path: Path) -> None:
    address, workers = cluster
    logs, out = tmp_path / "logs", tmp_path / "out"
    logs.mkdir()
    head, *rows = arm.pushed.read_text().splitlines()
    for number in range(LOGS):
        part = rows[len(rows) // 2 - 1500 : len(rows) // 2]
        (logs / f"{number}.csv").write_text("\n".join([head, *part, f"# {number}"]) + "\n")
    command = [sys.executable, "-c", "import sys; from collaudit.cli.main import main; sys.exit(main())", "audit",
               str(logs), "-c", str(arm.config), "--friction", str(arm.friction), "-o", str(out),
               "--scheduler", address, "--store", str(tmp_path / "store"), "--robot", "r"]  # fmt: skip
    audit = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    deadline = time.monotonic() + 120
    while not list(out.glob("*/finished.json")) and time.monotonic() < deadline:
        time.sleep(0.05)
    workers[0].send_signal(signal.SIGKILL)
    said = audit.communicate(timeout=120)
    assert audit.returncode in (0, 1), said
    summary = json.loads((out / "summary.json").read_text())
    assert sorted(entry["name"] for entry in summary["logs"]) == [f"{number}.csv" for number in range(LOGS)]
    assert {entry["verdict"] for entry in summary["logs"]} <= {"pass", "fail"}
    assert len(list(out.glob("*/finished.json"))) == LOGS and not list(out.rglob("*.part"))
    assert len({row.log for row in ResultStore(str(tmp_path / "store")).rows()}) == LOGS


def test_what_a_cluster_finds_is_what_one_process_finds(arm, cluster, tmp_path: Path) -> None:
    """Byte for byte: threads of BLAS, which order its sums, are set where the work is done."""
    logs = tmp_path / "logs"
    logs.mkdir()
    for number, log in enumerate((arm.clean, arm.pushed)):
        shutil.copy(log, logs / f"{number}.csv")
    for out, options in (("here", ["-j", "1"]), ("there", ["--scheduler", cluster[0]])):
        command = [sys.executable, "-c", "import sys; from collaudit.cli.main import main; sys.exit(main())", "audit",
                   str(logs), "-c", str(arm.config), "--friction", str(arm.friction), "-o", str(tmp_path / out),
                   "--as-of", "2026-01-01", *options]  # fmt: skip
        assert subprocess.run(command, capture_output=True, timeout=300, check=False).returncode == 1
    here, there = (
        {file.relative_to(tmp_path / out): file for file in (tmp_path / out).rglob("*") if file.is_file()}
        for out in ("here", "there")
    )
    assert here.keys() == there.keys()
    signals = [name for name in here if name.name == "signals.parquet"]
    assert len(signals) == 2
    for name in signals:
        assert here[name].read_bytes() == there[name].read_bytes()
    for name in (name for name in here if name.name == "audit.json"):
        ours, theirs = (json.loads(files[name].read_bytes()) for files in (here, there))
        assert {**ours, "provenance": None} == {**theirs, "provenance": None}


def test_no_scheduler_there_is_said(collaudit, arm, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from collaudit.cli.batch import logs_in_turn

    monkeypatch.setattr(logs_in_turn, "_CONNECT_S", "1s")  # nobody will come
    nobody = collaudit("audit", arm.clean, "-c", arm.config, "-o", tmp_path / "out", "--scheduler", "tcp://127.0.0.1:9")
    assert nobody.code == 2 and "scheduler cannot be reached" in nobody.err and "dask worker" in nobody.err


def test_handing_out_takes_less_than_10_ms_a_log(cluster) -> None:
    from collaudit.cli.batch.child_processes import results_of
    from collaudit.cli.batch.logs_in_turn import results_on_dask

    address, _ = cluster
    for results, where in ((results_on_dask, (int, None, address)), (results_of, (2, int))):
        few, many = (_seconds(results, count, where) for count in (5, 35))
        assert (many - few) / 30 < 0.010


def _seconds(results, count: int, where: tuple) -> float:
    start = time.process_time()
    found = dict(results(operator.index, [(k,) for k in range(count)], *where))
    assert found == {k: k for k in range(count)}
    return time.process_time() - start


def test_a_cluster_needs_dask_and_one_machine_does_not(monkeypatch: pytest.MonkeyPatch) -> None:
    from collaudit.cli.batch import logs_in_turn
    from collaudit.cli.batch.log_jobs import Limits
    from collaudit.core.errors import CollauditError

    monkeypatch.setattr(logs_in_turn, "find_spec", lambda _name: None)
    assert logs_in_turn._results([(), ()], Limits(2)).__name__ == "results_of"
    with pytest.raises(CollauditError, match="collaudit\\[fleet\\]"):
        logs_in_turn._results([()], Limits(scheduler="tcp://somewhere:8786"))


def test_memory_is_bounded_where_workers_share_a_machine() -> None:
    from collaudit.cli.batch.log_jobs import Limits
    from collaudit.cli.batch.logs_in_turn import _memory_gb

    assert _memory_gb(Limits(1)) is None and _memory_gb(Limits(4, None, 3.0)) == 3.0
    assert (_memory_gb(Limits(4)) or 0) >= 2.0 and (_memory_gb(Limits(10_000)) or 0) == 2.0
