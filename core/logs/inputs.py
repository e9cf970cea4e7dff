"""From command-line arguments to logs: files, folders, patterns, and tables that belong together; and what else
a folder holds: what a recorder left behind, archives, other names, companions of logs.
"""

from __future__ import annotations

import glob
import os
import re
import tarfile
import zipfile
from collections.abc import Iterable, Iterator, Sequence
from contextlib import closing
from io import BytesIO
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING, Literal

from collaudit.core.data.joint_log import LeftOut, LeftOutKind
from collaudit.core.errors import ConfigError, LogError, similar_file
from collaudit.core.logs import log_formats
from collaudit.core.logs.log_formats import is_bag_folder, is_log, is_table, named_format
from collaudit.core.logs.storage.bounded_reading import DECOMPRESSION_ERRORS
from collaudit.core.logs.storage.file_content import (
    compression_of,
    head_of,
    is_part_of_trace,
    named_other,
    opened_packed,
)

if TYPE_CHECKING:
    from collaudit.core.config.schema import LogConfig
    from collaudit.core.logs.log_guess import TablePart

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
    found = [entry for entry, log in _entries(path, set()) if log]
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
    from collaudit.core.logs.log_guess import table_part  # a recording is opened without what reads tables

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


#: What lies beside logs and is none: settings, results, pictures, films, shapes.
_COMPANIONS = {
    ".toml", ".json", ".yaml", ".yml", ".urdf", ".xacro", ".srdf", ".stl", ".dae", ".obj", ".ply", ".glb", ".mtl",
    ".html", ".js", ".css", ".md", ".rst", ".pdf", ".png", ".jpg", ".jpeg", ".gif", ".svg", ".mp4", ".avi", ".mkv",
    ".mov", ".webm", ".xml", ".sarif", ".sha256", ".minisig",
}  # fmt: skip
_COMPANION_NAMES = ("readme", "license", "sha256sums", "audit-under-way")
#: What recorders, rotation and copies append to the name of a file that is not, or no longer, the log.
_APPENDED = re.compile(
    r"(\.(active|part|partial|filepart|tmp|temp|incomplete|unfinished|crdownload|download|bak|old|orig|swp|\d+)"
    r"|-(wal|journal|shm)|~)$"
)
_ARCHIVES = (".zip", ".tar", ".tgz", ".tbz2", ".txz", ".7z", ".rar")
_COMPRESSED_TAR = re.compile(r"\.tar\.\w+$")
#: So much of a compressed archive is looked at: where no log begins in it, nobody knows what follows.
_LOOKED_AT = 16 << 20
_HIDDEN_BY_OTHERS = ("._", ".~lock")

OtherFiles = Literal["not_judged", "list", "ignore"]


def left_out(files: Iterable[Path], other_files: OtherFiles) -> list[LeftOut]:
    """What each of these files is, and whether it counts as a log that was not judged.

    Args:
        files: of folders of logs, those that are no logs by name or content.
        other_files: what other names do, as in ``[policy]``.
    """
    return _as_asked(map(_of_file, files), other_files)


def left_out_urls(urls: Iterable[str], other_files: OtherFiles) -> list[LeftOut]:
    """As :func:`left_out`, of remote files, by their names alone."""
    return _as_asked([(url, *_by_name(url.rpartition("/")[2])) for url in urls], other_files)


def hidden_copy(path: Path) -> bool:
    """Whether a hidden file is called after a log, as copies are until they are whole: ``.run.csv.Xk2a9``."""
    known = any(named_format(Path(f"x{suffix}")) is not None for suffix in PurePosixPath(path.name[1:]).suffixes)
    return known and not path.name.startswith(_HIDDEN_BY_OTHERS)


def _as_asked(found: Iterable[tuple[str, LeftOutKind, str]], other_files: OtherFiles) -> list[LeftOut]:
    made = []
    for name, kind, text in found:
        counts = other_files == "not_judged" if kind == "other" else kind != "companion"
        if counts or other_files != "ignore":
            made.append(LeftOut(name, kind, counts, text))
    return made


def _of_file(path: Path) -> tuple[str, LeftOutKind, str]:
    kind, text = _by_name(path.name)
    if path.is_dir():
        kind, text = "unreadable", "a folder that cannot be read"
    elif path.exists() and not path.is_file():
        kind, text = "unreadable", "a pipe, a device or a socket, which could keep a reader waiting for ever"
    elif kind == "archive" and (inside := _log_inside(path)) is not None:
        text = inside or text
        kind = "archive" if inside else "other"
    elif is_part_of_trace(path):
        kind, text = "companion", "of the trace whose header lies beside it"
    return path.as_posix(), kind, text


def _by_name(name: str) -> tuple[LeftOutKind, str]:
    low = name.lower()
    plain = low
    while (shorter := _APPENDED.sub("", plain)) != plain:
        plain = shorter
    is_log = plain != low and named_format(Path(plain)) is not None
    if is_log or low.endswith(".active") or low.startswith("."):
        return "leftover", "left behind by a recorder, a rotation or a copy that was cut"
    if low.endswith(_ARCHIVES) or _COMPRESSED_TAR.search(low):
        return "archive", "an archive that may hold logs; unpack it"
    if Path(low).suffix in _COMPANIONS or low.startswith(_COMPANION_NAMES):
        return "companion", "usual beside logs"
    if (known := named_other(low)) is not None:
        return "other", f"{known.title}, which {known.why}; name it as an argument to see how it is converted"
    return "other", "no log by its name; name it as an argument to have it judged"


def _log_inside(path: Path) -> str | None:
    """Words for the log that an archive holds; empty where it holds none; None where nobody can tell."""
    try:
        names, whole = _members(path)
    except (LogError, tarfile.TarError, zipfile.BadZipFile, ValueError, *DECOMPRESSION_ERRORS):
        return None
    logs = [name for name in names if named_format(Path(name)) is not None or _by_name(name)[0] == "leftover"]
    if logs:
        return f"an archive that holds {logs[0]}" + (f" and {len(logs) - 1} more logs" if len(logs) > 1 else "")
    return "" if whole else None


def _members(path: Path) -> tuple[list[str], bool]:
    """Names of the files in an archive, and whether these are all of them."""
    if zipfile.is_zipfile(path):
        with zipfile.ZipFile(path) as archive:
            return archive.namelist(), True
    method = compression_of(head_of(path))
    if method is None:
        with tarfile.open(path, "r:") as tar:
            return tar.getnames(), True
    head = bytearray()
    with closing(opened_packed(path, method)) as source:
        while len(head) < _LOOKED_AT and (piece := source.read1(1 << 20)):
            head += piece
    names: list[str] = []
    with tarfile.open(fileobj=BytesIO(head), mode="r:") as tar:
        try:
            names += [member.name for member in tar]
        except tarfile.TarError:
            return names, False
    return names, len(head) < _LOOKED_AT
