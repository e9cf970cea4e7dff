"""From the arguments of an audit to its jobs: each log with its robot, and what it is called in every file.

Files, folders, patterns and a list on stdin are looked up. A log is called ``robot/folder/name``, and so is its run
folder. The folders are those below the root of the nights, without those that are dates, however the log was named as
an argument, so that the name is the same tomorrow. Only where two logs would share one do both get more folders.
"""

from __future__ import annotations

import glob
import hashlib
import os
import re
import sys
from collections import Counter
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from functools import cache
from itertools import takewhile
from pathlib import Path
from typing import NamedTuple

from collaudit.cli.batch.log_jobs import LogJob, LogTraits, robot_settings, robots_of
from collaudit.cli.batch.remote_logs import is_url, local_copy, remote_logs, remote_others
from collaudit.core.api import LogFiles, find_logs, log_name
from collaudit.core.config import LoadedConfig
from collaudit.core.config.schema import FleetRobot
from collaudit.core.data import distinct
from collaudit.core.data.joint_log import LeftOut
from collaudit.core.errors import CollauditError, ConfigError, LogError, NotJudgedError
from collaudit.core.logs.inputs import left_out, left_out_urls, other_files
from collaudit.core.logs.log_formats import is_bag_folder
from collaudit.reports.files.run_files import FRICTION_FOLDER
from collaudit.reports.page.environment import ASSETS_FOLDER

#: Stands for a list of logs on stdin.
STDIN = "-"
_LONGEST_FOLDER = 80
#: Folders that are a date, or year, month and day, perhaps with a time: ``2026-11-22/``, ``20261122T0315/``,
#: ``2026/11/22/``.
_DATED = re.compile(
    r"(?:(?<=/)|^)(?:19|20)\d\d(?P<mark>[-_./]?)(?:0[1-9]|1[0-2])(?P=mark)(?:0[1-9]|[12]\d|3[01])"
    r"(?:[-_.T ]\d[-_.:\d]*Z?)?/"
)


class Night(NamedTuple):
    """What is to be audited: the jobs, settings of every robot or the common ones, files that are left out."""

    jobs: list[LogJob]
    settings: list[LoadedConfig]
    left_out: list[LeftOut]


def night_of(
    arguments: Sequence[str],
    loaded: LoadedConfig,
    flags: Mapping[str, object],
    root: Path | None = None,
) -> Night:
    """What arguments stand for; one that names nothing, beside others that do, is a log that is not judged.

    Args:
        arguments: files, folders, patterns, URLs, or ``-`` for a list of them on stdin, one a line.
        loaded: the common configuration.
        flags: settings given as flags, which win over those of a robot.
        root: folder that names of logs are told from; None: found.

    Raises:
        ConfigError: no argument names anything, a log is not below the root, or fleet and robots are not described as
            they should be.
        LogError: a folder holds no log, or an argument is a pipe or a device.
    """
    robots = loaded.config.fleet.robots
    settings = robot_settings(loaded, flags, robots)
    asked = with_stdin(arguments)
    local, urls, missing = _looked_up(asked, loaded)
    logs = [LogJob(files, "", "", loaded) for files in (find_logs(local, loaded) if local else [])]
    logs += [LogJob((), "", "", loaded, url=url) for url in dict.fromkeys(urls)]
    if not logs:  # nothing would be judged: an error, and not a night
        raise missing[0][1]
    jobs = [one for job in logs for one in _jobs(job, robots, settings)]
    for name, error in missing:
        problem = NotJudgedError(error.message, where=name, hint=error.hint)
        files, url = ((), name) if is_url(name) else ((Path(name),), None)
        jobs.append(LogJob(files, "", "", loaded, problem=problem, url=url))
    places = [job.files or (Path(job.url or ""),) for job in jobs]
    beside = None if loaded.path is None else loaded.path.parent
    names = log_identities(asked, places, [job.robot for job in jobs], root, beside)
    named = zip(jobs, names, run_folders(names, places), strict=True)
    jobs = [job._replace(name=name, folder=folder) for job, name, folder in named]
    return Night(jobs, list(settings.values()) or [loaded], _left_out(asked, loaded))


def _left_out(arguments: Sequence[str], loaded: LoadedConfig) -> list[LeftOut]:
    """What lies in the audited folders besides logs."""
    rule = loaded.config.policy.other_files
    local = [argument for argument in arguments if not is_url(argument)]
    remote = [url for argument in arguments if is_url(argument) for url in remote_others(argument)]
    return left_out(other_files(local), rule) + left_out_urls(remote, rule)


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


def _looked_up(
    arguments: Sequence[str], loaded: LoadedConfig
) -> tuple[list[str], list[str], list[tuple[str, CollauditError]]]:
    """Arguments that name logs here, URLs of logs that others stand for, and those that name none, with the reason."""
    local: list[str] = []
    urls: list[str] = []
    missing: list[tuple[str, CollauditError]] = []
    for argument in arguments:
        try:
            if is_url(argument):
                urls += remote_logs(argument)
            else:
                find_logs([argument], loaded)
                local.append(argument)
        except (ConfigError, LogError) as error:
            missing.append((argument, error))
    return local, urls, missing


def _jobs(job: LogJob, robots: Mapping[str, FleetRobot], settings: Mapping[str | None, LoadedConfig]) -> list[LogJob]:
    """The log's job for each of its robots. A remote log is fetched for rules about its content only."""
    place = job.url or job.files[0].as_posix()
    names: Sequence[str | None] = [None]
    problem = None
    with ExitStack() as fetched:
        url = job.url
        there = (lambda: job.files) if url is None else cache(lambda: (fetched.enter_context(local_copy(url)),))
        try:
            names = robots_of(LogTraits(place, there, job.loaded), robots) if robots else names
        except CollauditError as error:
            problem = error
        except OSError as error:
            problem = NotJudgedError(str(error), where=place)
    by_name: dict[str | None, LoadedConfig] = {None: job.loaded, **settings}
    return [job._replace(loaded=by_name[name], robot=name, problem=problem) for name in names]


