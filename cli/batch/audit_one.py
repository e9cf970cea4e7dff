"""One log of an audit of many: judged, written, and summed up; never an exception. Or taken over by ``--resume``.

A run counts as finished by a note, written after all its other files. It names content of the log, settings, friction,
robot, and versions; where none of them changed, the log is not judged again.
"""

from __future__ import annotations

import hashlib
import shlex
from collections.abc import Sequence
from contextlib import ExitStack, suppress
from dataclasses import replace
from datetime import date
from importlib.metadata import version
from pathlib import Path

from collaudit.cli.batch.log_jobs import LogJob, Outcome
from collaudit.cli.batch.remote_logs import local_copy, remote_stamp
from collaudit.cli.shared_steps import audit_files
from collaudit.core.api import LogFiles, Progress
from collaudit.core.config.load import versions
from collaudit.core.contacts.contact_states import Precedents, day_refusal
from collaudit.core.data.audit_result import AuditResult
from collaudit.core.errors import CollauditError, NotJudgedError
from collaudit.core.logs.log_reading import sha256_of
from collaudit.core.small_files import read_object, read_small
from collaudit.reports.files.run_files import CYCLES_NAME, open_run, reference_bytes, write_run
from collaudit.reports.files.written_files import atomic_write, json_text
from collaudit.reports.page.environment import ASSETS_FOLDER
from collaudit.reports.page.html import write_html
from collaudit.reports.values.entries import entry_of, entry_of_error

#: Says that all files of a run were written; the first to go and the last to come.
FINISHED = "finished.json"
_SCHEMA = "collaudit/finished/2"
#: A file of that name is no longer than this.
_MOST_BYTES = 1 << 16
_RUN_FILES = (FINISHED, "audit.json", "signals.parquet", "friction.json", CYCLES_NAME, "report.html", "overlay.html")


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
    run = out / job.folder
    if run.is_symlink():
        raise CollauditError("the run folder is a symbolic link", where=str(run), hint="remove the link")
    origin = None if job.url is None else _origin(job)
    with ExitStack() as fetched:
        files = job.files if job.url is None else (fetched.enter_context(local_copy(job.url)),)
        audit, _ = audit_files(files, job.loaded, progress, known=job.known, earlier=job.earlier)
    audit = replace(audit, result=replace(audit.result, log=replace(audit.result.log, name=job.name)))
    (run / FINISHED).unlink(missing_ok=True)
    write_run(run, audit, None)  # its friction file stands once in the audit's folder
    if audit.reference is not None:
        atomic_write(run / CYCLES_NAME, reference_bytes(audit.reference))
    write_html(run / "report.html", [open_run(run)], f"../{ASSETS_FOLDER}")
    rested = rests_on(audit.result.log.sha256 if job.url is None else origin, job)
    atomic_write(run / FINISHED, json_text({"schema": _SCHEMA, "rests_on": rested}))
    return _outcome(audit.result, job)


def _outcome(result: AuditResult, job: LogJob) -> Outcome:
    entry = entry_of(result, f"{job.folder}/report.html")
    return Outcome(replace(entry, robot=job.robot), result)


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


def read_note(run: Path) -> object:
    """The inputs that a run names; None where they cannot be read."""
    file = run / FINISHED
    if run.is_symlink() or file.is_symlink():
        return None
    content = read_object(file, _MOST_BYTES)
    return content.get("rests_on") if content.get("schema") == _SCHEMA else None


def rests_on(origin: object, job: LogJob) -> dict[str, object]:
    """The inputs of the run of a log, as they are written.

    Args:
        origin: what tells that the log was replaced.
        job: its settings, whose files count by their content, and what is known of its robot's contacts.

    Raises:
        OSError: such a file cannot be read. CollauditError: one is missing.
    """
    loaded, config = job.loaded, job.loaded.config
    named = [loaded.urdf_path, loaded.friction_path]
    other_files = [path for path in named if path is not None]
    for folder in config.log.msg_path:
        other_files += sorted(folder.rglob("*.msg"))
    return {
        "log": origin,
        "settings": loaded.sha256,
        "known": _digest(job.known),
        "cycles": [[one.version, one.night] for one in job.earlier],
        "files": [hashlib.sha256(read_small(path, 1 << 30)).hexdigest() for path in other_files],
        "versions": {"collaudit": version("collaudit"), **versions()},
    }


def _digest(known: Precedents | None) -> str | None:
    """Hash of what is known beforehand; of the day only which entries count on it."""
    if known is None:
        return None
    days = [day_refusal(entry, known.today) for entry in known.accepted]
    return hashlib.sha256(repr((replace(known, today=date.min), days)).encode("utf-8", "surrogateescape")).hexdigest()


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
        origin = _origin(job)
        if origin is None or note != rests_on(origin, job):
            return None
        result = open_run(run).result
    except (CollauditError, OSError):  # whatever is wrong with it, judging the log again tells
        return None
    return _outcome(result, job)


def _origin(job: LogJob) -> object:
    """What tells that a log was replaced: its hash, or what its store says; None where that is its size at most."""
    if job.url is None:
        return sha256_of(job.files)
    stamp = remote_stamp(job.url)
    return None if set(stamp) <= {"size"} else stamp
