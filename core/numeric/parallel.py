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
from typing import Generic, TypeVar

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
    asked: deque[_Asked[T, R]] = deque()
    try:
        for item in items:
            asked.append(_Asked(function, item))
            if len(asked) > (count if ahead is None else ahead):
                yield _first(asked)
        while asked:
            yield _first(asked)
    finally:
        _give_up(asked)


def by_name(
    function: Callable[[str], R], names: Iterable[str], progress: Callable[[int, int], None] | None = None
) -> dict[str, R]:
    """What ``function`` gives for each name, in their order; made in several threads as of :func:`ordered_map`.

    ``progress`` is called, by the caller's thread, with how many are done and how many there are.
    """
    listed, out = list(names), {}
    for name, found in zip(listed, ordered_map(function, listed), strict=True):
        out[name] = found
        if progress is not None:
            progress(len(out), len(listed))
    return out


class _Asked(Generic[T, R]):
    """A piece of work that another thread was asked for, until the caller does it itself.

    Whoever does it empties the box first: a thread holds nothing of what it has done, and files close in time.
    """

    def __init__(self, function: Callable[[T], R], item: T) -> None:
        self._box = [(function, item)]
        self.future: Future[R]
        try:
            self.future = _helpers(max(1, _threads - 1)).submit(_emptied, self._box)
        except RuntimeError:  # no thread can be started, for want of memory say: the caller does it
            self._box, self.future = [(function, item)], Future()

    def do(self) -> None:
        """Do it, unless another thread is at it."""
        if not self.future.cancel():
            return
        self.future = Future()
        try:
            self.future.set_result(_emptied(self._box))
        except Exception as error:  # noqa: BLE001 (whatever it is, it is raised where its result is taken)
            self.future.set_exception(error)

    def give_up(self) -> bool:
        """Whether it will not be done."""
        given_up = self.future.cancel()
        if given_up:
            self._box.clear()
        return given_up


def _emptied(box: list[tuple[Callable[[T], R], T]]) -> R:
    function, item = box.pop()
    return function(item)


def _first(asked: deque[_Asked[T, R]]) -> R:
    """The oldest result; while another thread is at it, this one does what comes next."""
    for one in asked:
        one.do()
        if asked[0].future.done():
            break
    return asked.popleft().future.result()


def _give_up(asked: Iterable[_Asked[T, R]]) -> None:
    """Wait for what others are at, and leave the rest."""
    wait([one.future for one in asked if not one.give_up()])


@cache
def _helpers(count: int) -> ThreadPoolExecutor:
    """So many threads beside the caller's, begun when first needed."""
    return ThreadPoolExecutor(count)


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_helpers.cache_clear)  # threads are not forked
