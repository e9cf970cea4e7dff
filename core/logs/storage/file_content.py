"""What a file holds, by its first bytes: its compression, text; and what lies within a compressed one, bounded.

Also formats that are not read, each with the line that converts its files, and which files make one KUKA trace.
"""

from __future__ import annotations

import json
import re
import shlex
import shutil
import tempfile
import weakref
from collections.abc import Callable
from contextlib import ExitStack, closing, suppress
from dataclasses import dataclass
from io import BufferedIOBase
from pathlib import Path, PureWindowsPath
from typing import TypeVar, cast

from collaudit.core.errors import LogError
from collaudit.core.logs.storage.bounded_reading import (
    DECOMPRESSION_ERRORS,
    FILE_RATIO,
    FREE_FILE_BYTES,
    FREE_TABLE_BYTES,
    TABLE_RATIO,
    decompressor,
)

_HEAD = 4096
_PIECE = 1 << 20
#: Control characters that are no white space.
_CONTROL = re.compile(rb"[\x00-\x08\x0e-\x1f]")
#: Magic numbers of compressed files, and the name of the method.
_COMPRESSED = (
    (b"\x1f\x8b", "gzip"), (b"\x28\xb5\x2f\xfd", "zstd"), (b"\x04\x22\x4d\x18", "lz4"), (b"\xfd7zXZ\x00", "xz"),
    (b"BZh", "bz2"),
)  # fmt: skip
#: What compressed files append to the name of the file within.
_COMPRESSED_SUFFIXES = (".gz", ".zst", ".zstd", ".lz4", ".xz", ".bz2", ".zip")
#: What else lies in archives of one log: folders, and what macOS adds.
_NO_LOG = re.compile(r"__MACOSX/|(.*/)?(\.DS_Store|\._[^/]*|)$", re.DOTALL)

Reader = TypeVar("Reader")


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


def opened_packed(path: Path, method: str) -> BufferedIOBase:
    """The decompressed bytes of a file.

    Args:
        path: the file.
        method: as :func:`compression_of` names it.

    Raises:
        LogError: an archive does not hold exactly one file.
    """
    return _only_member(path) if method == "zip" else decompressor(path, method)


def _only_member(path: Path) -> BufferedIOBase:
    import zipfile

    try:
        archive = zipfile.ZipFile(path)
        names = [name for name in archive.namelist() if not _NO_LOG.match(name)]
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
    with ExitStack() as temporary:
        folder = tempfile.TemporaryDirectory(prefix="collaudit-", ignore_cleanup_errors=True)
        inner = Path(temporary.enter_context(folder)) / unpacked_name(path.name)
        free, ratio = (FREE_TABLE_BYTES, TABLE_RATIO) if table else (FREE_FILE_BYTES, FILE_RATIO)
        try:
            damage = _unpack(path, method, inner, max(free, ratio * path.stat().st_size))
            if table and damage is not None:
                data = inner.read_bytes()
                inner.write_bytes(data[: data.rfind(b"\n") + 1])
            reader = opened(inner)
        except LogError as error:
            found, hint = error.found, error.hint
            raise LogError(error.message, where=str(path), found=found, hint=hint, keys=error.keys) from error
        weakref.finalize(reader, temporary.pop_all().close)
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


@dataclass(frozen=True, slots=True)
class OtherFormat:
    """A format that is not read.

    Attributes:
        title: with its article.
        why: it is not read, as the end of "which …".
        suffixes: of its files, lower case.
        recognises: tells from the first bytes whether a file is one; its name alone says so, too.
        code: Python that writes a file that is read, ``{old}`` and ``{new}`` for the names, quoted.
        becomes: the suffix of what is written.
        first: what is to be done before.
    """

    title: str
    why: str
    suffixes: tuple[str, ...]
    recognises: Callable[[bytes], bool]
    code: str
    becomes: str = ".csv"
    first: str = ""

    def hint(self, path: Path) -> str:
        """What to do with a file of it."""
        new = repr(str(path.with_name(unpacked_name(path.name)).with_suffix(self.becomes)))
        return f"{self.first}{python_line(self.code.format(old=quoted(path), new=new))}"


