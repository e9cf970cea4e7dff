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
from collaudit.core.data.signals import CycleReference
from collaudit.core.errors import CollauditError, ConfigError
from collaudit.core.history.night_row import NightFrom, NightRow, rows_of_result
from collaudit.core.logs.log_reading import sha256_of
from collaudit.reports.values.entries import IndexEntry

#: In ``--robot``: the name of the folder that a log lies in.
FOLDER = "{folder}"


class LogJob(NamedTuple):
    """One log of an audit.

    Attributes:
        files: of the log; none where it was not found, or is remote.
        name: what all files of the audit call it, unique among its logs.
        folder: name of its run folder.
        loaded: its effective configuration.
        robot: whose log it is, by the fleet or by ``--robot``; None where neither says.
        problem: why it cannot be judged, where that is known beforehand.
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
    url: str | None = None
    known: Precedents | None = None
    earlier: tuple[CycleReference, ...] = ()

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
    """What became of one log: its line in the index, and its result unless it could not be judged."""

    entry: IndexEntry
    result: AuditResult | None


def night_rows(
    jobs: Sequence[LogJob], outcomes: Sequence[Outcome], stated: str | None
) -> dict[str, tuple[NightRow, ...]]:
    """What a store keeps of each log whose robot is known, by name.

    Args:
        jobs, outcomes: of the audit, in one order.
        stated: ISO date of the night that they count to; None: of each log's first stamp in UTC, else today.
    """
    today, made = datetime.now(UTC).date().isoformat(), {}
    for job, one in zip(jobs, outcomes, strict=True):
        start = None if one.result is None else one.result.log.start
        night: tuple[str, NightFrom] = (start[:10], "log") if start else (today, "audit")
        if stated is not None:
            night = stated, "stated"
        if job.robot is not None and one.result is not None:
            made[one.entry.name] = rows_of_result(one.result, job.robot, *night)
        elif job.robot is not None:
            made[one.entry.name] = (_unread_row(job, one.entry, job.robot, *night),)
    return made


def _unread_row(job: LogJob, entry: IndexEntry, robot: str, night: str, night_from: NightFrom) -> NightRow:
    """The row of a log that could not be audited, and why: a night without evidence is no quiet night."""
    try:
        digest = sha256_of(job.files) if job.files else None
    except (CollauditError, OSError, ValueError):
        digest = None
    return NightRow(
        robot=robot,
        night=night,
        night_from=night_from,
        log=entry.name,
        log_sha256=digest,
        start=None,
        verdict="not_judged",
        why=(entry.error or "").partition("\n")[0],
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
    )


def robot_of(job: LogJob, stated: str | None) -> str | None:
    """Whose log it is in a store; None for one that cannot be judged because no robot is known for it.

    Args:
        job: the log.
        stated: whose it is, with :data:`FOLDER` for its folder; None: as a fleet's configuration says.

    Raises:
        ConfigError: nothing says whose it is.
    """
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
