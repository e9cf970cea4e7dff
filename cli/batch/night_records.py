"""What an audit adds to a store: the record of every log, made where its signals are at hand."""

from __future__ import annotations

from dataclasses import dataclass

from collaudit.core.api import LogFiles
from collaudit.core.data.audit_result import Audit
from collaudit.core.history.log_record import LogRecord, NightFrom
from collaudit.core.history.record_of_audit import record_of, unread_record

#: In ``--robot``: the name of the folder that a log lies in.
FOLDER = "{folder}"


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
        from importlib.metadata import version

        from collaudit.core.logs.log_hashing import sha256_of

        try:
            digest: str | None = sha256_of(files)
        except (OSError, ValueError):
            digest = None
        night, source = self._night(None)
        return unread_record(self.robot, night, source, name, digest, error, version("collaudit"))

    def _night(self, start: str | None) -> tuple[str, NightFrom]:
        if self.night is not None:
            return self.night, "stated"
        return (start[:10], "log") if start else (self.today, "audit")
