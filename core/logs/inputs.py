"""From command-line arguments to logs: files, folders, patterns, and CSVs that belong together."""

from __future__ import annotations

import glob
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from collaudit.core.errors import ConfigError, LogError
from collaudit.core.logs.file_kind import is_log_name, sniff

if TYPE_CHECKING:
    from collaudit.core.config.schema import LogConfig
    from collaudit.core.logs.csv.csv_log import CsvFile

_BINARY = ("mcap", "ros1-bag", "db3")


def expand_inputs(args: Sequence[str | Path]) -> list[Path]:
    """Files and bag folders that arguments stand for, each once, in the order given.

    Args:
        args: files, ROS 2 bag folders (one input each), other folders (the logs inside, sorted), glob patterns.

    Raises:
        ConfigError: an argument names nothing.
        LogError: a folder holds no log.
    """
    out: dict[Path, None] = {}
    for arg in args:
        path = Path(arg)
        if path.exists():
            found = _expand(path)
        elif glob.has_magic(str(arg)):
            names = sorted(glob.glob(str(arg), recursive=True))  # noqa: PTH207 (Path.glob refuses absolute patterns)
            found = [item for name in names for item in _expand(Path(name), strict=False)]
            if not found:
                raise ConfigError("no log matches this pattern", where=str(arg))
        else:
            raise ConfigError("there is no such file or folder", where=str(arg))
        out.update(dict.fromkeys(found))
    return list(out)


def _expand(path: Path, *, strict: bool = True) -> list[Path]:
    if not path.is_dir() or sniff(path) == "bag-folder":
        return [path]
    found = _inside(path)
    if not found and strict:
        raise LogError(
            "the folder holds no logs",
            where=str(path),
            expected="files with content or names of .mcap, .bag, .db3 or .csv, or ROS 2 bag folders",
        )
    return found


def _inside(folder: Path) -> list[Path]:
    out: list[Path] = []
    for path in sorted(folder.iterdir()):
        if path.name.startswith("."):
            continue
        if path.is_dir():
            out += [path] if sniff(path) == "bag-folder" else ([] if path.is_symlink() else _inside(path))
        elif path.is_file() and (is_log_name(path) or sniff(path) in _BINARY):
            out.append(path)
    return out


def group_inputs(paths: Sequence[Path], settings: LogConfig) -> list[tuple[Path, ...]]:
    """Put CSVs together that each hold only some quantities and share the time column.

    Args:
        paths: inputs, as :func:`expand_inputs` returns them.
        settings: the column patterns.

    Returns:
        One tuple per log, in the order of its first file. Files that cannot be looked into stand alone.
    """
    from collaudit.core.logs.log_reading import is_text

    groups: list[tuple[tuple[Path, ...], list[_Part]]] = []
    for path in paths:
        part = _part(path, settings) if not path.is_dir() and path.exists() and is_text(path) else None
        home = None
        if part is not None:
            home = next((i for i, (_, parts) in enumerate(groups) if parts and part.joins(parts)), None)
        if part is not None and home is not None:
            members, parts = groups[home]
            groups[home] = ((*members, path), [*parts, part])
        else:
            groups.append(((path,), [part] if part is not None else []))
    return [members for members, _ in groups]


class _Part:
    """What a CSV holds, and the ends of its time column."""

    def __init__(self, file: CsvFile) -> None:
        self.folder = file.path.resolve().parent
        self.quantities = set(file.assignment.quantities)
        self.stamps = _stamp_cells(file)

    def joins(self, others: Sequence[_Part]) -> bool:
        """Whether this file is a further part of the log the others make up."""
        if not self.quantities or not self.stamps:
            return False
        held = set().union(*(other.quantities for other in others))
        same = all(other.folder == self.folder and other.stamps == self.stamps for other in others)
        return same and not (self.quantities & held)


def _part(path: Path, settings: LogConfig) -> _Part | None:
    from collaudit.core.logs.csv.csv_log import open_csvs

    try:
        return _Part(open_csvs([path], settings.csv)[0])
    except LogError:
        return None


def _stamp_cells(file: CsvFile) -> tuple[str, ...]:
    """The first time cells, as text: equal in files that were written from one recording."""
    from collaudit.core.logs.csv.csv_text import read_head, split

    time = file.assignment.time
    if time is None:
        return ()
    lines = read_head(file.path).decode(file.dialect.encoding, errors="replace").splitlines()
    cells = []
    for line in lines[file.dialect.skip : file.dialect.skip + 50]:
        row = split(line, file.dialect.delimiter)
        if time < len(row):
            cells.append(row[time].strip())
    return tuple(cells)
