"""Many logs judged, here or in worker processes; outcomes in the order of the logs."""

from __future__ import annotations

from collections.abc import Callable, Generator, Mapping, Sequence
from contextlib import closing
from pathlib import Path

from collaudit.cli.batch.audit_one import Outcome, audit_one
from collaudit.cli.batch.log_jobs import Limits, LogJob
from collaudit.cli.batch.worker_processes import outcomes_of_processes
from collaudit.core.api import Progress
from collaudit.core.errors import NotJudgedError
from collaudit.core.numeric.parallel import threads, use_threads
from collaudit.reports.values.entries import entry_of_error


def audit_logs(
    jobs: Sequence[LogJob],
    kept: Mapping[int, Outcome],
    out: Path,
    limits: Limits,
    progress: Progress,
    came: Callable[[LogJob, Outcome], bool],
) -> list[Outcome]:
    """Judge every log, some at a time.

    Args:
        jobs: the logs.
        kept: outcomes of those that were judged earlier, by their place.
        out: folder that gets one run folder a log.
        limits: processes, time and memory; a single log takes as many threads as there may be processes.
        progress: called with (finished, total); of a single log judged here, with its reader's progress.
        came: called with each log and its outcome as it comes; True ends the audit, and the logs that are left are not
            judged, and say which log ended it.

    Returns:
        Outcomes in the order of ``jobs``.
    """
    left = [index for index in range(len(jobs)) if index not in kept]
    outcomes, last = dict(kept), ""
    with closing(_outcomes([jobs[index] for index in left], out, limits, progress)) as results:
        for place, outcome in results:
            outcomes[left[place]] = outcome
            if len(left) > 1:
                progress(len(outcomes) - len(kept), len(left))
            if came(jobs[left[place]], outcome):
                last = outcome.entry.name
                break
    return [outcomes[index] if index in outcomes else _left(job, last) for index, job in enumerate(jobs)]


def _outcomes(
    jobs: Sequence[LogJob], out: Path, limits: Limits, progress: Progress
) -> Generator[tuple[int, Outcome], None, None]:
    """Place and outcome of each log as it comes."""
    if jobs and (limits.scheduler or limits.time_s or limits.memory_gb or min(limits.workers, len(jobs)) > 1):
        return outcomes_of_processes(jobs, out, limits)
    if limits.workers > threads():  # a single log: its stretches, blocks and joints are shared among the cores
        use_threads(limits.workers)
    return ((index, audit_one(job, out, progress if len(jobs) == 1 else None)) for index, job in enumerate(jobs))


def _left(job: LogJob, last: str) -> Outcome:
    reason = NotJudgedError(f"not judged: --fail-fast ended the audit after {last}", where=job.name)
    return Outcome(entry_of_error(job.name, reason, job.robot), None)
