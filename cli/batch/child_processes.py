"""One process a task, of the standard library: one that dies or takes too long costs its own task.

In: a function and its items. Out: for each item its result, or how it was lost. Processes are forks of a server that
has the imports already (``forkserver``), so that each begins at once, with nothing left by another.
"""

from __future__ import annotations

import multiprocessing
import os
import pickle
import signal
import threading
import time
from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection, wait
from multiprocessing.context import ForkServerProcess
from typing import Any

from collaudit.core.numeric.linear_algebra import one_thread_of_linear_algebra

_CONTEXT = multiprocessing.get_context("forkserver")
#: What judging a log, whatever its format, imports sooner or later: once in the server, not once a log.
_PRELOADED = (
    "collaudit.cli.batch.audit_one",
    "collaudit.core.audit",
    "collaudit.core.logs.tables.csv_table",
    "collaudit.core.logs.messages.mcap_file",
    "collaudit.core.logs.messages.bag_file",
    "collaudit.core.logs.messages.ros2_bag",
    "collaudit.core.logs.tables.table_reading",
    "collaudit.core.logs.topics.message_reading",
    "collaudit.reports.files.signals_file",
    "collaudit.reports.page.html",
    "rosbags.typesys",
    "scipy.signal",
)
_POLL_S, _END_S = 0.5, 5.0
#: What cannot be sent, or is no whole message here.
_UNSENT = (pickle.PicklingError, AttributeError, ImportError, MemoryError, TypeError, ValueError)


@dataclass(frozen=True, slots=True)
class Lost:
    """No result: the process died, took too long, could not be started, or could not send what it had; and why."""

    why: str


@dataclass(frozen=True, slots=True)
class _Child:
    """A process and the place of its item; ``until`` in s of :func:`time.monotonic`, None for ever."""

    index: int
    process: ForkServerProcess
    until: float | None


def results_of(
    function: Callable[..., Any],
    items: Sequence[tuple[Any, ...]],
    count: int,
    prepare: Callable[[], None],
    timeout_s: float | None = None,
    cancelled: Callable[[], bool] = bool,
) -> Generator[tuple[int, Any], None, None]:
    """Place and result, or :class:`Lost`, of each item as they come; all processes are gone when this is closed.

    Args:
        function: called with the items' arguments in a process of its own; to be imported by name.
        items: arguments.
        count: processes at a time.
        prepare: called in each process before.
        timeout_s: longest time for one item.
        cancelled: asked twice a second; where it says so, what is left is lost.
    """
    waiting = list(enumerate(items))[::-1]
    running: dict[Connection[Any, Any], _Child] = {}
    try:
        while waiting or running:
            while waiting and len(running) < count:
                index, arguments = waiting.pop()
                begun = _begin(index, function, arguments, prepare, timeout_s)
                if isinstance(begun, Lost):
                    yield index, begun
                else:
                    running[begun[0]] = begun[1]
            spoke = wait(list(running), _POLL_S)
            over, now = cancelled(), time.monotonic()
            for connection, child in list(running.items()):
                if connection in spoke:
                    result = _heard(connection, child.process)
                elif over:
                    result = Lost("it was ended with the audit")
                elif child.until is not None and child.until <= now:
                    result = Lost(f"it took longer than the {timeout_s:g} s that --timeout allows")
                else:
                    continue
                del running[connection]
                _end(connection, child.process)
                yield child.index, result
    finally:
        for connection, child in running.items():
            _end(connection, child.process)


def _begin(
    index: int,
    function: Callable[..., Any],
    arguments: tuple[Any, ...],
    prepare: Callable[[], None],
    timeout_s: float | None,
) -> tuple[Connection[Any, Any], _Child] | Lost:
    """A process that does one item; SIGINT is held back in it, which a terminal sends to all."""
    _CONTEXT.set_forkserver_preload(["__main__", *_PRELOADED])
    one_thread_of_linear_algebra()  # whoever starts them: a worker of a cluster asks for none
    resource_tracker.ensure_running()  # started with the process, it would let the signal through
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})  # the server hands it on to its forks
    ours, theirs = _CONTEXT.Pipe(duplex=False)
    process = _CONTEXT.Process(target=_work, args=(theirs, function, arguments, prepare), daemon=True)
    try:
        process.start()
    except (OSError, EOFError, *_UNSENT) as error:
        ours.close()
        return _not_started(error)
    finally:
        theirs.close()  # or its death would not end what is read from it
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
    return ours, _Child(index, process, None if timeout_s is None else time.monotonic() + timeout_s)


def _heard(connection: Connection[Any, Any], process: ForkServerProcess) -> Any:
    """The result of a process that spoke, or died, perhaps in the middle of a message."""
    try:
        return connection.recv()
    except _UNSENT as error:
        return _not_sent(error)
    except (EOFError, OSError):
        process.join(_END_S)
        return Lost(f"the process that judged it {_cause_of_death(process.exitcode or 0)}")


def _end(connection: Connection[Any, Any], process: ForkServerProcess) -> None:
    process.kill()
    process.join(_END_S)
    connection.close()


def _work(
    connection: Connection[Any, Any],
    function: Callable[..., Any],
    arguments: tuple[Any, ...],
    prepare: Callable[[], None],
) -> None:
    """What a process does: its item, and say what came of it."""
    threading.Thread(target=_end_with_parent, daemon=True).start()
    try:
        prepare()
    except Exception as error:  # noqa: BLE001 - whatever it is, it is told in a line, not in a traceback
        connection.send(_not_started(error))
        return
    result = function(*arguments)
    try:
        connection.send(result)
    except _UNSENT as error:
        connection.send(_not_sent(error))


def _end_with_parent() -> None:
    """End this process once the audit is gone, however it was killed: no orphan goes on writing."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def _not_started(error: BaseException) -> Lost:
    return Lost(f"no process could be started to judge it ({type(error).__name__}: {error})")


def _not_sent(error: BaseException) -> Lost:
    return Lost(f"its result could not be received ({type(error).__name__}: {error})")


def _cause_of_death(exit_code: int) -> str:
    if exit_code >= 0:
        return f"ended with exit code {exit_code}"
    number = -exit_code
    name = signal.Signals(number).name if number in set(signal.Signals) else f"signal {number}"
    if number == signal.SIGKILL:
        return f"was killed ({name}); the system does this when memory runs out"
    return f"was ended by {name}" + (", which libraries do at a memory limit" if number == signal.SIGABRT else "")
