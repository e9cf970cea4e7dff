"""The log formats: how each is recognised, what reads it; and opening a log by them.

A new format is one line here and one file.
"""

from __future__ import annotations

import pkgutil
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from collaudit.core.config.schema import CsvConfig
from collaudit.core.errors import LogError, similar_file
from collaudit.core.logs.messages.ros2_bag import JoinedRecording, folder_files
from collaudit.core.logs.storage.bounded_reading import ChunkedFile, ReadingBounds
from collaudit.core.logs.storage.file_content import (
    TRACE,
    compression_of,
    first_member,
    head_of,
    inner_head,
    looks_like_text,
    open_unpacked,
    other_format,
    trace_values,
    unpacked_name,
)
from collaudit.core.logs.storage.readers import Damage, MessageReader, Overview, TableReader

_LOGS = "collaudit.core.logs"


@dataclass(frozen=True, slots=True)
class LogFormat:
    """One format of log files.

    Readers are named, not imported: what only one format needs is loaded when a file of it is opened.

    Attributes:
        name: of the format, unique.
        title: what messages about unreadable files call it.
        holds: ``messages`` (by topic) or a ``table`` (one row a sample).
        suffixes: of its files, lower case; the usual one first; none where others name their files so, too.
        recognises: tells from the first bytes of a file whether it is one.
        reader: ``module:name`` of what opens a file. Of messages it takes the path and returns a
            :class:`~collaudit.core.logs.storage.readers.MessageReader`; of a table it takes the path and
            ``[log.csv]`` and returns a :class:`~collaudit.core.logs.storage.readers.TableReader`.
            It raises ``LogError`` where the file cannot be read at all.
        overview: ``module:name`` of what takes a path and returns an
            :class:`~collaudit.core.logs.storage.readers.Overview` of a huge file of messages, or None where the file
            has no usable summary; "" for formats that have none.
        by_content: whether the first bytes alone make a file of any name a log; any text may be a table, and is not.
        in_bag_folders: whether ROS 2 bag folders keep their messages in it.
    """

    name: str
    title: str
    holds: Literal["messages", "table"]
    suffixes: tuple[str, ...]
    recognises: Callable[[bytes], bool]
    reader: str
    overview: str = ""
    by_content: bool = True
    in_bag_folders: bool = False

    def open_messages(self, path: Path) -> MessageReader:
        """Open a file of messages, compressed as a whole or not."""
        reader: Callable[[Path], MessageReader] = pkgutil.resolve_name(self.reader)
        messages, damage = open_unpacked(path, reader, table=False)
        messages.damage.extend([] if damage is None else [Damage(damage)])
        return messages

    def open_table(self, path: Path, settings: CsvConfig) -> TableReader:
        """Open a table, compressed as a whole or not."""
        reader: Callable[[Path, CsvConfig], TableReader] = pkgutil.resolve_name(self.reader)
        table, damage = open_unpacked(path, lambda inner: reader(inner, settings), table=True)
        table.path, table.damage = path, damage or table.damage
        return table

    def overview_of(self, path: Path) -> Overview | None:
        """What the file's own summary says, None without a usable one."""
        if not self.overview or compression_of(head_of(path)) is not None:
            return None
        overview: Callable[[Path], Overview | None] = pkgutil.resolve_name(self.overview)
        return overview(path)


def begins_with(*magics: bytes) -> Callable[[bytes], bool]:
    """A recogniser of files that begin with a magic number, or with one of several."""
    return lambda head: head.startswith(magics)


def _text(head: bytes) -> bool:
    """Whether a file may be text; a compressed one whose content cannot be seen is taken as such."""
    return compression_of(head) is not None or looks_like_text(head)


def _npz(head: bytes) -> bool:
    return first_member(head).endswith(".npy")


def _json_lines(head: bytes) -> bool:
    """Whether a file begins with an object on a line of its own."""
    first, end, _ = head.removeprefix(b"\xef\xbb\xbf").lstrip().partition(b"\n")
    return first.startswith(b"{") and (not end or first.rstrip().endswith(b"}"))