def log_identities(
    arguments: Sequence[str],
    logs: Sequence[LogFiles],
    robots: Sequence[str | None],
    root: Path | None = None,
    beside: Path | None = None,
) -> list[str]:
    """A name for every log: its robot, its folders below the root of the nights, and its file's name.

    The root is the one that is stated; else the folder that holds the folder of the log's robot; else that of the
    configuration, where the log lies below it; else the one that holds the first folder that is a date. Folders that
    are dates are no part of a name. Where no root is found, what is below the one folder or pattern that is audited
    counts; of a file that is named itself, and where there are several arguments, the last folder, too.

    Args:
        arguments: files, folders, patterns and URLs that the logs were found by.
        logs: files of each, no first file twice; a URL stands as a path.
        robots: in that order; None where it is not known.
        root: as stated.
        beside: the folder of the configuration.

    Raises:
        ConfigError: a log is not below the root that is stated.
    """
    folders = [found for argument in arguments if (found := _audited_folder(argument)) is not None]
    parts = [_parts(files) for files in logs]
    depth = []
    for files, own, robot in zip(logs, parts, robots, strict=True):
        known = _below_root(files, own, robot, root, beside)
        depth.append(known or _depth(files[0], folders, len(arguments) == 1))
    names = [_joined(robot, _undated(own[-most:])) for robot, own, most in zip(robots, parts, depth, strict=True)]
    shared = {name for name, count in Counter(names).items() if count > 1}
    whole = [name in shared for name in names]
    while True:
        names = [
            _joined(robot, own[-most:] if dated else _undated(own[-most:]))
            for robot, own, most, dated in zip(robots, parts, depth, whole, strict=True)
        ]
        count = Counter(names)
        short = [i for i, name in enumerate(names) if count[name] > 1 and depth[i] < len(parts[i])]
        if not short:
            return distinct(names)  # a file that was given twice, in two spellings
        for i in short:
            depth[i] += 1


def _below_root(
    files: LogFiles, own: tuple[str, ...], robot: str | None, root: Path | None, beside: Path | None
) -> int | None:
    """How many of a path's last parts are below the root of the nights; None where none is known."""
    folders = own[:-1]
    if root is not None:
        above = _folders(root)
        if folders[: len(above)] != above:
            raise ConfigError("a log is not below the root", where=f"--root {root}", found=files[0].as_posix())
        return len(own) - len(above)
    if robot in folders:
        return folders[::-1].index(robot) + 2
    if beside is not None and folders[: len(_folders(beside))] == _folders(beside):
        return len(own) - len(_folders(beside))
    dated = _DATED.search("/".join((*folders, "")))
    return None if dated is None else len(own) - dated.string.count("/", 0, dated.start())


def _undated(parts: tuple[str, ...]) -> tuple[str, ...]:
    """A path without the folders that are dates."""
    *folders, name = parts
    return (*_DATED.sub("", "/".join((*folders, ""))).split("/")[:-1], name)


def run_folders(names: Sequence[str], logs: Sequence[LogFiles]) -> list[str]:
    """A folder for every log: its name without the suffix, ``_`` between folders.

    Where two would be the same, also to a file system without capitals, both end in a hash of the log's name.

    Args:
        names: of the logs.
        logs: their files.
    """
    plain = [_plain(name, files) for name, files in zip(names, logs, strict=True)]
    count = Counter([ASSETS_FOLDER, FRICTION_FOLDER, *(folder.lower() for folder in plain)])
    hashes = [hashlib.sha256(name.encode("utf-8", "surrogateescape")).hexdigest()[:8] for name in names]
    return [f if count[f.lower()] == 1 else f"{f}-{digest}" for f, digest in zip(plain, hashes, strict=True)]


def _audited_folder(argument: str) -> Path | None:
    """The folder whose content an argument means; None where it is a log."""
    path = Path(argument)
    if glob.has_magic(argument) and not path.exists():
        return Path(*takewhile(lambda part: not glob.has_magic(part), path.parts))
    known_log = (path.is_dir() and is_bag_folder(path)) or path.is_file()
    return None if known_log else path


def _depth(file: Path, folders: Sequence[Path], alone: bool) -> int:
    """How many of a path's last parts name the log; of a file in the working folder its name alone."""
    above = [len(folder.parts) for folder in folders if folder != file and file.is_relative_to(folder)]
    inside = len(file.parts) - max(above) if above else 1
    return inside if above and alone else min(inside + 1, len(file.parts))


def _parts(files: LogFiles) -> tuple[str, ...]:
    """Folders, without the root of the file system, and the name of the log."""
    return (*_folders(files[0].parent), log_name(files))


def _folders(folder: Path) -> tuple[str, ...]:
    """Its parts, without the root of the file system."""
    remote = bool(folder.parts) and ":" in folder.parts[0]
    return folder.parts if remote else Path(os.path.abspath(folder)).parts[1:]  # noqa: PTH100 - links stay


def _joined(robot: str | None, parts: Sequence[str]) -> str:
    """Robot and path; a first folder that is called as the robot is not said twice."""
    return "/".join(parts if robot is None or (len(parts) > 1 and parts[0] == robot) else (robot, *parts))


def _plain(name: str, files: LogFiles) -> str:
    stems = "+".join(path.stem if path.is_file() else path.name for path in files)
    return re.sub(r"[^\w.+-]+", "_", "/".join((*name.split("/")[:-1], stems)))[-_LONGEST_FOLDER:].strip("._") or "log"
