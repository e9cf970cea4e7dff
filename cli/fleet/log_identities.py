"""What the logs of an audit are called: ``robot/folder/name``, in every file, and as their run folders.

A name follows from robot and path alone, and not from the other logs of the night, so that it is the same tomorrow.
Only where two logs would share one do both get more of their folders.
"""

from __future__ import annotations

import glob
import hashlib
import os
import re
from collections import Counter
from collections.abc import Sequence
from itertools import takewhile
from pathlib import Path

from collaudit.core.api import LogFiles, log_name
from collaudit.core.logs.log_formats import is_bag_folder
from collaudit.core.numeric.distinct_names import distinct
from collaudit.reports.page.scripts import ASSETS_FOLDER

_LONGEST_FOLDER = 80


def log_identities(arguments: Sequence[str], logs: Sequence[LogFiles], robots: Sequence[str | None]) -> list[str]:
    """A name for every log: its robot, its folders below the one that is audited, and its file's name.

    One folder, or pattern, is audited: what is below it counts, so that a folder of the night's date is no part of
    the name. Of a file that is named itself, and where there are several arguments, the last folder counts, too.

    Args:
        arguments: files, folders, patterns and URLs that the logs were found by.
        logs: files of each, no first file twice; a URL stands as a path.
        robots: in that order; None where it is not known.
    """
    folders = [found for argument in arguments if (found := _audited_folder(argument)) is not None]
    parts = [_parts(files) for files in logs]
    depth = [_depth(files[0], folders, len(arguments) == 1) for files in logs]
    while True:
        names = [_joined(robot, own[-most:]) for robot, own, most in zip(robots, parts, depth, strict=True)]
        count = Counter(names)
        short = [i for i, name in enumerate(names) if count[name] > 1 and depth[i] < len(parts[i])]
        if not short:
            return distinct(names)  # a file that was given twice, in two spellings
        for i in short:
            depth[i] += 1


def run_folders(names: Sequence[str], logs: Sequence[LogFiles]) -> list[str]:
    """A folder for every log: its name without the suffix, ``_`` between folders.

    Where two would be the same, also to a file system without capitals, both end in a hash of the log's name.

    Args:
        names: of the logs.
        logs: their files.
    """
    plain = [_plain(name, files) for name, files in zip(names, logs, strict=True)]
    count = Counter([ASSETS_FOLDER, *(folder.lower() for folder in plain)])
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
    """Folders, without the root, and the name of the log."""
    remote = ":" in files[0].parts[0]
    folders = files[0].parts[:-1] if remote else Path(os.path.abspath(files[0])).parts[1:-1]  # noqa: PTH100 - links stay
    return (*folders, log_name(files))


def _joined(robot: str | None, parts: Sequence[str]) -> str:
    """Robot and path; a first folder that is called as the robot is not said twice."""
    return "/".join(parts if robot is None or (len(parts) > 1 and parts[0] == robot) else (robot, *parts))


def _plain(name: str, files: LogFiles) -> str:
    stems = "+".join(path.stem if path.is_file() else path.name for path in files)
    return re.sub(r"[^\w.+-]+", "_", "/".join((*name.split("/")[:-1], stems)))[-_LONGEST_FOLDER:].strip("._") or "log"
