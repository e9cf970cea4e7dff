"""What the process may take: one thread of linear algebra, its memory taken in time, and how much memory there is."""

from __future__ import annotations

import math
import os
import sys
from functools import cache
from pathlib import Path

#: Read by the libraries below NumPy and SciPy when they are loaded.
_LINEAR_ALGEBRA_THREADS = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")


def one_thread_of_linear_algebra() -> None:
    """Ask linear algebra for one thread: in this process before NumPy is imported, and in those that it starts.

    Sums split over threads differ in their last bits: one thread gives the same bytes on every machine. Its products
    are small here, and threads that wait for the next one do so at full speed: they took a tenth of the processor's
    time from the threads that work.
    """
    for name in _LINEAR_ALGEBRA_THREADS:
        os.environ[name] = "1"


#: What OpenBLAS takes at a time, with a little to spare.
_BUFFER_BYTES = 34 << 20
#: Rows of a product that needs a buffer.
_PRODUCT = 200


def room_for_linear_algebra() -> None:
    """Where the memory of the process is limited: that NumPy can be imported, before it is.

    Raises:
        MemoryError: OpenBLAS would find no room, and end the process with exit code 1.
    """
    if memory_is_limited():
        _leave(3 * _BUFFER_BYTES)


def _leave(size: int) -> None:
    """Raise a MemoryError where the limit leaves no so many bytes."""
    try:
        bytearray(size)
    except MemoryError:
        raise MemoryError(f"linear algebra needs {size / 1e6:.0f} MB more than the limit of this process") from None


@cache
def settle_within_memory_limit() -> None:
    """Where the memory of the process is limited, take one thread, and have linear algebra take its memory now.

    OpenBLAS takes 32 MB when it is loaded, 32 when it is first used, and as much for each further thread that uses it
    at the same time. Where that is refused, some of its releases try again for ever, which no signal handler of
    Python's interrupts; others end the process with exit code 1, which would say that a policy is broken. So it asks
    before a log can leave none. With one thread, all of it is known: NumPy and SciPy have a copy each.

    Raises:
        MemoryError: the limit leaves no room for it.
    """
    if not memory_is_limited():
        return
    import numpy as np
    import scipy

    from collaudit.core.numeric.parallel import use_threads

    use_threads(1)
    _leave(4 * _BUFFER_BYTES)  # NumPy's copy is loaded already; one for what comes with SciPy's
    scipy.linalg.expm(np.array([[0.0, -0.1], [0.1, 0.0]]))
    square = np.zeros((_PRODUCT, _PRODUCT))
    np.matmul(square, square)


def memory_is_limited() -> bool:
    """Whether this process may take less memory than there is."""
    return own_limit_bytes() < math.inf


def own_limit_bytes() -> float:
    """The least limit of this process's memory (``ulimit -d`` or ``-v``, ``--memory-limit``); infinite without any."""
    if sys.platform == "win32":
        return math.inf
    import resource

    limits = [resource.getrlimit(kind)[0] for kind in (resource.RLIMIT_DATA, resource.RLIMIT_AS)]
    return min((float(limit) for limit in limits if limit != resource.RLIM_INFINITY), default=math.inf)


_GROUPS = Path("/sys/fs/cgroup")


def memory_bytes() -> float:
    """Memory that this process may take: the machine's, or less where a limit is set; infinite where nobody tells."""
    return min(_machine_bytes(), own_limit_bytes())


@cache
def _machine_bytes() -> float:
    try:
        whole = float(os.sysconf("SC_PAGE_SIZE")) * os.sysconf("SC_PHYS_PAGES")
    except (AttributeError, OSError, ValueError):
        return math.inf
    try:
        listed = Path("/proc/self/cgroup").read_text()
    except OSError:
        listed = ""
    return min(whole, _group_bytes(listed, _GROUPS))


def _group_bytes(listed: str, root: Path) -> float:
    """The least limit of the groups that hold a process (cgroups(7)); infinite where none is stated.

    Args:
        listed: ``/proc/PID/cgroup``: a line ``number:controllers:path`` a hierarchy. That of the second kind has no
            controllers; of the first kind "no limit" is a huge number.
        root: folder that hierarchies are mounted in. Inside a container its own group is at their top.
    """
    out = math.inf
    for line in listed.splitlines():
        _, controllers, path = line.split(":", 2)
        if controllers == "":
            top, name = root, "memory.max"
        elif "memory" in controllers.split(","):
            top, name = root / "memory", "memory.limit_in_bytes"
        else:
            continue
        own = Path(path.lstrip("/"))
        out = min([out, *(_stated_bytes(top / group / name) for group in (own, *own.parents))])
    return out


def _stated_bytes(path: Path) -> float:
    try:
        return float(path.read_text())
    except (OSError, ValueError):  # no such file, or "max"
        return math.inf
