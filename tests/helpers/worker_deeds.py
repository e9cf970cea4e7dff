"""What worker processes do in tests; forked processes import it."""

from __future__ import annotations

import os
import signal
import time
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

LARGE = b"x" * 1_000_000  # more than a pipe takes at once


def nothing() -> None:
    pass


def do(what: str, folder: Path) -> Any:
    """What an item's name says, in a worker."""
    if what == "dies":
        os.kill(os.getpid(), signal.SIGKILL)
    if what == "leaves":
        os._exit(3)
    if what == "sleeps":
        time.sleep(60)
    if what == "dies while it speaks":
        Connection._send = half  # type: ignore[attr-defined]
    if what == "cannot be sent":
        return lambda: None
    (folder / f"{what}-{time.monotonic_ns()}").touch()
    return LARGE


def half(self: Any, data: Any, write: Any = os.write) -> None:
    write(self.fileno(), bytes(data)[: len(data) // 2] or b"x")
    os.kill(os.getpid(), signal.SIGKILL)


def descendants(pid: int) -> list[int]:
    """Processes that a process started, and theirs."""
    own = [int(pid) for task in Path(f"/proc/{pid}/task").glob("*/children") for pid in task.read_text().split()]
    return own + [further for child in own for further in descendants(child)]


def refuse() -> None:
    raise MemoryError("no memory")
