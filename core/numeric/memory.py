"""How much memory a log's tables take, and how much there is: a log that does not fit is refused."""

from __future__ import annotations

import math
import os
from functools import cache
from pathlib import Path

from collaudit.core.errors import NotJudgedError
from collaudit.core.numeric.linear_algebra import own_limit_bytes

#: So many tables of a log's size must fit in memory: an audit keeps twelve, and the columns that are worked on at the
#: same time take as much as six.
_AT_ONCE = 18
_GROUPS = Path("/sys/fs/cgroup")


def refuse_larger_than_memory(rows: int, columns: int, name: str) -> None:
    """Refuse a log whose tables do not fit.

    Args:
        rows, columns: samples and joints.
        name: of the log.

    Raises:
        NotJudgedError: they do not.
    """
    needed, there = 8.0 * rows * columns * _AT_ONCE, memory_bytes()
    if needed > there:
        raise NotJudgedError(
            "the log is larger than memory allows to judge at once",
            where=name,
            found=f"{rows} samples of {columns} joints: {needed / 1e9:.3g} GB of tables",
            expected=f"at most {there / 1e9:.3g} GB",
            hint="judge it in parts: --from 0 --to 3600, then --from 3600 --to 7200 (seconds)",
        )


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
