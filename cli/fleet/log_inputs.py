"""From the arguments of an audit to its jobs: files, folders, patterns, a list on stdin; each log with its robot."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from collaudit.cli.batch.log_jobs import LogJob, log_names, run_folders
from collaudit.cli.fleet.log_settings import LogSettings
from collaudit.cli.fleet.robot_matching import LogTraits, fleet_robots, robot_of
from collaudit.core.api import find_logs
from collaudit.core.errors import CollauditError, ConfigError, LogError, NotJudgedError

if TYPE_CHECKING:
    from collaudit.core.api import LogFiles
    from collaudit.core.config import LoadedConfig
    from collaudit.core.config.schema import FleetRobot

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
        arguments: files, folders, patterns, or ``-`` for a list of them on stdin, one a line.
        loaded: the common configuration.
        flags: settings given as flags, which win over those of a robot.
        keep_going: an argument that names nothing becomes a log that is not judged, not an error.

    Raises:
        ConfigError: an argument names nothing, or fleet and robots are not described as they should be.
        LogError: a folder holds no log, or an argument is a pipe or a device.
    """
    robots = fleet_robots(loaded)
    settings = LogSettings(loaded, flags, robots)
    listed = with_stdin(arguments)
    missing: list[tuple[str, CollauditError]] = []
    if keep_going:
        listed, missing = _there(listed, loaded)
    logs = find_logs(listed, loaded) if listed else []
    named = zip(logs, log_names(logs), run_folders(logs), strict=True)
    jobs = [_job(files, name, folder, robots, settings, loaded) for files, name, folder in named]
    jobs += [LogJob((), name, f"missing-{k}", loaded, None, error) for k, (name, error) in enumerate(missing, 1)]
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
            find_logs([argument], loaded)
        except (ConfigError, LogError) as error:
            missing.append((argument, NotJudgedError(error.message, where=argument, hint=error.hint)))
        else:
            there.append(argument)
    return there, missing


def _job(
    files: LogFiles,
    name: str,
    folder: str,
    robots: Mapping[str, FleetRobot],
    settings: LogSettings,
    loaded: LoadedConfig,
) -> LogJob:
    place = files[0].as_posix()
    if not robots:
        return LogJob(files, name, folder, settings.of(place, None))
    try:
        robot = robot_of(LogTraits(place, lambda: files, loaded), robots)
    except (CollauditError, OSError) as error:
        problem = error if isinstance(error, CollauditError) else NotJudgedError(str(error), where=place)
        return LogJob(files, name, folder, settings.of(place, None), None, problem)
    return LogJob(files, name, folder, settings.of(place, robot), robot)
