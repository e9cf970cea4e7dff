"""Many logs judged, here or in worker processes; outcomes in the order of the logs.

In worker processes one that dies, hangs or runs out of memory costs its own log only.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Generator, Mapping, Sequence
from contextlib import closing
from functools import partial
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
    from collaudit.cli.batch.dask_workers import results_on_dask

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
