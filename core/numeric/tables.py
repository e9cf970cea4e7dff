"""Work on logs of any length: rows in blocks, and tables that lie in memory or, where it could not hold them, in files.

A table has a column for each joint; the columns lie one after the other. One in a file is an array like any other, and
results are the same: the system writes to disk what has not been used for long, and columns that are worked on stay in
memory.
"""

from __future__ import annotations

import math
import os
import tempfile
from collections.abc import Iterator, Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

from collaudit.core.numeric.allocator import own_limit_bytes
from collaudit.core.numeric.parallel import each

#: So many tables of a log's size must fit in memory, or all are put into files: an audit keeps twelve, and the columns
#: that are worked on at the same time take as much as six.
_AT_ONCE = 18
_GROUPS = Path("/sys/fs/cgroup")

_ON_DISK = Path("/var/tmp")


def table(rows: int, columns: int, dtype: DTypeLike = np.float64) -> NDArray[Any]:
    """(rows, columns) of a log, not written yet.

    Raises:
        MemoryError: memory does not hold the log's tables, and neither does the disk.
    """
    bytes_ = rows * columns * np.dtype(dtype).itemsize
    if bytes_ * _AT_ONCE <= memory_bytes():
        return np.empty((rows, columns), dtype=dtype, order="F")
    return _in_a_file(rows, columns, np.dtype(dtype)) if bytes_ else np.empty((rows, columns), dtype=dtype, order="F")


def blocks(count: int, size: int) -> Iterator[slice]:
    """Slices that cover so many samples, in order, each of ``size`` but the last."""
    return (slice(start, min(start + size, count)) for start in range(0, count, size))


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


def folder_of_tables() -> str:
    """Where tables are put: ``TMPDIR``, or ``/var/tmp``, which is on disk where ``/tmp`` may be memory."""
    return os.environ.get("TMPDIR") or (str(_ON_DISK) if _ON_DISK.is_dir() else tempfile.gettempdir())


def _in_a_file(rows: int, columns: int, dtype: np.dtype[Any]) -> NDArray[Any]:
    """A table that is a file without a name: it is gone when nobody holds it any more, however the process ends."""
    folder, bytes_ = folder_of_tables(), rows * columns * dtype.itemsize
    try:
        with tempfile.TemporaryFile(prefix="collaudit-", dir=folder) as file:
            if hasattr(os, "posix_fallocate"):  # a disk that is full later would end the process
                os.posix_fallocate(file.fileno(), 0, bytes_)
            return np.asarray(np.memmap(file, dtype, "w+", shape=(rows, columns), order="F"))
    except OSError as error:
        raise MemoryError(
            f"{error.strerror or error} in {folder} for a table of {bytes_ / 1e9:.3g} GB, one of up to {_AT_ONCE}, "
            "which memory cannot hold: let TMPDIR name a folder on a disk with room, or split the log"
        ) from error


def copied(x: NDArray[Any]) -> NDArray[Any]:
    """A table of the same values; errors as of :func:`table`."""
    out = table(x.shape[0], x.shape[1], x.dtype)
    out[...] = x
    return out


def combined(operation: np.ufunc, x: NDArray[Any], y: NDArray[Any]) -> NDArray[Any]:
    """A table of an operation on two, value by value; errors as of :func:`table`."""
    out = table(*x.shape)
    each(lambda j: operation(x[:, j], y[:, j], out=out[:, j]), range(x.shape[1]))
    return out


def picked(x: NDArray[Any], columns: Sequence[int]) -> NDArray[Any]:
    """A table of some columns; errors as of :func:`table`."""
    out = table(x.shape[0], len(columns), x.dtype)
    for place, column in enumerate(columns):
        out[:, place] = x[:, column]
    return out
