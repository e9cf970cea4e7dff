"""An ordered map over a few threads with a short look-ahead, so that memory stays bounded.

A log is cut for it into what does not depend on the rest: chunks of its file, stretches between gaps in filters, blocks
of time in the dynamics, joints in residual and alarms. Results are those of one thread, whatever the number.
"""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sized
from concurrent.futures import Future, ThreadPoolExecutor
from typing import TypeVar

T = TypeVar("T")
R = TypeVar("R")

#: More are not taken unasked: a nightly audit shares its machine.
_threads = min(2, os.cpu_count() or 1)


def threads() -> int:
    """Threads that are taken."""
    return _threads


def use_threads(count: int) -> None:
    """Take so many threads from now on: one in a process that shares its machine with as many others as it has cores.

    Args:
        count: threads, 1 at least.
    """
    global _threads
    _threads = max(1, count)


def ordered_map(function: Callable[[T], R], items: Iterable[T], ahead: int | None = None) -> Iterator[R]:
    """Apply ``function`` in up to :func:`threads` threads; results come in the order of the items, few at a time.

    Args:
        function: what to apply.
        items: to what.
        ahead: results that may wait for whoever takes them; as many as threads where nothing is said.
    """
    count = _threads
    if count == 1 or (isinstance(items, Sized) and len(items) < 2):
        yield from map(function, items)
        return
    with ThreadPoolExecutor(count) as pool:
        waiting: deque[Future[R]] = deque()
        try:
            for item in items:
                waiting.append(pool.submit(function, item))
                if len(waiting) > (count if ahead is None else ahead):
                    yield waiting.popleft().result()
            while waiting:
                yield waiting.popleft().result()
        finally:
            for future in waiting:
                future.cancel()
