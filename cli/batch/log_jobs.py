"""The logs of an audit, and the limits they are judged under."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

from collaudit.core.api import LogFiles

if TYPE_CHECKING:
    from collaudit.cli.batch.night_records import RecordWanted
    from collaudit.core.api import LogFiles
    from collaudit.core.config import LoadedConfig
    from collaudit.core.errors import CollauditError


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
