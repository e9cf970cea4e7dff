"""Processes that do one task after another; one that dies or takes too long costs the task it had, whenever that is.

In: a function and its items. Out: for each item its result, or how it was lost. Each process has pipes of its own,
whose far ends only it holds: where it dies in the middle of a message, reading ends there and no other waits for it.
"""

from __future__ import annotations

import pickle
import signal
import sys
import time
from collections import deque
from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass
from multiprocessing import get_context, resource_tracker
from multiprocessing.connection import Connection, wait
from multiprocessing.context import SpawnProcess
from typing import Any, Literal

_CONTEXT = get_context("spawn")  # a forked copy of a process that has run numerical threads may hang
#: So many processes in a row may die before they are ready.
_FAILED_STARTS = 5
_END_S = 5.0
_POLL_S = 0.5


@dataclass(frozen=True, slots=True)
class Lost:
    """No result: the process died, took too long, could not be started, or could not send what it had.

    Attributes:
        how: which of these.
        exit_code: of the process, below 0 the signal that ended it; None where it lives.
        text: what the process said.
    """

    how: Literal["died", "late", "not started", "not sent"]
    exit_code: int | None = None
    text: str = ""


@dataclass(slots=True)
class _Worker:
    process: SpawnProcess
    connection: Connection[Any, Any]
    ready: bool = False
    index: int | None = None
    deadline: float | None = None

    def end(self) -> int:
        """Wait for it to end, kill it where it does not; its exit code."""
        self.connection.close()
        self.process.join(_END_S)
        if self.process.exitcode is None:
            self.process.kill()
            self.process.join(_END_S)
        return self.process.exitcode or 0


def results_of(
    function: Callable[..., Any],
    items: Sequence[tuple[Any, ...]],
    count: int,
    prepare: Callable[[], None],
    timeout_s: float | None = None,
) -> Generator[tuple[int, Any], None, None]:
    """Place and result, or :class:`Lost`, of each item as they come; all processes are gone when this is closed.

    Args:
        function: called with the items' arguments in a process of its own; to be imported by name.
        items: arguments.
        count: processes at a time.
        prepare: called in each new process.
        timeout_s: longest time for one item.
    """
    waiting = deque(range(len(items)))
    workers: list[_Worker] = []
    left, failed = len(items), 0
    try:
        while left:
            while len(workers) < min(count, left):
                workers.append(_start(function, prepare))
            for worker in workers:
                _give(worker, waiting, items, timeout_s)
            for worker in _heard(workers):
                message, alive = _take(worker)
                if isinstance(message, tuple):
                    left -= 1
                    yield message
                failed = 0 if worker.ready else failed + (not alive)
                if not alive:
                    workers.remove(worker)
                    worker.end()
                if failed >= _FAILED_STARTS:
                    lost = Lost("not started", worker.process.exitcode, message if isinstance(message, str) else "")
                    left -= len(waiting)
                    yield from ((waiting.popleft(), lost) for _ in range(len(waiting)))
                    failed = 0
    finally:
        for worker in workers:
            worker.process.kill()
        for worker in workers:
            worker.end()


class SteadyProcess:
    """One process for one task at a time, for as long as there are tasks: the next begins in a process that is warm."""

    def __init__(
        self, function: Callable[..., Any], prepare: Callable[[], None], timeout_s: float | None = None
    ) -> None:
        """Arguments as of :func:`results_of`; the process starts with the first task."""
        self._function, self._prepare, self._timeout_s = function, prepare, timeout_s
        self._worker: _Worker | None = None

    def run(self, arguments: tuple[Any, ...], cancelled: Callable[[], bool]) -> Any:
        """The result of one task, or :class:`Lost`; ``cancelled`` is asked twice a second and ends the process."""
        failed, waiting = 0, deque([0])
        while True:
            worker = self._worker = self._worker or _start(self._function, self._prepare)
            _give(worker, waiting, [arguments], self._timeout_s)
            spoke = wait([worker.connection, worker.process.sentinel], _POLL_S)
            if cancelled():
                self.close()
                return Lost("died", text="was ended with the audit")
            if not spoke and (worker.deadline is None or worker.deadline > time.monotonic()):
                continue
            message, alive = _take(worker)
            if not alive:
                failed += not worker.ready
                self.close()
            if isinstance(message, tuple):
                return message[1]
            if failed >= _FAILED_STARTS:
                return Lost("not started", worker.process.exitcode, message if isinstance(message, str) else "")

    def close(self) -> None:
        """End the process."""
        worker, self._worker = self._worker, None
        if worker is not None:
            worker.process.kill()
            worker.end()


