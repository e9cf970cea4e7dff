"""Files of results: written whole or not at all, JSON read back checked, and ``SHA256SUMS`` of a folder.

The same result gives the same bytes; ``sha256sum -c`` reads the checksums."""

from __future__ import annotations

import hashlib
import json
import math
import os
import secrets
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any, TypeVar

import msgspec
import numpy as np

from collaudit.core.data.joint_log import LeftOut
from collaudit.core.errors import CollauditError, similar_file
from collaudit.core.small_files import read_small
from collaudit.reports.values.visible_text import visible, visible_json


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


Json = None | bool | int | float | str | list["Json"] | dict[str, "Json"]
T = TypeVar("T")
_LARGEST_FILE = 1 << 30


def json_text(value: object, indent: int = 1) -> str:
    """A dataclass (or plain value) as JSON: fields in their declared order, floats in shortest exact form.

    Numbers that are not finite become null: JSON has no word for them. Text that UTF-8 cannot carry (bytes
    of a file name that are no text) is written as a visible backslash escape; characters that control a
    terminal, hide or turn the direction of text are written as JSON escapes.

    Args:
        value: dataclasses, mappings, sequences, text, numbers, None.
        indent: spaces a level.

    Returns:
        Text that ends in a line feed.
    """
    # Not msgspec's encoder: it writes 1e-05 as 0.00001, other bytes than in files that are out already,
    # and refuses the surrogates that stand for bytes of file names which are no text.
    return visible_json(json.dumps(plain(value), ensure_ascii=False, allow_nan=False, indent=indent)) + "\n"


def plain(value: object) -> Json:
    """The value as nothing but dict, list, str, int, float, bool and None."""
    if isinstance(value, np.generic):
        return plain(value.item())
    if value is None or isinstance(value, int):
        return value
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, str):
        return value.encode("utf-8", "backslashreplace").decode("utf-8")
    if is_dataclass(value) and not isinstance(value, type):
        return {item.name: plain(getattr(value, item.name)) for item in fields(value)}
    if isinstance(value, dict):
        return {str(plain(key)): plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    raise TypeError(f"{type(value).__name__} has no place in a JSON result")


def read_result(path: Path, kind: type[T], schema: str) -> T:
    """Read a result file.

    Args:
        path: the file.
        kind: the dataclass it holds.
        schema: what its ``schema`` key must say, such as ``collaudit/audit/1``.

    Returns:
        The dataclass.

    Raises:
        CollauditError: no such file, not JSON, another schema or version, or content that does not fit.
    """
    content, where = _load(path), str(path)
    try:
        found = msgspec.json.decode(content)
        _check_schema(found.get("schema") if isinstance(found, dict) else None, schema, where)
        return msgspec.convert(found, kind)
    except msgspec.ValidationError as error:
        raise CollauditError(
            "the file does not have the content its schema promises",
            where=where,
            found=str(error),
            expected="a file as collaudit wrote it",
            hint="make the file again; it may have been edited",
        ) from error
    except msgspec.DecodeError as error:
        raise CollauditError(
            "the JSON is damaged",
            where=where,
            found=str(error) if content.strip() else "an empty file",
            expected="a whole JSON file written by collaudit",
            hint="make the file again; it may have been cut short or edited",
        ) from error
    except RecursionError as error:
        raise CollauditError("the JSON is nested too deeply", where=where) from error


def _load(path: Path) -> str:
    try:
        return read_small(path, _LARGEST_FILE).decode("utf-8")
    except FileNotFoundError as error:
        raise CollauditError("no such file", where=str(path), hint=similar_file(path)) from error
    except OSError as error:
        raise CollauditError("cannot read the file", where=str(path), found=error.strerror) from error
    except UnicodeDecodeError as error:
        raise CollauditError(
            "this is not a JSON file",
            where=f"{path}, byte {error.start}",
            found="bytes that are not UTF-8 text",
            expected="a JSON file written by collaudit",
        ) from error


def _check_schema(found: Any, schema: str, where: str) -> None:
    if found == schema:
        return
    family = schema.rpartition("/")[0]
    newer = isinstance(found, str) and found.rpartition("/")[0] == family
    raise CollauditError(
        "the file has a version this collaudit does not know" if newer else "this is another kind of file",
        where=where,
        found=f"schema {found!r}" if found is not None else "no schema",
        expected=f"schema {schema!r}",
        hint="read it with the version of collaudit that wrote it" if newer else None,
    )
