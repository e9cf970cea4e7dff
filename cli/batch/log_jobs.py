"""The logs of an audit, what is to be recorded of each, and the limits they are judged under."""

from __future__ import annotations

from dataclasses import dataclass
from importlib.metadata import version
from typing import TYPE_CHECKING, NamedTuple

from collaudit.core.api import LogFiles
from collaudit.core.data.audit_result import Audit
from collaudit.core.errors import CollauditError
from collaudit.core.history.log_record import LogRecord, NightFrom
from collaudit.core.history.record_of_audit import record_of, unread_record

if TYPE_CHECKING:
    from collaudit.core.config import LoadedConfig


@dataclass(frozen=True, slots=True)
class RecordWanted:
    """That records are to be made: whose logs they are, and the night they count to.

    Attributes:
        robot: name of the robot.
        night: ISO date, None: of the log's first stamp in UTC, else ``today``.
        today: date of the audit.
    """

    robot: str
    night: str | None
    today: str

    def of_audit(self, audit: Audit, judged_h: float) -> LogRecord:
        """The record of an audit."""
        night, source = self._night(audit.result.log.start)
        return record_of(audit, self.robot, night, source, judged_h)

    def of_unread(self, files: LogFiles, name: str, error: str) -> LogRecord:
        """The record of a log that could not be audited, and why."""
        from collaudit.core.logs.log_hashing import sha256_of

        try:
            digest = sha256_of(files) if files else None
        except (CollauditError, OSError, ValueError):
            digest = None
        night, source = self._night(None)
        return unread_record(self.robot, night, source, name, digest, error, version("collaudit"))

    def _night(self, start: str | None) -> tuple[str, NightFrom]:
        if self.night is not None:
            return self.night, "stated"
        return (start[:10], "log") if start else (self.today, "audit")


class LogJob(NamedTuple):
    """One log of an audit.

    Attributes:
        files: of the log; none where it was not found, or is remote.
        name: what all files of the audit call it, unique among its logs.
        folder: name of its run folder.
        loaded: its effective configuration.
        robot: whose log it is, None without a fleet.
        problem: why it cannot be judged, where that is known beforehand.
        wanted: what is to be recorded of it for a store, if anything.
        url: where a remote log is fetched from.
    """

    files: LogFiles
    name: str
    folder: str
    loaded: LoadedConfig
    robot: str | None = None
    problem: CollauditError | None = None
    wanted: RecordWanted | None = None
    url: str | None = None


@dataclass(frozen=True, slots=True)
class Limits:
    """How logs may be judged: processes at a time, and seconds and GB (10⁹ bytes) a log, None for no limit.

    ``scheduler``: address of the cluster that they are judged on, None for this machine.
    """

    workers: int = 1
    time_s: float | None = None
    memory_gb: float | None = None
    scheduler: str | None = None
