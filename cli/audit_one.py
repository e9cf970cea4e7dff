"""One log of an audit of many: judged, written, and summed up; never an exception."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from collaudit.core.errors import CollauditError, NotJudgedError

if TYPE_CHECKING:
    from collaudit.core.api import LogFiles, Progress
    from collaudit.core.config import LoadedConfig
    from collaudit.core.data.audit_result import AuditResult
    from collaudit.reports.values.entries import IndexEntry

_RUN_FILES = ("audit.json", "signals.parquet", "friction.json", "report.html")


@dataclass(frozen=True, slots=True)
class Outcome:
    """What became of one log: its line in the index, and its result unless it could not be judged."""

    entry: IndexEntry
    result: AuditResult | None


def audit_one(
    files: LogFiles, name: str, folder: str, loaded: LoadedConfig, out: Path, progress: Progress | None
) -> Outcome:
    """Judge one log and write its run and report into ``out / folder``.

    A log that cannot be judged gives an outcome with its one message, and leaves no files of an earlier run.

    Args:
        files: of the log.
        name: what the index calls it.
        folder: its run folder.
        loaded: effective configuration.
        out: folder of the whole audit.
        progress: of reading.

    Raises:
        CollauditError: the outputs cannot be written; then no other log's could be.
    """
    from dataclasses import replace

    from collaudit.cli.log_arguments import audit_files
    from collaudit.reports.files.run_files import write_run
    from collaudit.reports.page.html import write_html
    from collaudit.reports.values.entries import entry_of, entry_of_error

    run = out / folder
    try:
        audit, friction = audit_files(files, loaded, progress)
    except CollauditError as error:
        _remove_old(run)
        return Outcome(entry_of_error(name, error), None)
    except MemoryError:
        _remove_old(run)
        return Outcome(entry_of_error(name, NotJudgedError("not enough memory for this log", where=name)), None)
    write_run(run, audit, friction)
    write_html(run / "report.html", [audit])
    return Outcome(replace(entry_of(audit.result, f"{folder}/report.html"), name=name), audit.result)


def _remove_old(run: Path) -> None:
    """Take away an earlier run's files, which would stand for a log that was not judged now."""
    for name in _RUN_FILES:
        (run / name).unlink(missing_ok=True)
