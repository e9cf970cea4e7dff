"""``SHA256SUMS`` of an audit's folder, as ``sha256sum -c`` reads it; files that were not judged are comments."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Sequence
from pathlib import Path

from collaudit.core.data.left_out import LeftOut
from collaudit.reports.files.atomic import atomic_write
from collaudit.reports.values.visible_text import visible

CHECKSUMS_NAME = "SHA256SUMS"


def write_checksums(out: Path, top: Iterable[str], folders: Iterable[str], left_out: Sequence[LeftOut]) -> None:
    """Write the hashes of all that an audit wrote.

    Args:
        out: its folder.
        top: names of its own files; those that are absent are left out.
        folders: names of folders in it, of which everything counts.
        left_out: files of the audited folders that were not judged.

    Raises:
        CollauditError: it cannot be written.
    """
    files = [out / name for name in top] + [file for name in folders for file in (out / name).rglob("*")]
    there = sorted({file.relative_to(out).as_posix() for file in files if file.is_file() and not file.is_symlink()})
    comments = [f"# not judged: {visible(file.name)}" for file in left_out]
    lines = [f"{_sha256(out / name)}  {name}" for name in there]
    atomic_write(out / CHECKSUMS_NAME, "".join(f"{line}\n" for line in (*comments, *lines)))


def _sha256(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
