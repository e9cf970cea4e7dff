"""Many logs judged: here, in worker processes, or on a cluster of Dask; outcomes in the order of the logs.

In worker processes one that dies, hangs or runs out of memory costs its own log only. A Dask worker only watches over a
process of its own, which does the task; one that is lost with its machine costs nothing, for the scheduler gives its
task to another."""

from __future__ import annotations

import logging
import os
from collections.abc import Callable, Generator, Mapping, Sequence
from contextlib import closing
from functools import partial
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from collaudit.cli.batch.audit_one import audit_one, remove_run
from collaudit.cli.batch.child_processes import Lost, results_of
from collaudit.cli.batch.log_jobs import Limits, LogJob, Outcome
from collaudit.cli.console import silence_library_warnings
from collaudit.core.api import Progress
from collaudit.core.errors import CollauditError, NotJudgedError
from collaudit.core.numeric.parallel import threads, use_threads
from collaudit.reports.values.entries import entry_of_error

#: Share of the machine's memory that workers may take together, and the least that each may, bytes.
_MEMORY_SHARE, _LEAST_MEMORY = 0.9, 2e9


def audit_logs(
    jobs: Sequence[LogJob],
    kept: Mapping[int, Outcome],
    out: Path,
    limits: Limits,
    progress: Progress,
    came: Callable[[Outcome], None],
) -> list[Outcome]:
    """Judge every log, some at a time.

    Args:
        jobs: the logs.
        kept: outcomes of those that were judged earlier, by their place.
        out: folder that gets one run folder a log.
        limits: processes, time and memory; a single log takes as many threads as there may be processes.
        progress: called with (finished, total); of a single log judged here, with its reader's progress.
        came: called with each outcome as it comes.

    Returns:
        Outcomes in the order of ``jobs``.
    """
    left = [index for index in range(len(jobs)) if index not in kept]
    outcomes = dict(kept)
    with closing(_outcomes([jobs[index] for index in left], out, limits, progress)) as results:
        for place, outcome in results:
            outcomes[left[place]] = outcome
            if len(left) > 1:
                progress(len(outcomes) - len(kept), len(left))
            came(outcome)
    return [outcomes[index] for index in range(len(jobs))]


def _outcomes(
    jobs: Sequence[LogJob], out: Path, limits: Limits, progress: Progress
) -> Generator[tuple[int, Outcome], None, None]:
    if jobs and (limits.scheduler or limits.time_s or limits.memory_gb or min(limits.workers, len(jobs)) > 1):
        return outcomes_of_processes(jobs, out, limits)
    if limits.workers > threads():  # a single log: its stretches, blocks and joints are shared among the cores
        use_threads(limits.workers)
    return ((index, audit_one(job, out, progress if len(jobs) == 1 else None)) for index, job in enumerate(jobs))


def outcomes_of_processes(
    jobs: Sequence[LogJob], out: Path, limits: Limits
) -> Generator[tuple[int, Outcome], None, None]:
    """Place and outcome of every log as it comes, judged in fresh processes, at most ``limits.workers`` at a time.

    Where this is closed before its end, the processes end, and no run is left of the logs that they had.
    """
    left = dict(enumerate(jobs))
    items = [(job, out.absolute(), None) for job in jobs]
    try:
        with closing(_results(items, limits)) as results:
            for index, result in results:
                job = left.pop(index)
                if isinstance(result, Lost):
                    remove_run(out / job.folder)
                    reason = NotJudgedError(f"not judged: {result.why}", where=job.name)
                    result = Outcome(entry_of_error(job.name, reason, job.robot), None)
                yield index, result
    finally:
        for job in left.values():
            remove_run(out / job.folder)


def _memory_gb(limits: Limits) -> float | None:
    """The bound of each worker: as stated, or where several share a machine its part of the memory."""
    if limits.memory_gb is not None or limits.workers == 1:
        return limits.memory_gb
    whole = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    return max(_LEAST_MEMORY, _MEMORY_SHARE * whole / limits.workers) / 1e9


