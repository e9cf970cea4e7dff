"""From the arguments of an audit to its jobs: files, folders, patterns, a list on stdin; each log with its robot."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from collaudit.cli.batch.log_jobs import LogJob
from collaudit.cli.fleet.log_identities import log_identities, run_folders
from collaudit.cli.fleet.log_settings import LogSettings
from collaudit.cli.fleet.remote_logs import is_url, local_copy, remote_logs
from collaudit.cli.fleet.robot_matching import LogTraits, fleet_robots, robots_of
from collaudit.core.api import LogFiles, find_logs
from collaudit.core.config import LoadedConfig
from collaudit.core.config.schema import FleetRobot
from collaudit.core.errors import CollauditError, ConfigError, LogError, NotJudgedError

#: Stands for a list of logs on stdin.
STDIN = "-"


@dataclass(frozen=True, slots=True)
class Night:
    """The logs of an audit, and the settings that its robots have."""

    jobs: tuple[LogJob, ...]
    settings: tuple[LoadedConfig, ...]


def night_of(
    arguments: Sequence[str], loaded: LoadedConfig, flags: Mapping[str, object], keep_going: bool = False
) -> Night:
    """The jobs that arguments stand for.

    Args:
        arguments: files, folders, patterns, URLs, or ``-`` for a list of them on stdin, one a line.
        loaded: the common configuration.
        flags: settings given as flags, which win over those of a robot.
        keep_going: an argument that names nothing becomes a log that is not judged, not an error.

    Raises:
        ConfigError: an argument names nothing, or fleet and robots are not described as they should be.
        LogError: a folder holds no log, or an argument is a pipe or a device.
    """
    robots = fleet_robots(loaded)
    settings = LogSettings(loaded, flags, robots)
    asked = with_stdin(arguments)
    listed, missing = _there(asked, loaded) if keep_going else (asked, [])
    local = [argument for argument in listed if not is_url(argument)]
    logs: list[LogFiles] = find_logs(local, loaded) if local else []
    urls = [None] * len(logs) + list(
        dict.fromkeys(url for argument in listed if is_url(argument) for url in remote_logs(argument))
    )
    logs += [(Path(url),) for url in urls if url is not None]
    jobs = [
        job
        for files, url in zip(logs, urls, strict=True)
        for job in _jobs(LogJob(files, "", "", loaded, url=url), robots, settings)
    ]
    for name, error in missing:
        remote = is_url(name)
        jobs.append(LogJob(() if remote else (Path(name),), "", "", loaded, None, error, url=name if remote else None))
    places = [job.files or (Path(job.url or ""),) for job in jobs]
    names = log_identities(asked, places, [job.robot for job in jobs])
    named = zip(jobs, names, run_folders(names, places), strict=True)
    jobs = [job._replace(name=name, folder=folder) for job, name, folder in named]
    return Night(tuple(jobs), tuple(settings.robot_settings()))


def with_stdin(arguments: Sequence[str]) -> list[str]:
    """The arguments, with the lines of stdin in place of ``-``.

    Raises:
        ConfigError: stdin is a terminal, or holds no line.
    """
    if STDIN not in arguments:
        return list(arguments)
    if arguments.count(STDIN) > 1 or sys.stdin.isatty():
        raise ConfigError("the list of logs is read from stdin", where=STDIN, expected="one pipe, one name a line")
    lines = [line for line in (raw.rstrip("\r\n") for raw in sys.stdin) if line.strip()]
    if not lines:
        raise ConfigError(
            "the list on stdin is empty: nothing would be judged", where=STDIN, expected="names of logs, one a line"
        )
    at = list(arguments).index(STDIN)
    return [*arguments[:at], *lines, *arguments[at + 1 :]]


def _there(arguments: Sequence[str], loaded: LoadedConfig) -> tuple[list[str], list[tuple[str, CollauditError]]]:
    """Arguments that name logs, and those that do not, with the reason."""
    there: list[str] = []
    missing: list[tuple[str, CollauditError]] = []
    for argument in arguments:
        try:
            remote_logs(argument) if is_url(argument) else find_logs([argument], loaded)
        except (ConfigError, LogError) as error:
            missing.append((argument, NotJudgedError(error.message, where=argument, hint=error.hint)))
        else:
            there.append(argument)
    return there, missing


def _jobs(job: LogJob, robots: Mapping[str, FleetRobot], settings: LogSettings) -> list[LogJob]:
    """The log's job for each of its robots. A remote log is fetched for rules about its content only."""
    place = job.url or job.files[0].as_posix()
    names: Sequence[str | None] = [None]
    problem = None
    with ExitStack() as fetched:
        url, files = job.url, job.files
        there = (
            (lambda: files)
            if url is None
            else cache(lambda: (fetched.enter_context(local_copy(url, job.loaded.config.log.remote)),))
        )
        try:
            names = robots_of(LogTraits(place, there, job.loaded), robots) if robots else names
        except CollauditError as error:
            problem = error
        except OSError as error:
            problem = NotJudgedError(str(error), where=place)
    own = job._replace(files=() if url else files, problem=problem)
    return [own._replace(loaded=settings.of(place, name), robot=name) for name in names]