def quoted(path: Path) -> str:
    """A path as text in a line of Python, between quotes that a shell leaves alone."""
    return json.dumps(str(path), ensure_ascii=False)


def python_line(code: str) -> str:
    """The line for a shell that runs some Python."""
    return f"python -c {shlex.quote(code)}"


_TRUSTED = "where you trust who wrote it: "
_SAVED = "numpy.savez({new}, **{load}({old}))"
_OTHERS = (
    OtherFormat("an Excel workbook", "is not read", (".xlsx", ".xls", ".xlsm"), workbook_in,
                "import pandas; pandas.read_excel({old}).to_csv({new}, index=False)",
                first="in Excel or LibreOffice, File > Save As > CSV UTF-8 (.csv); or with pandas and openpyxl: "),
    OtherFormat("a TDMS file", "is not read", (".tdms",), lambda head: head.startswith(b"TDSm"),
                "import nptdms; nptdms.TdmsFile.read({old}).as_dataframe().to_csv({new}, index=False)",
                first="pip install npTDMS, then "),
    OtherFormat("a file of joblib", "is never loaded: that could run any program", (".joblib",), lambda _: False,
                "import joblib, numpy; " + _SAVED.replace("{load}", "joblib.load"), ".npz", _TRUSTED),
    OtherFormat("a pickle", "is never loaded: that could run any program", (".pkl", ".pickle"),
                lambda head: head[:1] == b"\x80" and head[1:2] in (b"\x02", b"\x03", b"\x04", b"\x05"),
                "import numpy, pandas; " + _SAVED.replace("{load}", "pandas.read_pickle"), ".npz", _TRUSTED),
)  # fmt: skip


def named_other(name: str) -> OtherFormat | None:
    """The format, of those that are not read, that a file's name states."""
    plain = unpacked_name(name.lower())
    return next((other for other in _OTHERS if plain.endswith(other.suffixes)), None)


def other_format(path: Path) -> OtherFormat | None:
    """The format of a file, of those that are not read: by its name, else by its content."""
    head = head_of(path)
    return named_other(path.name) or next((other for other in _OTHERS if other.recognises(head)), None)


#: The first bytes of a header.
TRACE = b"DIAEXTENDED"
#: A trace of one axis: the name of the recording, and the axis.
AXIS = re.compile(r"(.+)#(\d+)")
#: Endings of what lies beside a header, and is of no use without it.
_PARTS = (".r64", ".trc")
#: The line of a header that names a file of values.
_NAMED = re.compile(r"^\s*211,(.*?)\s*$", re.MULTILINE)


def is_trace(path: Path) -> bool:
    """Whether a file is the header of a trace."""
    return path.suffix.lower() == ".dat" and path.is_file() and head_of(path, len(TRACE)) == TRACE


def trace_values(path: Path) -> tuple[Path, ...]:
    """The files of values of a header, those that are there; none of another file."""
    if not is_trace(path):
        return ()
    found = {values_beside(path, name) for name in _NAMED.findall(path.read_bytes().decode("latin-1"))}
    return tuple(sorted(values for values in found if values is not None))


def values_beside(header: Path, named: str) -> Path | None:
    """The file of values that a header names, else the one of its own name; None where neither lies beside it."""
    wanted = (PureWindowsPath(named).name.lower(), f"{header.stem}.r64".lower())
    inside = {path.name.lower(): path for path in header.parent.iterdir() if path.name.lower() in wanted}
    return next((inside[name] for name in wanted if name in inside), None)


def is_part_of_trace(path: Path) -> bool:
    """Whether a file belongs to the header of its name that lies beside it."""
    return path.suffix.lower() in _PARTS and any(path.with_suffix(end).is_file() for end in (".dat", ".DAT"))