def _start(function: Callable[..., Any], prepare: Callable[[], None]) -> _Worker:
    ours, theirs = _CONTEXT.Pipe()
    process = _CONTEXT.Process(target=_work, args=(theirs, function, prepare), daemon=True)
    _start_unheard(process)
    theirs.close()  # or its death would not end what is read from it
    return _Worker(process, ours)


def _start_unheard(process: SpawnProcess) -> None:
    """Start a process with SIGINT held back: a terminal sends it to all, and who does not yet ignore it shows where."""
    if sys.platform == "win32":
        process.start()
        return
    resource_tracker.ensure_running()  # started with the process, it would let the signal through
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        process.start()
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _give(worker: _Worker, waiting: deque[int], items: Sequence[tuple[Any, ...]], timeout_s: float | None) -> None:
    """Give an idle process the next item; one that has died meanwhile is found by who listens to it."""
    if not waiting or not worker.ready or worker.index is not None:
        return
    index = waiting.popleft()
    try:
        worker.connection.send((index, items[index]))
    except OSError:
        waiting.appendleft(index)
        return
    worker.index = index
    worker.deadline = None if timeout_s is None else time.monotonic() + timeout_s


def _heard(workers: Sequence[_Worker]) -> list[_Worker]:
    """Wait until processes say something, die, or are late; which."""
    deadlines = [worker.deadline for worker in workers if worker.deadline is not None]
    patience = max(0.0, min(deadlines) - time.monotonic()) if deadlines else None
    spoke = set(wait([item for w in workers for item in (w.connection, w.process.sentinel)], patience))
    now = time.monotonic()
    return [
        w
        for w in workers
        if w.connection in spoke or w.process.sentinel in spoke or (w.deadline is not None and w.deadline <= now)
    ]


def _take(worker: _Worker) -> tuple[tuple[int, Any] | str | None, bool]:
    """What a process has to say, and whether it goes on.

    Returns:
        (place, result or Lost) of an item; or why it could not be prepared; or None.
    """
    index = worker.index
    try:
        if worker.connection.poll():
            message = worker.connection.recv()
            worker.index = worker.deadline = None
            worker.ready = worker.ready or message is None
            return message, not isinstance(message, str)
    except (EOFError, OSError):
        pass  # it died, perhaps in the middle of a message
    except (pickle.UnpicklingError, AttributeError, ImportError, MemoryError, TypeError, ValueError) as error:
        worker.process.kill()
        return (None if index is None else (index, Lost("not sent", text=_said(error)))), False
    late = worker.process.is_alive() and worker.deadline is not None and worker.deadline <= time.monotonic()
    if late:
        worker.process.kill()
    exit_code = worker.end()
    if index is None:
        return None, False
    return (index, Lost("late") if late else Lost("died", exit_code)), False


def _work(connection: Connection[Any, Any], function: Callable[..., Any], prepare: Callable[[], None]) -> None:
    """What a process does until nobody gives it anything more."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # who started it hears it too, and ends it
    if sys.platform != "win32":
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})  # held back until here
    try:
        prepare()
    except Exception as error:  # noqa: BLE001 - whatever it is, the others are told in a line, not in a traceback
        connection.send(_said(error))
        sys.exit(1)
    connection.send(None)
    while True:
        try:
            index, arguments = connection.recv()
        except (EOFError, OSError):
            return
        result = function(*arguments)
        try:
            connection.send((index, result))
        except (pickle.PicklingError, AttributeError, TypeError, ValueError, MemoryError) as error:
            connection.send((index, Lost("not sent", text=_said(error))))


def _said(error: BaseException) -> str:
    return f"{type(error).__name__}: {error}"
