"""Files that are compressed as a whole: what lies within, as a temporary file, bounded."""

from __future__ import annotations

import shutil
import tempfile
import weakref
from collections.abc import Callable
from contextlib import closing, suppress
from io import BufferedIOBase
from pathlib import Path
from typing import TypeVar, cast

from collaudit.core.errors import LogError
from collaudit.core.logs.storage.decompression import DECOMPRESSION_ERRORS, decompressor
from collaudit.core.logs.storage.file_head import compression_of, head_of, unpacked_name
from collaudit.core.logs.storage.file_reading import FREE_CHUNK_BYTES, FREE_TABLE_BYTES, MAX_RATIO, TABLE_RATIO

_HEAD = 4096
_PIECE = 1 << 20
#: What else lies in archives of one log.
_METADATA = ("__MACOSX/", ".DS_Store", "._")

Reader = TypeVar("Reader")


def opened_packed(path: Path, method: str) -> BufferedIOBase:
    """The decompressed bytes of a file.

    Args:
        path: the file.
        method: as :func:`~collaudit.core.logs.storage.file_head.compression_of` names it.

    Raises:
        LogError: an archive does not hold exactly one file.
    """
    return _only_member(path) if method == "zip" else decompressor(path, method)


def _only_member(path: Path) -> BufferedIOBase:
    import zipfile

    try:
        archive = zipfile.ZipFile(path)
        names = [name for name in archive.namelist() if not name.endswith("/") and not _is_metadata(name)]
        if len(names) == 1:
            return cast(BufferedIOBase, archive.open(names[0]))
    except (zipfile.BadZipFile, NotImplementedError, ValueError, EOFError, RuntimeError) as error:
        raise LogError(f"cannot be decompressed: {error}", where=str(path)) from error  # also where a password is asked
    shown = ", ".join(names[:8]) + (", …" if len(names) > 8 else "")
    raise LogError(
        "the archive does not hold exactly one log",
        where=str(path),
        found=f"{len(names)} files: {shown}" if names else "no files",
        hint="unpack it and name the files or the folder",
    )


def _is_metadata(name: str) -> bool:
    return name.startswith(_METADATA[0]) or name.rpartition("/")[2].startswith(_METADATA[1:])


def inner_head(path: Path, method: str) -> bytes:
    """The first bytes of what a compressed file holds; none where they cannot be had."""
    head = b""
    with suppress(LogError, *DECOMPRESSION_ERRORS), closing(opened_packed(path, method)) as source:
        while len(head) < _HEAD and (piece := source.read1(_HEAD)):
            head += piece
    return head[:_HEAD]


def open_unpacked(path: Path, opened: Callable[[Path], Reader], *, table: bool) -> tuple[Reader, str | None]:
    """Open a reader on a file, or on what a compressed one holds, in a temporary folder that goes with the reader.

    Args:
        path: the file.
        opened: opens the decompressed file.
        table: it is a table, all of which will be in memory; where it is damaged, it ends with its last whole line.

    Returns:
        The reader, and where the file could not be decompressed to its end (None: it could).

    Raises:
        LogError: it cannot be opened, or decompresses into more than its size allows or the disk holds.
    """
    method = compression_of(head_of(path))
    if method is None:
        return opened(path), None
    folder = Path(tempfile.mkdtemp(prefix="collaudit-"))
    try:
        inner = folder / unpacked_name(path.name)
        size = path.stat().st_size
        free, ratio = (FREE_TABLE_BYTES, TABLE_RATIO) if table else (FREE_CHUNK_BYTES, MAX_RATIO)
        damage = _unpack(path, method, inner, max(free, ratio * size))
        if table and damage is not None:
            data = inner.read_bytes()
            inner.write_bytes(data[: data.rfind(b"\n") + 1])
        reader = opened(inner)
    except LogError as error:
        shutil.rmtree(folder, ignore_errors=True)
        raise LogError(error.message, where=str(path), found=error.found, hint=error.hint) from error
    except BaseException:
        shutil.rmtree(folder, ignore_errors=True)
        raise
    weakref.finalize(reader, shutil.rmtree, folder, ignore_errors=True)
    return reader, damage


def _unpack(path: Path, method: str, into: Path, limit: int) -> str | None:
    """Decompress a file into so many bytes at most; what is wrong with it, once something of it was had."""
    limit = min(limit, shutil.disk_usage(into.parent).free)
    given = 0
    with into.open("wb") as out, closing(opened_packed(path, method)) as source:
        try:
            while piece := source.read1(_PIECE):
                given += len(piece)
                if given > limit:
                    raise LogError(
                        "decompresses into more than its size allows or the disk for temporary files holds",
                        where=str(path),
                        found=f"more than {limit} bytes",
                        hint="unpack it yourself, or set TMPDIR to a larger disk",
                    )
                out.write(piece)
        except DECOMPRESSION_ERRORS as error:
            if not given:
                raise LogError(f"cannot be decompressed: {error}", where=str(path)) from error
            return f"it cannot be decompressed beyond {given} bytes ({error})"
    return None
