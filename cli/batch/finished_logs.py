"""The inputs of a finished run, written after all its other files, and runs that ``--resume`` takes over by them.

A run counts as finished by that note. It names content of the log, settings, friction, robot, and versions; where none
of them changed, the log is not judged again.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path

from collaudit.cli.batch.log_jobs import LogJob, Outcome
from collaudit.cli.fleet.remote_logs import Fetched, remote_stamp
from collaudit.core.api import LogFiles
from collaudit.core.config import LoadedConfig
from collaudit.core.errors import CollauditError
from collaudit.core.logs.log_hashing import sha256_of
from collaudit.core.logs.opening import also_files
from collaudit.core.provenance import versions
from collaudit.core.small_files import read_object, read_small
from collaudit.reports.files.atomic import atomic_write
from collaudit.reports.files.json_files import json_text
from collaudit.reports.files.run_files import read_run
from collaudit.reports.values.entries import entry_of

#: Says that all files of a run were written; the first to go and the last to come.
FINISHED = "finished.json"
_SCHEMA = "collaudit/finished/1"
#: A file of that name is no longer than this.
_MOST_BYTES = 1 << 16


def note_finished(
    run: Path, files: LogFiles, log_sha256: str, loaded: LoadedConfig, origin: Mapping[str, object] | None = None
) -> None:
    """Write down, after all its other files, the inputs of a run.

    Args:
        run: its folder.
        files, log_sha256, loaded: as of :func:`rests_on`.
        origin: of a remote log what tells that it was replaced, and what was fetched.

    Raises:
        CollauditError: it cannot be written.
    """
    rested = rests_on(files, log_sha256, loaded)
    if origin is not None:
        rested["origin"] = origin
    atomic_write(run / FINISHED, json_text({"schema": _SCHEMA, "rests_on": rested}))


def read_note(run: Path) -> object:
    """The inputs that a run names; None where they cannot be read."""
    file = run / FINISHED
    if run.is_symlink() or file.is_symlink():
        return None
    content = read_object(file, _MOST_BYTES)
    return content.get("rests_on") if content.get("schema") == _SCHEMA else None


def rests_on(files: LogFiles, log_sha256: str, loaded: LoadedConfig) -> dict[str, object]:
    """The inputs of the run of a log, as they are written.

    Args:
        files: of the log.
        log_sha256: their hash.
        loaded: settings; the files that they name count by their content.

    Raises:
        OSError: such a file cannot be read. CollauditError: one is missing.
    """
    config = loaded.config
    named = [loaded.urdf_path, loaded.friction_path]
    other_files = [path for path in named if path is not None]
    other_files += also_files(files, config.log.csv)
    for folder in config.log.msg_path:
        other_files += sorted(folder.rglob("*.msg"))
    return {
        "log": log_sha256,
        "settings": loaded.sha256,
        "files": [hashlib.sha256(read_small(path, 1 << 30)).hexdigest() for path in other_files],
        "versions": {"collaudit": version("collaudit"), **versions()},
    }


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