def _results(items: Sequence[tuple[Any, ...]], limits: Limits) -> Generator[tuple[int, Any], None, None]:
    """Results of :func:`audit_one`: from processes of this program, or from those of a cluster's workers."""
    if limits.scheduler is None:
        alone = limits.workers if len(items) == 1 else 1  # of a single log all threads that were asked for
        prepare = partial(_begin_worker, _memory_gb(limits), None if limits.workers == 1 else alone)
        return results_of(audit_one, items, limits.workers, prepare, limits.time_s)
    if find_spec("distributed") is None:
        raise CollauditError(
            "a cluster needs Dask", where="--scheduler", hint="python -m pip install 'collaudit[fleet]'"
        )
    begin = partial(_begin_worker, _memory_gb(limits), 1)
    return results_on_dask(audit_one, items, begin, limits.time_s, limits.scheduler)


def _begin_worker(memory_gb: float | None, threads: int | None) -> None:
    """Prepare a process: its threads, and its share of memory."""
    if threads is not None:
        use_threads(threads)
    silence_library_warnings()
    os.environ.setdefault("OMP_NUM_THREADS", "1")  # more threads would only fight with the other workers
    if memory_gb is not None:
        import resource

        limit = int(memory_gb * 1e9)
        resource.setrlimit(resource.RLIMIT_DATA, (limit, limit))


_CONNECT_S = "10s"
_GONE = "it was lost with its worker, again and again"
_SILENT = logging.CRITICAL + 1  # what a reader of the audit's stderr needs is said by the audit


def results_on_dask(
    function: Callable[..., Any],
    items: Sequence[tuple[Any, ...]],
    prepare: Callable[[], None],
    timeout_s: float | None,
    scheduler: str,
) -> Generator[tuple[int, Any], None, None]:
    """Place and result, or :class:`Lost`, of each item as they come; what still runs is ended when this is closed.

    Args:
        function: called with the items' arguments in processes of the workers; to be imported by name, also there.
        items: arguments.
        prepare: called in each new process before; pickled for the workers.
        timeout_s: longest time for one item.
        scheduler: address of the cluster's scheduler.

    Raises:
        CollauditError: the scheduler cannot be reached, or Dask is not installed.
    """
    logging.getLogger("distributed").setLevel(_SILENT)
    as_completed = _dask().as_completed
    with closing(_cluster(scheduler)) as client:
        run = partial(_on_worker, function, prepare, timeout_s)
        futures = {client.submit(run, item, pure=False): index for index, item in enumerate(items)}
        try:
            for future in as_completed(list(futures), loop=client.loop):
                index = futures.pop(future)
                done = future.status == "finished"
                yield index, future.result() if done else Lost(f"{_GONE} ({type(future.exception()).__name__})")
                future.release()
        finally:
            client.cancel([future for future in futures if future.status == "pending"], force=True)


def _dask() -> Any:
    """The library, which is imported late and types only a part of itself."""
    return import_module("distributed")


def _cluster(scheduler: str) -> Any:
    try:
        return _dask().Client(scheduler, timeout=_CONNECT_S, set_as_default=False)
    except (OSError, ValueError, TimeoutError) as error:
        raise CollauditError(
            "the scheduler cannot be reached",
            where="--scheduler",
            found=f"{scheduler}: {error}",
            expected="the address of a running one, such as tcp://host:8786",
            hint="dask scheduler; and on each machine: dask worker ADDRESS --nthreads 1 --no-nanny",
        ) from error


def _on_worker(
    function: Callable[..., Any],
    prepare: Callable[[], None],
    timeout_s: float | None,
    arguments: tuple[Any, ...],
) -> Any:
    """One task, in the thread of a Dask worker."""
    worker, key = _dask().get_worker(), import_module("distributed.worker").thread_state.key

    def cancelled() -> bool:
        task = worker.state.tasks.get(key)
        return task is None or task.state in ("cancelled", "released", "forgotten")

    try:
        with closing(results_of(function, [arguments], 1, prepare, timeout_s, cancelled)) as results:
            return next(results)[1]
    except AssertionError as error:  # of multiprocessing: a daemon may not start processes
        hint = "start workers with --no-nanny, or with DASK_DISTRIBUTED__WORKER__DAEMON=False"
        return Lost(f"no process could be started to judge it ({error}; {hint})")
