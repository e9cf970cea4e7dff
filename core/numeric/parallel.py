"""An ordered map over a few threads with a short look-ahead, so that memory stays bounded."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sized
from concurrent.futures import Future, ThreadPoolExecutor
from typing import TypeVar

T = TypeVar("T")
R = TypeVar("R")

#: More are not taken: a nightly audit shares its machine.
THREADS = min(2, os.cpu_count() or 1)


def stay_on_one_core() -> None:
    """Use no threads from now on: in a process that shares its machine with as many others as there are cores."""
    global THREADS
    THREADS = 1


def ordered_map(function: Callable[[T], R], items: Iterable[T], ahead: int = THREADS) -> Iterator[R]:
    """Apply ``function`` in up to two threads; results come in the order of the items, few at a time.

    Args:
        function: what to apply.
        items: to what.
        ahead: results that may wait for whoever takes them.
    """
    if THREADS == 1 or (isinstance(items, Sized) and len(items) < 2):
        yield from map(function, items)
        return
    with ThreadPoolExecutor(THREADS) as pool:
        waiting: deque[Future[R]] = deque()
        try:
            for item in items:
                waiting.append(pool.submit(function, item))
                if len(waiting) > ahead:
                    yield waiting.popleft().result()
            while waiting:
                yield waiting.popleft().result()
        finally:
            for future in waiting:
                future.cancel()
