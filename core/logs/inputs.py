"""From command-line arguments to logs: files, folders, patterns, and tables that belong together."""

from __future__ import annotations

import glob
import os
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from collaudit.core.errors import ConfigError, LogError, similar_file
from collaudit.core.logs import log_formats
from collaudit.core.logs.log_formats import is_bag_folder, is_log, is_table, named_format
from collaudit.core.logs.unjudged_files import hidden_copy

if TYPE_CHECKING:
    from collaudit.core.config.schema import LogConfig
    from collaudit.core.logs.column_guess import TablePart


#: What a folder without logs holds is named up to so many.
_MOST_NAMED = 5


def expand_inputs(args: Sequence[str | Path]) -> list[Path]:
    """Files and bag folders that arguments stand for, each once, in the order given.

    Args:
        args: files, ROS 2 bag folders (one input each), other folders (the logs inside, sorted), glob patterns.

    Raises:
        ConfigError: an argument names nothing.
        LogError: a folder holds no log, or an argument is a pipe or a device.
    """
    out: dict[Path, None] = {}
    for arg in args:
        path = Path(arg)
        if path.exists():
            found = _expand(path)
        elif glob.has_magic(str(arg)):
            found = [item for match in matching_paths(str(arg)) for item in _expand(match, strict=False)]
            if not found:
                raise ConfigError("no log matches this pattern", where=str(arg))
        else:
            raise ConfigError("there is no such file or folder", where=str(arg), hint=similar_file(path))
        out.update(dict.fromkeys(found))
    return list(out)


def _expand(path: Path, *, strict: bool = True) -> list[Path]:
    if not path.is_dir() and not path.is_file():
        raise LogError(
            "this is no regular file, and could keep a reader waiting for ever",
            where=str(path),
            found="a pipe, a device or a socket",
            expected="a log that is a file; copy the stream into one first",
        )
    if not path.is_dir() or is_bag_folder(path):
        return [path]
    found = _inside(path)
    if not found and strict:
        *suffixes, last = (known.suffixes[0] for known in log_formats.FORMATS if known.suffixes)
        raise LogError(
            "the folder holds no logs",
            where=str(path),
            found=", ".join(one.name for one in other_files([path])[:_MOST_NAMED]) or "nothing",
            expected=f"files with content or names of {', '.join(suffixes)} or {last}, or ROS 2 bag folders",
        )
    return found


def other_files(args: Sequence[str | Path]) -> list[Path]:
    """What folders hold that is not taken as a log: files, and folders that cannot be read.

    Args:
        args: as of :func:`expand_inputs`; of a pattern the folders that it names.
    """
    named = [path for arg in args for path in ([Path(arg)] if Path(arg).exists() else matching_paths(str(arg)))]
    folders = dict.fromkeys(path for path in named if path.is_dir() and not is_bag_folder(path))
    entries = [entry for folder in folders for entry in _entries(folder, set())]
    return [path for path, log in entries if not log and not _is_result(path)]


def _inside(folder: Path) -> list[Path]:
    return [path for path, log in _entries(folder, set()) if log]


def _entries(folder: Path, seen: set[Path]) -> Iterator[tuple[Path, bool]]:
    """What a folder holds, and whether it is taken as a log; of links to a folder, what that holds, unless it is above.

    A link that its name calls a log is one, even where it leads nowhere: that it cannot be read is to be said. A pipe
    is none: it would keep a reader waiting. A folder that cannot be read stands for what is in it.
    """
    seen.add(folder.resolve())
    linked = []
    try:
        inside = sorted(folder.iterdir())
    except OSError:
        yield folder, False
        return
    for path in inside:
        if path.name.startswith("."):
            if path.is_file() and hidden_copy(path):
                yield path, False
            continue
        if not path.is_dir():
            log = is_log(path) if path.is_file() else not path.exists() and named_format(path) is not None
            yield path, log and not _is_result(path)
        elif is_bag_folder(path):
            yield path, True
        elif not _describes_episodes(path):
            linked += [path] if path.is_symlink() else []
            yield from () if path.is_symlink() else _entries(path, seen)
    for path in linked:  # last, so that logs are called by the names of their own folders
        target = path.resolve()
        if target not in seen and not folder.resolve().is_relative_to(target):
            yield from _entries(path, seen)


def _describes_episodes(folder: Path) -> bool:
    """Whether a folder holds what a LeRobot data set says of its episodes, and no episode."""
    return folder.name == "meta" and (folder / "info.json").is_file()


def _is_result(path: Path) -> bool:
    """Whether a file is the evidence of an earlier audit, and no log beside which results lie."""
    return path.name == "signals.parquet" and path.with_name("audit.json").is_file()


def group_inputs(paths: Sequence[Path], settings: LogConfig) -> list[tuple[Path, ...]]:
    """Put tables together that each hold only some quantities and share the time column.

    Args:
        paths: inputs, as :func:`expand_inputs` returns them.
        settings: the column patterns.

    Returns:
        One tuple per log, in the order of its first file. Files that cannot be looked into stand alone.
    """
    groups: list[tuple[tuple[Path, ...], list[TablePart]]] = []
    alike: dict[tuple[object, ...], list[int]] = {}  # groups by what their parts share: thousands of logs stay quick
    for path in paths:
        part = _part(path, settings) if path.is_file() and is_table(path) else None
        homes = alike.setdefault(part.shared, []) if part is not None else []
        home = None if part is None else next((i for i in homes if part.joins(groups[i][1])), None)
        if part is not None and home is not None:
            members, parts = groups[home]
            groups[home] = ((*members, path), [*parts, part])
        else:
            homes.append(len(groups))
            groups.append(((path,), [part] if part is not None else []))
    return [members for members, _ in groups]


def _part(path: Path, settings: LogConfig) -> TablePart | None:
    from collaudit.core.logs.column_guess import table_part  # a recording is opened without what reads tables

    return table_part(path, settings)


def matching_paths(pattern: str) -> list[Path]:
    """Paths that a glob pattern names, sorted by their text.

    As :func:`glob.glob` with ``recursive=True``, but ``**`` enters no folder through a symbolic link: a link to
    a folder above would be followed in circles.

    Args:
        pattern: with ``*``, ``?``, ``[…]`` and ``**``; hidden names match only where the pattern spells the dot.
    """
    return [Path(found) for found in sorted(set(_matches(pattern)))]


def _matches(pattern: str) -> Iterator[str]:
    parts = pattern.split("/")
    if "**" not in parts:
        yield from glob.glob(pattern)  # noqa: PTH207 - Path.glob refuses absolute patterns and shows hidden files
        return
    at = parts.index("**")
    head, tail = "/".join(parts[:at]), "/".join(parts[at + 1 :])
    root = "/" if pattern.startswith("/") and not head else head
    for base in glob.glob(root) if root else [""]:  # noqa: PTH207
        for folder, inside, _ in os.walk(base or os.curdir):
            inside[:] = sorted(name for name in inside if not name.startswith("."))
            place = folder if base else os.path.relpath(folder)
            stem = "" if place == os.curdir and not base else glob.escape(place) + "/"
            yield from _matches(stem + (tail or "*"))
