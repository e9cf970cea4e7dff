"""Processes that do one task after another; one that dies or takes too long costs the task it had, whenever that is.

In: a function and its items. Out: for each item its result, or how it was lost. Each process has a pipe of its own,
whose far end only it holds: where it dies in the middle of a message, reading ends there and no other waits for it.
"""

from __future__ import annotations

import pickle
import signal
import sys
import threading
import time
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass
from multiprocessing import get_context, resource_tracker
from multiprocessing.connection import Connection, wait
from multiprocessing.context import SpawnProcess
from queue import SimpleQueue
from typing import Any, Literal

_CONTEXT = get_context("spawn")  # a forked copy of a process that has run numerical threads may hang
#: So many processes in a row may die before they are ready.
_FAILED_STARTS = 5
_WITH_THE_AUDIT = "was ended with the audit"
_END_S = 5.0
_POLL_S = 0.5
#: What reading a message raises of one that came whole, and holds what cannot be made here.
_UNREADABLE = (pickle.UnpicklingError, AttributeError, ImportError, MemoryError, TypeError, ValueError)
#: Processes are started and waited for one at a time: each start of one looks whether others have ended.
_CHILDREN = threading.Lock()


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
    over = threading.Event()
    processes = [SteadyProcess(function, prepare, timeout_s) for _ in range(max(1, min(count, len(items))))]
    idle: SimpleQueue[SteadyProcess] = SimpleQueue()
    for process in processes:
        idle.put(process)

    def result(arguments: tuple[Any, ...]) -> Any:
        process = idle.get()
        try:
            return process.run(arguments, over.is_set)
        finally:
            idle.put(process)

    try:
        with ThreadPoolExecutor(len(processes)) as watchers:
            futures = {watchers.submit(result, item): index for index, item in enumerate(items)}
            try:
                for future in as_completed(futures):
                    yield futures[future], future.result()
            finally:
                over.set()
                watchers.shutdown(cancel_futures=True)
    finally:
        for process in processes:
            process.close()


class SteadyProcess:
    """One process for one task at a time, for as long as there are tasks: the next begins in a process that is warm."""

    def __init__(
        self, function: Callable[..., Any], prepare: Callable[[], None], timeout_s: float | None = None
    ) -> None:
        """Arguments as of :func:`results_of`; the process starts with the first task."""
        self._function, self._prepare, self._timeout_s = function, prepare, timeout_s
        self._process: SpawnProcess | None = None
        self._connection: Connection[Any, Any]
        self._failed: list[Lost] = []

    def run(self, arguments: tuple[Any, ...], cancelled: Callable[[], bool]) -> Any:
        """The result of one task, or :class:`Lost`; ``cancelled`` is asked twice a second and ends the process."""
        if self._process is not None and wait([self._process.sentinel], 0):
            self._end()  # since its last task
        while self._process is None:
            if len(self._failed) >= _FAILED_STARTS or cancelled():
                return self._failed[-1] if self._failed else Lost("died", text=_WITH_THE_AUDIT)
            self._start(cancelled)
        deadline = None if self._timeout_s is None else time.monotonic() + self._timeout_s
        try:
            self._connection.send(arguments)
        except OSError:
            return Lost("died", self._end())
        return self._heard(self._process, deadline, cancelled)

    def close(self) -> None:
        """End the process."""
        if self._process is not None:
            self._process.kill()
            self._end()

    def _start(self, cancelled: Callable[[], bool]) -> None:
        """Start the process and wait until it is ready for a task; one that is not adds to those that failed."""
        self._connection, theirs = _CONTEXT.Pipe()
        process = _CONTEXT.Process(target=_work, args=(theirs, self._function, self._prepare), daemon=True)
        with _CHILDREN:
            _start_unheard(process)
        self._process = process
        theirs.close()  # or its death would not end what is read from it
        said = self._heard(process, None, cancelled)
        if said is None:
            self._failed.clear()
        elif isinstance(said, Lost):
            self._failed.append(Lost("not started", said.exit_code, said.text))
        else:
            self._failed.append(Lost("not started", self._end(), said))

    def _heard(self, process: SpawnProcess, deadline: float | None, cancelled: Callable[[], bool]) -> Any:
        """What the process says next; or how it was lost, and then it is ended."""
        lost: Lost | None = None
        while lost is None:
            left = _POLL_S if deadline is None else max(0.0, min(_POLL_S, deadline - time.monotonic()))
            spoke = wait([self._connection, process.sentinel], left)
            if cancelled():
                lost = Lost("died", text=_WITH_THE_AUDIT)
            elif self._connection in spoke:
                try:
                    return self._connection.recv()
                except (EOFError, OSError):
                    break  # it died, perhaps in the middle of a message
                except _UNREADABLE as error:
                    lost = Lost("not sent", text=_said(error))
            elif spoke:
                break
            elif deadline is not None and deadline <= time.monotonic():
                lost = Lost("late")
        if lost is not None:
            process.kill()
        exit_code = self._end()
        return lost or Lost("died", exit_code)

    def _end(self) -> int:
        """Wait for the process to end, kill it where it does not; its exit code."""
        process, self._process = self._process, None
        assert process is not None
        self._connection.close()
        if not wait([process.sentinel], _END_S):
            process.kill()
        with _CHILDREN:
            process.join(_END_S)
            return process.exitcode or 0


def _start_unheard(process: SpawnProcess) -> None:
    """Start a process with SIGINT held back: a terminal sends it to all, and who does not yet ignore it shows where."""
    resource_tracker.ensure_running()  # started with the process, it would let the signal through
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        process.start()
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _work(connection: Connection[Any, Any], function: Callable[..., Any], prepare: Callable[[], None]) -> None:
    """What a process does until nobody gives it anything more: it says None when it is ready, or why it is not."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # who started it hears it too, and ends it
    signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})  # held back until here
    try:
        prepare()
    except Exception as error:  # noqa: BLE001 - whatever it is, the others are told in a line, not in a traceback
        connection.send(_said(error))
        sys.exit(1)
    connection.send(None)
    while True:
        try:
            arguments = connection.recv()
        except (EOFError, OSError):
            return
        result = function(*arguments)
        try:
            connection.send(result)
        except (pickle.PicklingError, AttributeError, TypeError, ValueError, MemoryError) as error:
            connection.send(Lost("not sent", text=_said(error)))


def _said(error: BaseException) -> str:
    return f"{type(error).__name__}: {error}"
