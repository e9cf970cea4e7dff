"""An ordered map over a few threads with a short look-ahead, so that memory stays bounded; and how far work has come.

A log is cut for it into what does not depend on the rest: chunks of its file, stretches between gaps in filters, blocks
of time in the dynamics, joints in residual and alarms. Results are those of one thread, whatever the number.
"""

from __future__ import annotations

import os
import threading
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence, Sized
from concurrent.futures import Future, ThreadPoolExecutor
from functools import cache
from typing import TypeVar

import numpy as np

from collaudit.core.numeric.arrays import FloatArray, blocks

T = TypeVar("T")
R = TypeVar("R")

#: More are not taken unasked: a nightly audit shares its machine.
_threads = min(2, os.cpu_count() or 1)
#: Samples at a time: so many that two threads seldom wait for each other to call NumPy (with 8,192 they took as long as
#: one), few enough that what is worked on stays in the last level of the cache.
_BLOCK = 32_768
_thread = threading.local()
#: Called with what is done and what there is in all.
Progress = Callable[[int, int], None]
_STEPS = 1000


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


def ordered_map(function: Callable[[T], R], items: Iterable[T]) -> Iterator[R]:
    """Apply ``function`` in :func:`threads` threads; results come in the order of the items, few at a time.

    A map inside a map works in the thread that it is in.

    Args:
        function: what to apply.
        items: to what.
    """
    if _alone() or (isinstance(items, Sized) and len(items) < 2):
        yield from map(function, items)
        return
    asked = deque[Future[R]]()
    with _helpers(_threads) as pool:
        for item in items:
            asked.append(pool.submit(function, item))
            if len(asked) > _threads:
                yield asked.popleft().result()
        while asked:
            yield asked.popleft().result()


def each(function: Callable[[T], object], items: Iterable[T]) -> None:
    """Apply ``function``, which gives nothing, to all items, as of :func:`ordered_map`."""
    for _ in ordered_map(function, items):
        pass


def begun(function: Callable[[], R]) -> Callable[[], R]:
    """What waits for the result of ``function``, which a thread begins now; without others it is begun when asked."""
    if _alone():
        return cache(function)
    pool = _helpers(1)
    result = pool.submit(function).result
    pool.shutdown(wait=False)
    return result


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


def by_samples(compute: Callable[..., FloatArray], signals: Sequence[FloatArray], outputs: int) -> FloatArray:
    """(n, outputs) of a computation over all samples; one with any input that is not finite is NaN altogether.

    Args:
        compute: from (c, m) of each signal to (outputs, m).
        signals: (n, c) each.
        outputs: numbers that come out of a sample.
    """
    count = signals[0].shape[0]
    out = np.empty((count, outputs), order="F")

    def one(block: slice) -> None:
        rows = [signal[block].T for signal in signals]
        known = np.all([np.isfinite(x).all(axis=0) for x in rows], axis=0)
        with np.errstate(invalid="ignore"):  # the sine of what is not finite is not a number, and that is right
            out[block] = np.where(known, compute(*rows), np.nan).T

    each(one, list(blocks(count, _BLOCK)))
    return out


def _alone() -> bool:
    """Whether this thread works for itself: the only one there is, or one that works for another."""
    return _threads == 1 or getattr(_thread, "helps", False)


def _helpers(count: int) -> ThreadPoolExecutor:
    """So many threads that work for another."""
    return ThreadPoolExecutor(count, initializer=setattr, initargs=(_thread, "helps", True))


def stage(progress: Progress | None, start: float, end: float) -> Progress:
    """A callback for one stage of some work.

    Args:
        progress: of the whole; None: nobody asks.
        start, end: shares of the whole at which the stage begins and ends, 0 to 1, as its time usually is.
    """

    def report(done: int, total: int) -> None:
        if progress is not None and total > 0:
            progress(round(_STEPS * (start + (end - start) * min(done / total, 1.0))), _STEPS)

    return report
