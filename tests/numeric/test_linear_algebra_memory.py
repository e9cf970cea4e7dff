"""Linear algebra takes its memory in time where that is limited: later refusals end no process and hang none."""

from __future__ import annotations

import subprocess
import sys

import pytest

pytest.importorskip("resource", reason="limits of memory are those of POSIX systems")
if not sys.platform.startswith("linux"):
    pytest.skip("only Linux counts what RLIMIT_DATA limits", allow_module_level=True)

LIMITED = """
import resource, sys, threading
import numpy as np
from collaudit.core.numeric.allocator import take_memory_of_linear_algebra
from collaudit.core.numeric.filter_design import matrix_exponential
from collaudit.core.numeric.parallel import by_name, use_threads

def limit(more_mb):
    with open("/proc/self/status") as lines:
        used = next(int(line.split()[1]) for line in lines if line.startswith("VmData"))
    resource.setrlimit(resource.RLIMIT_DATA, (used * 1024 + (more_mb << 20), resource.RLIM_INFINITY))

threads = int(sys.argv[1])
use_threads(threads)
"""
ROOM = """
limit(400)
take_memory_of_linear_algebra(threads)
limit(6)  # less than the stack of a thread
square, both = np.ones((400, 400)), threading.Barrier(threads, timeout=20)
def product(name):
    both.wait()
    return float((square @ square)[0, 0])
print(by_name(product, ("a", "b")[:threads]), matrix_exponential(np.array([[0.0, -0.2], [0.2, 0.0]]))[0, 0].round(6))
"""
NO_ROOM = """
limit(30)
try:
    take_memory_of_linear_algebra(threads)
except MemoryError as error:
    print(error)
"""


def printed(code: str, threads: int) -> str:
    done = subprocess.run(
        [sys.executable, "-c", LIMITED + code, str(threads)], capture_output=True, text=True, timeout=20, check=True
    )
    return done.stdout.strip()


@pytest.mark.parametrize("threads", [1, 2])
def test_a_log_that_takes_the_rest_leaves_it_its_memory(threads: int) -> None:
    names = dict.fromkeys(("a", "b")[:threads], 400.0)
    assert printed(ROOM, threads) == f"{names} 0.980067"


@pytest.mark.parametrize("threads", [1, 2])
def test_a_limit_without_room_for_it_is_said(threads: int) -> None:
    wanted = 34 * (threads + 3) * 2**20 / 1e6
    assert printed(NO_ROOM, threads) == f"linear algebra needs {wanted:.0f} MB more than the limit of this process"


def test_nothing_is_taken_where_nothing_is_limited() -> None:
    code = "take_memory_of_linear_algebra(threads)\nprint(threading.active_count(), 'scipy' in sys.modules)"
    assert printed(code, 2) == "1 False"
