"""One log of an audit of many: judged, written, and summed up; never an exception."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

from collaudit.cli.batch.finished_logs import FINISHED, note_finished
from collaudit.cli.batch.log_jobs import LogJob, Outcome
from collaudit.cli.fleet.remote_logs import fetched_of, local_copy, remote_stamp
from collaudit.cli.log_arguments import audit_files
from collaudit.core.api import LogFiles, Progress
from collaudit.core.errors import CollauditError, NotJudgedError
from collaudit.reports.files.run_folder import write_run
from collaudit.reports.page.html import write_html
from collaudit.reports.page.scripts import ASSETS_FOLDER
from collaudit.reports.values.entries import entry_of, entry_of_error

_RUN_FILES = (FINISHED, "audit.json", "signals.parquet", "friction.json", "report.html")


def audit_one(job: LogJob, out: Path, progress: Progress | None) -> Outcome:
    """Judge one log and write its run and report into its folder in ``out``.

    Whatever happens to one log is that log's "not judged", with its one message: a bug that its content brings
    to light must not end a night's audit. The message says how to see its traceback.

    Args:
        job: the log.
        out: folder of the whole audit.
        progress: of reading.
    """
    run, name = out / job.folder, job.name
    try:
        return _judged(job, out, progress)
    except CollauditError as error:
        reason = error
    except MemoryError as error:
        reason = NotJudgedError("not enough memory for this log", where=name, found=str(error) or None)
    except Exception as error:  # noqa: BLE001 - one log's bug is that log's, said as such
        reason = _bug(error, job.files, name)
    remove_run(run)
    return Outcome(entry_of_error(name, reason, job.robot), None)


def _judged(job: LogJob, out: Path, progress: Progress | None) -> Outcome:
    if job.problem is not None:
        raise job.problem
    if job.url is None:
        return _written(job, job.files, out, progress)
    stamp = remote_stamp(job.url)
    with local_copy(job.url, job.loaded.config.log.remote) as file:
        return _written(job, (file,), out, progress, stamp)


def _written(
    job: LogJob, files: LogFiles, out: Path, progress: Progress | None, stamp: Mapping[str, str] | None = None
) -> Outcome:
    """Judge files and write the run; ``stamp`` is what tells that a remote log was replaced."""
    run = out / job.folder
    if run.is_symlink():
        raise CollauditError("the run folder is a symbolic link", where=str(run), hint="remove the link")
    audit, friction = audit_files(files, job.loaded, progress)
    audit = replace(audit, result=replace(audit.result, log=replace(audit.result.log, name=job.name)))
    (run / FINISHED).unlink(missing_ok=True)
    write_run(run, audit, friction)
    write_html(run / "report.html", [audit], f"../{ASSETS_FOLDER}")
    fetched = None if stamp is None else fetched_of(files[0])
    origin = None if fetched is None else {"stamp": stamp, "fetched": fetched._asdict()}
    note_finished(run, files, audit.result.log.sha256, job.loaded, origin)
    entry = entry_of(audit.result, f"{job.folder}/report.html")
    record = None if job.wanted is None else job.wanted.of_audit(audit, entry.judged_h)
    return Outcome(replace(entry, robot=job.robot), audit.result, record, fetched)


def _bug(error: Exception, files: LogFiles, name: str) -> NotJudgedError:
    command = shlex.join(["collaudit", "--debug", "detect", *map(str, files)])
    return NotJudgedError(
        "an unexpected error: this log was not judged",
        where=name,
        found=f"{type(error).__name__}: {error}",
        hint=f"this is a bug; please report it with the output of: {command} -c CONFIG",
    )


def remove_run(run: Path) -> None:
    """Take away a run's files: they would stand for a log that was not judged now.

    Args:
        run: the run folder; where it is a link, or absent, nothing is touched.
    """
    if run.is_symlink() or not run.is_dir():
        return
    for name in _RUN_FILES:
        (run / name).unlink(missing_ok=True)
        for part in run.glob(f".{name}.*.part"):  # left by a process that was killed while it wrote
            part.unlink(missing_ok=True)
    with suppress(OSError):  # other files in it are not ours
        run.rmdir()
