"""Logs that an audit finished before it was ended: taken over by ``--resume`` where none of their inputs changed.

In: a run folder. Out: its outcome, or None where the log is to be judged. A run counts as finished by the file that is
written last. It names the inputs of the run: content of the log, settings, friction, robot, and versions.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from collaudit.cli.batch.audit_one import Outcome
from collaudit.cli.batch.log_jobs import LogJob
from collaudit.cli.batch.run_note import read_note, rests_on
from collaudit.cli.fleet.remote_logs import Fetched, remote_stamp
from collaudit.core.errors import CollauditError
from collaudit.core.logs.log_hashing import sha256_of
from collaudit.reports.files.run_files import read_run
from collaudit.reports.values.entries import entry_of


def finished_outcomes(jobs: Sequence[LogJob], out: Path) -> dict[int, Outcome]:
    """Outcomes of the logs in ``out`` that need not be judged again, by their place in ``jobs``."""
    found = {index: _finished(job, out) for index, job in enumerate(jobs)}
    return {index: outcome for index, outcome in found.items() if outcome is not None}


def _finished(job: LogJob, out: Path) -> Outcome | None:
    run = out / job.folder
    note = read_note(run)
    if job.problem is not None or note is None or not (run / "report.html").is_file():
        return None
    try:
        fetched = None if job.url is None else _unchanged(job, note)
        if fetched is None and (job.url is not None or note != rests_on(job.files, sha256_of(job.files), job.loaded)):
            return None
        audit = read_run(run)
    except (CollauditError, OSError):  # whatever is wrong with it, judging the log again tells
        return None
    entry = entry_of(audit.result, f"{job.folder}/report.html")
    record = None if job.wanted is None else job.wanted.of_audit(audit, entry.judged_h)
    return Outcome(replace(entry, robot=job.robot), audit.result, record, fetched)


def _unchanged(job: LogJob, note: object) -> Fetched | None:
    """What was fetched of a remote log that is as it was, with settings as they were; None otherwise, or in doubt."""

    origin = note.get("origin") if isinstance(note, dict) else None
    if not isinstance(note, dict) or not isinstance(origin, dict) or job.url is None or job.loaded.config.log.csv.also:
        return None
    stamp = remote_stamp(job.url)
    alike = note == {**rests_on((), str(note.get("log")), job.loaded), "origin": origin}
    if not alike or origin.get("stamp") != stamp or set(stamp) <= {"size"}:
        return None
    try:
        return Fetched(**origin["fetched"])
    except (LookupError, TypeError):
        return None
