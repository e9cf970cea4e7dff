"""The logs of an audit: a name and a run folder for each, and the limits they are judged under."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

from collaudit.core.api import LogFiles, log_name
from collaudit.reports.page.shared_assets import ASSETS_FOLDER

if TYPE_CHECKING:
    from collaudit.cli.batch.night_records import RecordWanted
    from collaudit.core.config import LoadedConfig
    from collaudit.core.errors import CollauditError

_LONGEST_NAME = 80


class LogJob(NamedTuple):
    """One log of an audit.

    Attributes:
        files: of the log; none where it was not found, or is remote.
        name: what the index calls it.
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


def log_jobs(logs: Sequence[LogFiles], loaded: LoadedConfig) -> list[LogJob]:
    """A job for every log, all with the same configuration."""
    return [LogJob(*item, loaded) for item in zip(logs, log_names(logs), run_folders(logs), strict=True)]


def log_names(logs: Sequence[LogFiles]) -> list[str]:
    """A name for every log: that of its file, with its folder where two files are called the same."""
    names = [log_name(files) for files in logs]
    count = Counter(names)
    return [name if count[name] == 1 else str(files[0].parent / name) for files, name in zip(logs, names, strict=True)]


def run_folders(logs: Sequence[LogFiles]) -> list[str]:
    """A folder name for every log: its file's stem, numbered where two logs share one, or the audit's own has it."""
    taken = {ASSETS_FOLDER}
    names = []
    for files in logs:
        joined = "+".join(path.stem if path.is_file() else path.name for path in files)
        stem = re.sub(r"[^\w.+-]+", "_", joined).strip("._")[:_LONGEST_NAME] or "log"
        name, count = stem, 1
        while name.lower() in taken:
            count += 1
            name = f"{stem}-{count}"
        taken.add(name.lower())
        names.append(name)
    return names
