"""The logs of an audit beside earlier ones: an overlay of each with contacts, and what changed in each program."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from collaudit.cli.batch.log_jobs import LogJob, Outcome
from collaudit.cli.fleet.precedents import audits_in
from collaudit.cli.log_arguments import audit_files
from collaudit.core.api import load_robot
from collaudit.core.causes.program_change import compare_programs
from collaudit.core.contacts.contact_states import program_of
from collaudit.core.data.audit_result import AUDIT_SCHEMA, Audit, AuditResult
from collaudit.core.data.cycles_result import ProgramComparison
from collaudit.reports.files.atomic import atomic_write
from collaudit.reports.files.json_files import read_result
from collaudit.reports.files.run_files import AUDIT_NAME, SIGNALS_NAME, read_run
from collaudit.reports.page.overlay_page import overlay_page

OVERLAY_NAME = "overlay.html"


def write_overlays(out: Path, jobs: Sequence[LogJob], outcomes: Sequence[Outcome], baseline: Path) -> dict[str, str]:
    """Lay the residual of each log with contacts over that of the log of its name in an earlier audit.

    Args:
        out: folder of the audit.
        jobs, outcomes: of the audit, in one order.
        baseline: folder of the earlier audit; logs whose signals it does not have get no page.

    Returns:
        Links, relative to ``out``, by name of log.

    Raises:
        CollauditError: a run cannot be read, or a page not be written.
    """
    links = {}
    for job, outcome in zip(jobs, outcomes, strict=True):
        earlier = baseline / job.folder
        if outcome.result is None or not outcome.result.contacts or not (earlier / SIGNALS_NAME).is_file():
            continue
        page = overlay_page(read_run(out / job.folder), read_run(earlier), "residual")
        atomic_write(out / job.folder / OVERLAY_NAME, page)
        links[job.name] = f"{job.folder}/{OVERLAY_NAME}"
    return links


def changes_since(
    out: Path, jobs: Sequence[LogJob], outcomes: Sequence[Outcome], against: Path
) -> tuple[ProgramComparison, ...]:
    """What changed in each log's program since an earlier audit, run or log.

    Args:
        out: folder of the audit.
        jobs, outcomes: of it, in one order.
        against: folder of an audit, whose logs are found by their program; a run, or a log, for every log.

    Raises:
        CollauditError: nothing can be read there.
    """
    earlier = _earlier(against)
    made = []
    for job, outcome in zip(jobs, outcomes, strict=True):
        if outcome.result is None:
            continue
        old = earlier(job)
        if old is None:
            made.append(ProgramComparison(job.name, "", (0, 0), reason=f"{against} has no log of this program"))
            continue
        new = read_run(out / job.folder)
        made.append(compare_programs(old, new, load_robot(job.loaded, new.signals.joint_names)))
    return tuple(made)


def _earlier(against: Path) -> Callable[[LogJob], Audit | None]:
    """What finds the earlier log of a job."""
    if against.is_file() and against.name != AUDIT_NAME:
        return lambda job: audit_files((against,), job.loaded)[0]
    runs = [file.parent for file, _ in audits_in(against)]
    programs = {program_of(read_result(run / AUDIT_NAME, AuditResult, AUDIT_SCHEMA).log.name): run for run in runs}

    def of_program(job: LogJob) -> Audit | None:
        run = runs[0] if len(runs) == 1 else programs.get(program_of(job.name))
        return None if run is None else read_run(run)

    return of_program
