"""Linear algebra takes its memory in time where that is limited: later refusals end no process and hang none."""

from __future__ import annotations

import subprocess
import sys

import pytest

pytest.importorskip("resource", reason="limits of memory are those of POSIX systems")
if not sys.platform.startswith("linux"):
    pytest.skip("only Linux counts what RLIMIT_DATA limits", allow_module_level=True)

LIMITED = """
import resource, threading, sys
import numpy as np
from collaudit.core.numeric.linear_algebra import settle_within_memory_limit
from collaudit.core.numeric.parallel import by_name, threads, use_threads

def limit(more_mb):
    with open("/proc/self/status") as lines:
        used = next(int(line.split()[1]) for line in lines if line.startswith("VmData"))
    resource.setrlimit(resource.RLIMIT_DATA, (used * 1024 + (more_mb << 20), resource.RLIM_INFINITY))

use_threads(2)
"""
ROOM = """
limit(400)
settle_within_memory_limit()
limit(6)  # less than the stack of a thread
square = np.ones((400, 400))
def product(name):
    return float((square @ square)[0, 0])
print(by_name(product, ("a", "b")), threads(), threading.active_count())
import scipy
print(scipy.linalg.expm(np.array([[0.0, -0.2], [0.2, 0.0]]))[0, 0].round(6))
"""
NO_ROOM = """
limit(30)
try:
    settle_within_memory_limit()
except MemoryError as error:
    print(error)
"""


def printed(code: str) -> list[str]:
    done = subprocess.run(
        [sys.executable, "-c", LIMITED + code], capture_output=True, text=True, timeout=20, check=True
    )
    return done.stdout.splitlines()


def test_a_log_that_takes_the_rest_leaves_it_its_memory_and_one_thread() -> None:
    assert printed(ROOM) == ["{'a': 400.0, 'b': 400.0} 1 1", "0.980067"]


def test_a_limit_without_room_for_it_is_said() -> None:
    assert printed(NO_ROOM) == ["linear algebra needs 143 MB more than the limit of this process"]


def test_nothing_is_taken_where_nothing_is_limited() -> None:
    code = "settle_within_memory_limit()\nprint(threads(), threading.active_count(), 'scipy' in sys.modules)"
    assert printed(code) == ["2 1 False"]
