"""How much memory this process may take."""

from __future__ import annotations

import math
import os
from functools import cache
from pathlib import Path

from collaudit.core.numeric.linear_algebra import own_limit_bytes

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
