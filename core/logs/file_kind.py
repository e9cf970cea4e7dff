"""What kind of file it is, by its content."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from collaudit.core.errors import LogError

Kind = Literal["mcap", "ros1-bag", "db3", "bag-folder", "csv", "empty", "compressed", "unknown"]

_MAGICS: tuple[tuple[bytes, Kind], ...] = (
    (b"\x89MCAP0\r\n", "mcap"),
    (b"#ROSBAG V2.0\n", "ros1-bag"),
    (b"SQLite format 3\x00", "db3"),
)
#: Magic numbers of compressed files, and the name of the method.
COMPRESSED = ((b"\x1f\x8b", "gzip"), (b"\x28\xb5\x2f\xfd", "zstd"), (b"\xfd7zXZ\x00", "xz"), (b"BZh", "bz2"))
LOG_SUFFIXES = (".mcap", ".bag", ".db3", ".csv", ".tsv")
_HEAD = 4096


def head_of(path: Path, count: int = _HEAD) -> bytes:
    """The first bytes of a file.

    Raises:
        LogError: it cannot be opened.
    """
    try:
        with path.open("rb") as stream:
            return stream.read(count)
    except OSError as error:
        raise LogError(f"cannot be read: {error.strerror}", where=str(path)) from error


def compression_of(head: bytes) -> str | None:
    """The method a file is compressed with, or None."""
    return next((name for magic, name in COMPRESSED if head.startswith(magic)), None)


def looks_like_text(head: bytes) -> bool:
    """Whether bytes are text: UTF-16 with a mark, or no control characters but white space."""
    if head[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return True
    return not any(byte < 9 or 13 < byte < 32 for byte in head)


def sniff(path: Path) -> Kind:
    """The kind of a file or folder.

    Raises:
        LogError: it cannot be opened.
    """
    if path.is_dir():
        return "bag-folder" if (path / "metadata.yaml").is_file() else "unknown"
    head = head_of(path)
    if not head:
        return "empty"
    for magic, kind in _MAGICS:
        if head.startswith(magic):
            return kind
    if compression_of(head) is not None:
        return "compressed"
    return "csv" if looks_like_text(head) else "unknown"


def is_log_name(path: Path) -> bool:
    """Whether a file's name says it is a log, so that a folder's listing takes it up even when it is damaged."""
    name = path.name.lower()
    for packed in (".gz", ".zst", ".zstd", ".xz", ".bz2"):
        name = name.removesuffix(packed)
    return name.endswith(LOG_SUFFIXES)
