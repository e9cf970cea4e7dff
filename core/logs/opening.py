"""Opening a log: the reader for its format, and several files of one recording as one."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from collaudit.core.config.schema import CsvConfig
from collaudit.core.errors import LogError, similar_file
from collaudit.core.logs import log_formats
from collaudit.core.logs.log_formats import LogFormat, format_of, is_bag_storage, named_format
from collaudit.core.logs.recordings.ros2_bag import JoinedRecording, folder_files
from collaudit.core.logs.storage.chunked_file import ChunkedFile
from collaudit.core.logs.storage.file_content import (
    compression_of,
    head_of,
    inner_head,
    looks_like_text,
    other_format,
    trace_values,
)
from collaudit.core.logs.storage.readers import Damage, MessageReader, TableReader
from collaudit.core.logs.storage.reading_bounds import ReadingBounds


def log_name(paths: Sequence[Path]) -> str:
    """File names without their folders, joined by ``+``."""
    return "+".join(path.name for path in paths)


def check_there(paths: Sequence[Path]) -> None:
    """Refuse paths at which there is nothing.

    Raises:
        LogError: a path names no file or folder.
    """
    for path in paths:
        if not path.exists():
            raise LogError("there is no such file or folder", where=str(path), hint=similar_file(path))


def data_files(path: Path) -> tuple[Path, ...]:
    """The files that hold a log's data: itself and what lies beside it, or those of a bag folder in recording order.

    Raises:
        LogError: a folder holds no storage file.
    """
    if path.is_dir():
        return folder_files(path, is_bag_storage)[0]
    return (path, *trace_values(path))


def open_messages(paths: Sequence[Path], bounds: ReadingBounds | None = None) -> MessageReader:
    """Open a recording of messages.

    Args:
        paths: its files or bag folders.
        bounds: how much may be read; None for the defaults of a chunk alone.

    Raises:
        LogError: a file is empty, of no known format, or cannot be read at all.
    """
    damage = [item for path in paths if path.is_dir() for item in folder_files(path, is_bag_storage)[1]]
    files = [file for path in paths for file in data_files(path)]
    readers: list[tuple[Path, MessageReader]] = []
    refused: list[LogError] = []
    for file in files:
        try:
            readers.append((file, _format(file, "messages").open_messages(file)))
        except LogError as error:
            refused.append(error)
            damage.append(Damage(f"{file.name} could not be read ({error.message})"))
    if not readers:
        raise refused[0]
    for _, reader in readers:
        if isinstance(reader, ChunkedFile) and bounds is not None:
            reader.bounds = bounds
    if len(readers) == 1:
        readers[0][1].damage.extend(damage)
        return readers[0][1]
    return JoinedRecording(readers, damage)


def open_tables(paths: Sequence[Path], settings: CsvConfig) -> list[TableReader]:
    """Open tables.

    Args:
        paths: files that are tables (:func:`~collaudit.core.logs.log_formats.is_table`).
        settings: what the configuration states about how they are written.

    Raises:
        LogError: a file is no table, or holds no rows.
    """
    return [_format(path, "table").open_table(path, settings) for path in paths]


def _format(path: Path, holds: str) -> LogFormat:
    """The format of a file, which holds messages or a table."""
    known = format_of(path)
    if known is None or known.holds != holds or other_format(path) is not None:
        raise _unreadable(path)
    return known


def _unreadable(path: Path) -> LogError:
    """The error for a file of no known format."""
    where = str(path)
    if path.is_dir():
        return LogError(
            "the folder is no ROS 2 bag",
            where=where,
            found="no metadata.yaml",
            expected="a ROS 2 bag folder or a log file",
        )
    *titles, last = (known.title for known in log_formats.FORMATS)
    expected = f"{', '.join(titles)}, or {last}"
    head = head_of(path)
    if not head:
        return LogError("the file is empty", where=where, found="0 bytes", expected=expected)
    if (other := other_format(path)) is not None:
        return LogError(f"is {other.title}, which {other.why}", where=where, expected=expected, hint=other.hint(path))
    if path.suffix.lower() == ".r64":
        text, hint = "holds the values of a KUKA trace", f"name its header instead: {path.with_suffix('.dat').name}"
        return LogError(text, where=where, expected="the header, a .dat of the same name", hint=hint)
    packed = compression_of(head)
    within = inner_head(path, packed) if packed is not None else head
    found = "text" if looks_like_text(within) else f"bytes beginning with {within[:8]!r}"
    found += f", compressed ({packed})" if packed is not None else ""
    return LogError("is not a log of a known format", where=where, found=found, expected=expected)


def misnamed(path: Path, error: LogError) -> LogError:
    """Say of a table that is named as another format (.mcap, .bag …) that it is none, first of all."""
    named, known = named_format(path), format_of(path)
    if named is None or known is None or path.suffix.lower() not in named.suffixes or named == known:
        return error
    content = known.title if known.by_content else "text"
    return LogError(
        f"is called {path.suffix} and holds {content}, which is no table of joint signals either ({error.message})",
        where=str(path),
        found=error.found,
        hint="check that the file was copied whole, and not as a Git LFS pointer or an error page",
    )
