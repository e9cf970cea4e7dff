"""The logs of an audit, the limits they are judged under, what became of each, and what a store keeps of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import NamedTuple

from collaudit.core.api import LogFiles
from collaudit.core.config import LoadedConfig
from collaudit.core.contacts.contact_states import Precedents
from collaudit.core.data.audit_result import AuditResult
from collaudit.core.data.cycles_result import CycleReference
from collaudit.core.errors import CollauditError, ConfigError
from collaudit.core.history.night_row import NightFrom, NightRow, rows_of_result
from collaudit.core.logs.log_reading import sha256_of
from collaudit.reports.values.entries import IndexEntry

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

    def of_result(self, result: AuditResult) -> tuple[NightRow, ...]:
        """The rows of an audit."""
        return rows_of_result(result, self.robot, *self._night(result.log.start))

    def of_unread(self, files: LogFiles, name: str, error: str) -> tuple[NightRow, ...]:
        """The row of a log that could not be audited, and why: a night without evidence is no quiet night."""
        try:
            digest = sha256_of(files) if files else None
        except (CollauditError, OSError, ValueError):
            digest = None
        night, source = self._night(None)
        return (
            NightRow(
                robot=self.robot,
                night=night,
                night_from=source,
                log=name,
                log_sha256=digest,
                start=None,
                verdict="not_judged",
                why=error.partition("\n")[0],
                joint=None,
                tested=False,
                judged_s=0.0,
                level_nm=None,
                gamma_nm=None,
                friction_nm=None,
                near_misses=0,
                contacts=(),
                config_sha256=None,
                friction_sha256=None,
                collaudit=version("collaudit"),
            ),
        )

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
        known: what is known of its robot's contacts beforehand.
        earlier: what passed nights of the store say of its program's cycles, in their order.
    """

    files: LogFiles
    name: str
    folder: str
    loaded: LoadedConfig
    robot: str | None = None
    problem: CollauditError | None = None
    wanted: RecordWanted | None = None
    url: str | None = None
    known: Precedents | None = None
    earlier: tuple[CycleReference, ...] = ()

    @property
    def owner(self) -> str | None:
        """Whose log it is, by the fleet or by ``--robot``."""
        return self.robot if self.wanted is None else self.wanted.robot

    @property
    def place(self) -> str:
        """Its path or URL as it was given."""
        return self.url or self.files[0].as_posix()


@dataclass(frozen=True, slots=True)
class Limits:
    """How logs may be judged: processes at a time, and seconds and GB (10⁹ bytes) a log, None for no limit.

    ``scheduler``: address of the cluster that they are judged on, None for this machine.
    """

    workers: int = 1
    time_s: float | None = None
    memory_gb: float | None = None
    scheduler: str | None = None


@dataclass(frozen=True, slots=True)
class Outcome:
    """What became of one log: its line in the index, its result unless it could not be judged, its rows if wanted."""

    entry: IndexEntry
    result: AuditResult | None
    rows: tuple[NightRow, ...] = ()


def with_records(
    jobs: Sequence[LogJob], store: str | None, robot: str | None, night: datetime | None
) -> Sequence[LogJob]:
    """The jobs, told what to record of each log; unchanged without a store.

    Args:
        jobs: the logs.
        store: folder or URL, made where it is new.
        robot: whose logs they are, with :data:`FOLDER` for a log's folder; None: as a fleet's configuration says.
        night: that they count to, None: their own.

    Raises:
        ConfigError: a log's robot is not known. CollauditError: the store cannot be used.
    """
    if store is None:
        return jobs
    from collaudit.reports.store.result_store import ResultStore

    stated = None if night is None else night.date().isoformat()
    today = datetime.now(UTC).date().isoformat()
    made = []
    for job in jobs:
        name = _robot(job, robot)
        made.append(job if name is None else job._replace(wanted=RecordWanted(name, stated, today)))
    ResultStore(store).check()
    return made


def night_rows(jobs: Sequence[LogJob], outcomes: Sequence[Outcome]) -> dict[str, tuple[NightRow, ...]]:
    """The rows of all logs of which they are wanted, by name.

    Args:
        jobs, outcomes: of the audit, in one order.
    """
    made = {}
    for job, one in zip(jobs, outcomes, strict=True):
        if job.wanted is not None:
            rows = one.rows or job.wanted.of_unread(job.files, one.entry.name, one.entry.error or "")
            made[one.entry.name] = rows
    return made


def _robot(job: LogJob, stated: str | None) -> str | None:
    """Whose log it is; None for one that cannot be judged because no robot is known for it."""
    name = stated or job.robot
    if not name and job.problem is not None:
        return None
    if not name:
        raise ConfigError(
            "a store must know whose logs these are",
            where=f"store, {job.name}",
            expected="a [fleet] in the configuration that this log belongs to, --robot NAME, or --robot '{folder}' "
            "where each robot's logs lie in a folder of its name",
        )
    return name.replace(FOLDER, job.files[0].absolute().parent.name if job.files else Path(job.name).parent.name)
