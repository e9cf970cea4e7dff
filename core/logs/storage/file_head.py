"""The first bytes of a file, and what they tell: compression, text."""

from __future__ import annotations

import re
from pathlib import Path

from collaudit.core.errors import LogError

_HEAD = 4096
#: Control characters that are no white space.
_CONTROL = re.compile(rb"[\x00-\x08\x0e-\x1f]")
#: Magic numbers of compressed files, and the name of the method.
_COMPRESSED = (
    (b"\x1f\x8b", "gzip"), (b"\x28\xb5\x2f\xfd", "zstd"), (b"\x04\x22\x4d\x18", "lz4"), (b"\xfd7zXZ\x00", "xz"),
    (b"BZh", "bz2"),
)  # fmt: skip
#: What compressed files append to the name of the file within.
_COMPRESSED_SUFFIXES = (".gz", ".zst", ".zstd", ".lz4", ".xz", ".bz2", ".zip")


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
    """The method a file is compressed with, or None. Archives that are a format of their own are not meant."""
    if first_member(head):
        return None if workbook_in(head) or first_member(head).endswith(".npy") else "zip"
    return next((name for magic, name in _COMPRESSED if head.startswith(magic)), None)


def first_member(head: bytes) -> str:
    """The name of the first file in a ZIP archive, "" where the bytes begin none."""
    if not head.startswith(b"PK\x03\x04"):
        return ""
    return head[30 : 30 + int.from_bytes(head[26:28], "little")].decode(errors="replace")


def workbook_in(head: bytes) -> bool:
    """Whether bytes begin an Excel workbook (or an older one, which is an OLE file)."""
    return first_member(head).startswith(("[Content_Types].xml", "xl/", "_rels/", "docProps/")) or head.startswith(
        b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1"
    )


def unpacked_name(name: str) -> str:
    """A file's name without those of compressions."""
    for suffix in _COMPRESSED_SUFFIXES:
        name = name.removesuffix(suffix)
    return name


def looks_like_text(head: bytes) -> bool:
    """Whether bytes are text: UTF-16 with a mark, or no control characters but white space."""
    if head[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return True
    return _CONTROL.search(head) is None
