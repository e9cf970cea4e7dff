"""``--fail-fast``: the first log that breaks the policy ends the audit; the logs that were left are not judged."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from collaudit.cli.batch.audit_one import Outcome
from collaudit.core.errors import NotJudgedError

if TYPE_CHECKING:
    from collaudit.cli.batch.log_jobs import LogJob
    from collaudit.core.data.audit_result import Verdict

Done = Callable[[Outcome], None]


class _PolicyBrokenError(Exception):
    """Ends the audit of many logs from within."""


def until_failure(
    jobs: Sequence[LogJob],
    verdict_of: Callable[[LogJob, Outcome], Verdict],
    audit: Callable[[Done], list[Outcome]],
    done: Done,
) -> list[Outcome]:
    """Run an audit until a log fails.

    Args:
        jobs: the logs.
        verdict_of: the decided verdict on a log.
        audit: judges them all, calls what it is given with each outcome as it comes, and stops where that raises.
        done: what else is called with each outcome.

    Returns:
        An outcome for every job; logs that were left are not judged, and say which log ended the audit.
    """
    from collaudit.reports.values.entries import entry_of_error

    of_name = {job.name: job for job in jobs}
    came: dict[str, Outcome] = {}
    failed = ""

    def look(outcome: Outcome) -> None:
        nonlocal failed
        done(outcome)
        name = outcome.entry.name
        came[name] = outcome
        if verdict_of(of_name[name], outcome) == "fail":
            failed = name
            raise _PolicyBrokenError

    try:
        return audit(look)
    except _PolicyBrokenError:
        why = f"not judged: --fail-fast ended the audit after {failed}"
        left = {name: NotJudgedError(why, where=name) for name in of_name if name not in came}
        return [
            came[job.name] if job.name in came else Outcome(entry_of_error(job.name, left[job.name], job.robot), None)
            for job in jobs
        ]
