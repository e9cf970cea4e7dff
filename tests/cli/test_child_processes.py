"""A worker process that dies at any moment costs at most the item it had, and none waits for it for ever."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest
from worker_deeds import LARGE, descendants, do, nothing, refuse

from collaudit.cli.batch.child_processes import Lost, results_of


def _results(names: list[str], folder: Path, prepare: Any = nothing, timeout_s: float | None = None) -> dict[str, Any]:
    items = [(name, folder) for name in names]
    with closing(results_of(do, items, 2, prepare, timeout_s)) as results:
        found = dict(results)
    assert sorted(found) == list(range(len(names))), "each item has one result"
    return {f"{number} {name}": found[number] for number, name in enumerate(names)}


def test_each_way_to_be_lost_costs_one_item(tmp_path: Path) -> None:
    names = ["does", "dies", "dies while it speaks", "does", "leaves", "cannot be sent", "does"]
    found = _results(names, tmp_path)
    assert all("was killed (SIGKILL)" in found[name].why for name in ("1 dies", "2 dies while it speaks"))
    assert "ended with exit code 3" in found["4 leaves"].why
    assert "could not be received" in found["5 cannot be sent"].why
    assert found["0 does"] == found["3 does"] == found["6 does"] == LARGE
    assert len(list(tmp_path.glob("does-*"))) <= 3, "done once each"


def test_a_late_one_is_ended_and_the_others_go_on(tmp_path: Path) -> None:
    started = time.monotonic()
    found = _results(["sleeps", "does", "does"], tmp_path, timeout_s=1.0)
    assert found["0 sleeps"] == Lost("it took longer than the 1 s that --timeout allows")
    assert found["1 does"] == found["2 does"] == LARGE
    assert time.monotonic() - started < 30


def test_where_none_can_be_started_every_item_says_so(tmp_path: Path) -> None:
    found = _results(["does"] * 3, tmp_path, refuse)
    assert all("started" in result.why and "MemoryError: no memory" in result.why for result in found.values())


def test_all_are_gone_when_the_results_are_closed(tmp_path: Path) -> None:
    results = results_of(do, [("does", tmp_path), ("sleeps", tmp_path)], 2, nothing)
    assert next(results) == (0, LARGE)
    before, started = descendants(os.getpid()), time.monotonic()
    results.close()
    assert len(before) > len(descendants(os.getpid())) and time.monotonic() - started < 5


@pytest.mark.parametrize("items", [[], ["does"]])
def test_few_items(items: list[str], tmp_path: Path) -> None:
    assert len(_results(items, tmp_path)) == len(items)


INTERRUPTED = """
import os, signal, threading, time
from collaudit.cli.batch.child_processes import results_of
if __name__ == "__main__":
    signal.signal(signal.SIGINT, lambda *_: None)  # as the audit's own, which ends it
    found = []
    thread = threading.Thread(target=lambda: found.extend(results_of(len, [([1, 2],)], 1, int)))
    thread.start()
    until = time.monotonic() + 20
    while thread.is_alive() and time.monotonic() < until:
        os.killpg(0, signal.SIGINT)
        time.sleep(0.01)
    print(*found)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="no process groups")
def test_a_process_does_not_hear_what_the_terminal_sends_to_all(tmp_path: Path) -> None:
    script = tmp_path / "interrupted.py"
    script.write_text(INTERRUPTED)
    done = subprocess.run(
        [sys.executable, str(script)], capture_output=True, text=True, timeout=60, check=False, start_new_session=True
    )
    assert (done.stdout.strip(), done.stderr) == ("(0, 2)", "")


ASKED = """
import os
from collaudit.cli.batch.child_processes import results_of
if __name__ == "__main__":
    print(list(results_of(os.getenv, [("OPENBLAS_NUM_THREADS",)], 1, dict)))
"""


@pytest.mark.parametrize("started_with", [{}, {"OPENBLAS_NUM_THREADS": "3"}])
def test_a_process_takes_one_thread_of_linear_algebra_whoever_starts_it(
    tmp_path: Path, started_with: dict[str, str]
) -> None:
    """A worker of a cluster asks for none: sums split over threads would differ in their last bits."""
    script = tmp_path / "asked.py"
    script.write_text(ASKED, encoding="utf-8")
    others = {key: value for key, value in os.environ.items() if key != "OPENBLAS_NUM_THREADS"}
    command = [sys.executable, str(script)]
    done = subprocess.run(command, env=others | started_with, capture_output=True, text=True, timeout=60, check=True)
    assert done.stdout.strip() == "[(0, '1')]"
