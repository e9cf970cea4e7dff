"""An ordered map over a few threads with a short look-ahead, so that memory stays bounded.

A log is cut for it into what does not depend on the rest: chunks of its file, stretches between gaps in filters, blocks
of time in the dynamics, joints in residual and alarms. Results are those of one thread, whatever the number.
"""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sized
from concurrent.futures import Future, ThreadPoolExecutor, wait
from functools import cache
from typing import TypeVar

T = TypeVar("T")
R = TypeVar("R")
_Asked = tuple["Future[R]", T]

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

    The caller's thread is one of them and takes what no other has begun: on a busy machine it waits for nobody, and a
    map inside a map comes to no standstill. The others stay for the next map.

    Args:
        function: what to apply.
        items: to what.
        ahead: results that may wait for whoever takes them; as many as threads where nothing is said.
    """
    count = _threads
    if count == 1 or (isinstance(items, Sized) and len(items) < 2):
        yield from map(function, items)
        return
    asked: deque[_Asked[R, T]] = deque()
    try:
        for item in items:
            asked.append((_helpers(count - 1).submit(function, item), item))
            if len(asked) > (count if ahead is None else ahead):
                yield _first(function, asked)
        while asked:
            yield _first(function, asked)
    finally:
        wait([future for future, _ in asked if not future.cancel()])


def by_name(function: Callable[[str], R], names: Iterable[str]) -> dict[str, R]:
    """What ``function`` gives for each name, in their order; made in several threads as of :func:`ordered_map`."""
    listed = list(names)
    return dict(zip(listed, ordered_map(function, listed), strict=True))


def _first(function: Callable[[T], R], asked: deque[_Asked[R, T]]) -> R:
    """The oldest result; while another thread is at it, this one does what comes next."""
    for place in range(len(asked)):
        future, item = asked[place]
        if future.cancel():
            asked[place] = (_done(function, item), item)
        if asked[0][0].done():
            break
    return asked.popleft()[0].result()


def _done(function: Callable[[T], R], item: T) -> Future[R]:
    """What an item gives, or its error, to be told in its turn."""
    future: Future[R] = Future()
    try:
        future.set_result(function(item))
    except Exception as error:  # noqa: BLE001 (whatever it is, it is raised where its result is taken)
        future.set_exception(error)
    return future


@cache
def _helpers(count: int) -> ThreadPoolExecutor:
    """So many threads beside the caller's, begun when first needed."""
    return ThreadPoolExecutor(count)


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_helpers.cache_clear)  # threads are not forked
