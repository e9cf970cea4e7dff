"""The log formats: how each is recognised, and what reads it. A new format is one line here and one file."""

from __future__ import annotations

import pkgutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from collaudit.core.config.schema import CsvConfig
from collaudit.core.logs.storage.file_content import (
    TRACE,
    compression_of,
    first_member,
    head_of,
    inner_head,
    looks_like_text,
    open_unpacked,
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
              f"{_LOGS}.recordings.mcap_file:McapFile", overview=f"{_LOGS}.recordings.mcap_file:overview_of",
              in_bag_folders=True),
    LogFormat("ros1-bag", "ROS 1 bag (2.0)", "messages", (".bag",),
              begins_with(b"#ROSBAG V", b"#ROSRECORD V", b"#ROSLOG V"),
              f"{_LOGS}.recordings.bag_file:BagFile"),
    LogFormat("db3", "ROS 2 bag (sqlite3, mcap)", "messages", (".db3",), begins_with(b"SQLite format 3\x00"),
              f"{_LOGS}.recordings.ros2_bag:Db3File", in_bag_folders=True),
    LogFormat("parquet", "Parquet", "table", (".parquet",), begins_with(b"PAR1"),
              f"{_LOGS}.table_files.named_columns:open_arrow"),
    LogFormat("feather", "Feather", "table", (".feather", ".arrow"), begins_with(b"ARROW1"),
              f"{_LOGS}.table_files.named_columns:open_arrow"),
    LogFormat("npz", "NumPy archive", "table", (".npz",), _npz, f"{_LOGS}.table_files.array_files:open_numpy"),
    LogFormat("npy", "NumPy array", "table", (".npy",), begins_with(b"\x93NUMPY"),
              f"{_LOGS}.table_files.array_files:open_numpy"),
    LogFormat("mat", "MATLAB file", "table", (".mat",),
              begins_with(b"MATLAB 5.0 MAT-file", b"MATLAB 7.3 MAT-file"),
              f"{_LOGS}.table_files.array_files:open_mat"),
    LogFormat("hdf5", "HDF5", "table", (".h5", ".hdf5"), begins_with(b"\x89HDF\r\n\x1a\n"),
              f"{_LOGS}.table_files.array_files:open_hdf5"),
    LogFormat("kuka-trace", "KUKA trace", "table", (), begins_with(TRACE),
              f"{_LOGS}.table_files.kuka_trace:open_kuka_trace"),
    LogFormat("jsonl", "JSON lines", "table", (".jsonl", ".ndjson"), _json_lines,
              f"{_LOGS}.table_files.named_columns:open_json_lines", by_content=False),
    LogFormat("csv", "CSV", "table", (".csv", ".tsv"), _text,
              f"{_LOGS}.table_files.csv_table:open_csv", by_content=False),
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
