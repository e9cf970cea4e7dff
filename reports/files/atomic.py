"""Writing files whole or not at all."""

from __future__ import annotations

import os
import secrets
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from collaudit.core.errors import CollauditError


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
