"""What worker processes do in tests of their pool; spawned processes import it."""

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
    if what == "dies after it":  # idle for a moment, then gone
        signal.signal(signal.SIGALRM, signal.SIG_DFL)
        signal.setitimer(signal.ITIMER_REAL, 0.05)
    (folder / f"{what}-{time.monotonic_ns()}").touch()
    return LARGE


def half(self: Any, data: Any, write: Any = os.write) -> None:
    write(self.fileno(), bytes(data)[: len(data) // 2] or b"x")
    os.kill(os.getpid(), signal.SIGKILL)


def die_at_first(folder: Path, times: int) -> None:
    """The first so many processes die before they are ready."""
    for number in range(times):
        try:
            (folder / f"start{number}").touch(exist_ok=False)
        except FileExistsError:
            continue
        os.kill(os.getpid(), signal.SIGKILL)


def refuse() -> None:
    raise MemoryError("no memory")