#: Asked in this order; any text may be a CSV, which therefore comes last.
FORMATS: tuple[LogFormat, ...] = (
    LogFormat("mcap", "MCAP", "messages", (".mcap",), begins_with(b"\x89MCAP0\r\n"),
              f"{_LOGS}.messages.mcap_file:McapFile", overview=f"{_LOGS}.messages.mcap_file:overview_of",
              in_bag_folders=True),
    LogFormat("ros1-bag", "ROS 1 bag (2.0)", "messages", (".bag",),
              begins_with(b"#ROSBAG V", b"#ROSRECORD V", b"#ROSLOG V"),
              f"{_LOGS}.messages.bag_file:BagFile"),
    LogFormat("db3", "ROS 2 bag (sqlite3, mcap)", "messages", (".db3",), begins_with(b"SQLite format 3\x00"),
              f"{_LOGS}.messages.ros2_bag:Db3File", in_bag_folders=True),
    LogFormat("parquet", "Parquet", "table", (".parquet",), begins_with(b"PAR1"),
              f"{_LOGS}.tables.named_columns:open_arrow"),
    LogFormat("feather", "Feather", "table", (".feather", ".arrow"), begins_with(b"ARROW1"),
              f"{_LOGS}.tables.named_columns:open_arrow"),
    LogFormat("npz", "NumPy archive", "table", (".npz",), _npz, f"{_LOGS}.tables.array_files:open_numpy"),
    LogFormat("npy", "NumPy array", "table", (".npy",), begins_with(b"\x93NUMPY"),
              f"{_LOGS}.tables.array_files:open_numpy"),
    LogFormat("mat", "MATLAB file", "table", (".mat",),
              begins_with(b"MATLAB 5.0 MAT-file", b"MATLAB 7.3 MAT-file"),
              f"{_LOGS}.tables.array_files:open_mat"),
    LogFormat("hdf5", "HDF5", "table", (".h5", ".hdf5"), begins_with(b"\x89HDF\r\n\x1a\n"),
              f"{_LOGS}.tables.array_files:open_hdf5"),
    LogFormat("kuka-trace", "KUKA trace", "table", (), begins_with(TRACE),
              f"{_LOGS}.tables.kuka_trace:open_kuka_trace"),
    LogFormat("jsonl", "JSON lines", "table", (".jsonl", ".ndjson"), _json_lines,
              f"{_LOGS}.tables.named_columns:open_json_lines", by_content=False),
    LogFormat("csv", "CSV", "table", (".csv", ".tsv"), _text,
              f"{_LOGS}.tables.csv_table:open_csv", by_content=False),
)  # fmt: skip


def format_of(path: Path) -> LogFormat | None:
    """The format of a file by its content (of a compressed one, by what lies within).

    None for folders, empty files and unknown content.

    Raises:
        LogError: it cannot be opened.
    """
    if path.is_dir() or not (head := head_of(path)):
        return None
    packed = compression_of(head)
    inside = inner_head(path, packed) if packed is not None else b""
    return next((known for known in FORMATS if known.recognises(inside or head)), None)


def is_table(path: Path) -> bool:
    """Whether a file is a table, by its content."""
    known = format_of(path)
    return known is not None and known.holds == "table"


def is_bag_folder(path: Path) -> bool:
    """Whether a path is the folder of a ROS 2 bag."""
    return path.is_dir() and (path / "metadata.yaml").is_file()


def is_bag_storage(path: Path) -> bool:
    """Whether a file may hold the messages of a ROS 2 bag folder."""
    known = format_of(path)
    return known is not None and known.in_bag_folders


def named_format(path: Path) -> LogFormat | None:
    """The format that a file's name states, compressed or not; None when it states none."""
    name = unpacked_name(path.name.lower())
    return next((known for known in FORMATS if name.endswith(known.suffixes)), None)


def is_log(path: Path) -> bool:
    """Whether a file found in a folder is taken as a log: by its name, even when it is damaged, or by its content."""
    if named_format(path) is not None:
        return True
    known = format_of(path)
    return known is not None and known.by_content


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
    *titles, last = (known.title for known in FORMATS)
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
