"""Logs judged in worker processes: one that dies, hangs or runs out of memory costs its own log only.

In: jobs and limits. Out: outcomes. Pebble keeps the pool: it alone of the well-kept ones says which task a dead worker
had, replaces the worker, and ends a task at its time.
"""

from __future__ import annotations

import os
import signal
import threading
import time
from collections.abc import Callable, Sequence
from concurrent.futures import Future, as_completed
from importlib import import_module
from multiprocessing import get_context
from pathlib import Path
from typing import TYPE_CHECKING

from pebble import ProcessExpired, ProcessPool

from collaudit.cli.batch.audit_one import Outcome, audit_one, remove_run
from collaudit.cli.batch.log_jobs import Limits, LogJob
from collaudit.cli.console import silence_library_warnings
from collaudit.core.api import Progress
from collaudit.core.errors import NotJudgedError

if TYPE_CHECKING:
    from collaudit.core.config import LoadedConfig

_PARENT_POLL_S = 1.0
_NEEDED = ("collaudit.core.audit", "collaudit.reports.files.signals_file", "collaudit.reports.page.html")


def audit_in_processes(
    jobs: Sequence[LogJob],
    loaded: LoadedConfig,
    out: Path,
    limits: Limits,
    progress: Progress,
    done: Callable[[Outcome], None],
) -> list[Outcome]:
    """Judge every log in fresh processes, at most ``limits.workers`` at a time.

    Args:
        jobs: the logs.
        loaded: effective configuration.
        out: folder that gets one run folder a log.
        limits: processes, time and memory.
        progress: called with (finished, total).
        done: called with each outcome as it comes.

    Returns:
        Outcomes in the order of ``jobs``.
    """
    outcomes: dict[int, Outcome] = {}
    pool = ProcessPool(
        min(limits.workers, len(jobs)),
        context=get_context("spawn"),  # a forked copy of a process that has run numerical threads may hang
        initializer=_begin_worker,
        initargs=[os.getpid(), limits.memory_gb],
    )
    try:
        futures: dict[Future[Outcome], int] = {
            pool.schedule(audit_one, args=[*job, loaded, out, None], timeout=limits.time_s): index
            for index, job in enumerate(jobs)
        }
        for future in as_completed(futures):
            index = futures[future]
            outcomes[index] = _outcome(future, jobs[index], out, limits)
            done(outcomes[index])
            progress(len(outcomes), len(jobs))
        pool.close()  # type: ignore[no-untyped-call]
    except BaseException:
        pool.stop()  # type: ignore[no-untyped-call]
        pool.join()
        for index, job in enumerate(jobs):
            if index not in outcomes:
                remove_run(out / job.folder)
        raise
    pool.join()
    return [outcomes[index] for index in range(len(jobs))]


def _outcome(future: Future[Outcome], job: LogJob, out: Path, limits: Limits) -> Outcome:
    from collaudit.reports.values.entries import entry_of_error

    try:
        outcome = future.result()
    except TimeoutError:
        reason = f"it took longer than the {limits.time_s:g} s that --timeout allows"
    except ProcessExpired as error:
        reason = f"the process that judged it {_cause_of_death(error.exitcode, limits)}"
    except Exception as error:  # noqa: BLE001 - the outcome could not be sent; the log's files cannot be relied on
        reason = f"its result could not be received ({type(error).__name__}: {error})"
    else:
        return outcome
    remove_run(out / job.folder)
    return Outcome(entry_of_error(job.name, NotJudgedError(f"not judged: {reason}", where=job.name)), None)


def _cause_of_death(exit_code: int, limits: Limits) -> str:
    if exit_code >= 0:
        return f"ended with exit code {exit_code}"
    number = -exit_code
    name = signal.Signals(number).name if number in set(signal.Signals) else f"signal {number}"
    if number == signal.SIGKILL:
        return f"was killed ({name}); the system does this when memory runs out"
    if number == signal.SIGABRT and limits.memory_gb:
        return f"gave up ({name}), which libraries do at the memory limit of {limits.memory_gb:g} GB"
    return f"was ended by {name}"


def _begin_worker(parent: int, memory_gb: float | None) -> None:
    """Prepare a worker: one thread, its share of memory, and an end when the audit has ended."""
    silence_library_warnings()
    os.environ.setdefault("OMP_NUM_THREADS", "1")  # more threads would only fight with the other workers
    if memory_gb is not None:
        import resource

        limit = int(memory_gb * 1e9)
        resource.setrlimit(resource.RLIMIT_DATA, (limit, limit))
    for module in _NEEDED:
        import_module(module)  # so that the first log's time is its own
    threading.Thread(target=_end_with, args=(parent,), daemon=True).start()


def _end_with(parent: int) -> None:
    """End this process once its parent is gone, however the parent was killed: no orphan goes on writing."""
    while os.getppid() == parent:
        time.sleep(_PARENT_POLL_S)
    os._exit(1)
