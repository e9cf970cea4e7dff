"""Writing files whole or not at all, and ``SHA256SUMS`` of a folder, as ``sha256sum -c`` reads it."""

from __future__ import annotations

import hashlib
import os
import secrets
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

from collaudit.core.data.joint_log import LeftOut
from collaudit.core.errors import CollauditError
from collaudit.reports.values.visible_text import visible


@contextmanager
def staged(path: Path) -> Iterator[Path]:
    """Give a temporary path beside ``path``; it becomes ``path`` when the block ends well.

    The temporary file is in the same folder, so the final rename is atomic, and it is removed when the
    block fails: no reader ever sees half a file.

    Args:
        path: the file to make or replace; its folder is made when it is missing.

    Raises:
        CollauditError: the folder or the file cannot be written.
    """
    target = path.resolve()
    temporary = target.with_name(f".{target.name[:80]}.{secrets.token_hex(6)}.part")
    try:
        refuse_link(path)
        if target.is_dir():
            raise CollauditError(
                "cannot write the file", where=str(target), found="a folder of that name", expected="a file name"
            )
        target.parent.mkdir(parents=True, exist_ok=True)
        yield temporary
        temporary.replace(target)
    except OSError as error:
        raise _unwritable(path, error) from error
    finally:
        with suppress(OSError):  # where it could not be made, there is nothing to remove
            temporary.unlink()


def atomic_write(path: Path, data: bytes | str) -> None:
    """Write a whole file at once; text becomes UTF-8. Devices and pipes are written to directly.

    Args:
        path: the file to make or replace.
        data: its whole content.

    Raises:
        CollauditError: the file cannot be written.
    """
    content = data.encode("utf-8") if isinstance(data, str) else data
    if path.exists() and not path.is_file() and not path.is_dir():
        try:
            path.write_bytes(content)
        except OSError as error:
            raise _unwritable(path, error) from error
        return
    with staged(path) as temporary:
        write_synced(temporary, content)


def write_synced(path: Path, content: bytes) -> None:
    """Write bytes and wait until the disk has them, so that a rename never outruns its content."""
    with path.open("xb") as file:
        file.write(content)
        file.flush()
        os.fsync(file.fileno())


def refuse_link(path: Path) -> None:
    """Refuse to write through a symbolic link: what it points to may be what is read.

    Raises:
        CollauditError: the path is one.
    """
    if path.is_symlink():
        raise CollauditError(
            "cannot write here",
            where=str(path),
            found=f"a symbolic link to {path.resolve()}",
            expected="a file or folder; nothing is written through a link",
            hint="remove the link, or name what it points to",
        )


def _unwritable(path: Path, error: OSError) -> CollauditError:
    return CollauditError(
        "cannot write the file",
        where=str(path),
        found=error.strerror or str(error),
        hint="check that the folder exists, may be written to and has space left",
    )


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
