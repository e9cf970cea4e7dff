"""What a folder of logs holds besides: what a recorder left behind, archives, other names, companions of logs."""

from __future__ import annotations

import re
import tarfile
import zipfile
from collections.abc import Iterable
from contextlib import closing
from io import BytesIO
from pathlib import Path, PurePosixPath
from typing import Literal

from collaudit.core.data.left_out import LeftOut, LeftOutKind
from collaudit.core.errors import LogError
from collaudit.core.logs.log_formats import named_format
from collaudit.core.logs.storage.decompression import DECOMPRESSION_ERRORS
from collaudit.core.logs.storage.file_content import compression_of, head_of, opened_packed
from collaudit.core.logs.storage.other_formats import named_other
from collaudit.core.logs.storage.trace_files import is_part_of_trace

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
    found = [_of_file(path) for path in files]
    return _as_asked(found, other_files)


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
