"""Many logs judged, here or in worker processes; outcomes in the order of the logs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from collaudit.cli.batch.audit_one import Outcome, audit_one
from collaudit.cli.batch.log_jobs import Limits, LogJob
from collaudit.core.api import Progress
from collaudit.core.numeric.parallel import threads, use_threads


def audit_logs(
    jobs: Sequence[LogJob],
    out: Path,
    limits: Limits,
    progress: Progress,
    done: Callable[[Outcome], None],
) -> list[Outcome]:
    """Judge every log, some at a time.

    Args:
        jobs: the logs.
        out: folder that gets one run folder a log.
        limits: processes, time and memory; a single log takes as many threads as there may be processes.
        progress: called with (finished, total); of a single log judged here, with its reader's progress.
        done: called with each outcome as it comes.

    Returns:
        Outcomes in the order of ``jobs``.
    """
    if jobs and (limits.scheduler or limits.time_s or limits.memory_gb or min(limits.workers, len(jobs)) > 1):
        from collaudit.cli.batch.worker_processes import audit_in_processes

        return audit_in_processes(jobs, out, limits, progress, done)
    if limits.workers > threads():  # a single log: its stretches, blocks and joints are shared among the cores
        use_threads(limits.workers)
    outcomes = []
    for job in jobs:
        outcomes.append(audit_one(job, out, progress if len(jobs) == 1 else None))
        done(outcomes[-1])
        if len(jobs) > 1:
            progress(len(outcomes), len(jobs))
    return outcomes
