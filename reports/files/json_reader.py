"""Reading results back: JSON checked against the dataclasses that wrote it."""

from __future__ import annotations

import json
from collections.abc import Hashable
from functools import cache
from pathlib import Path
from typing import Any, TypeVar, cast

import msgspec

from collaudit.core.errors import CollauditError, similar_file
from collaudit.core.small_files import read_small
from collaudit.reports.files.json_writer import not_finite

T = TypeVar("T")

_LARGEST_FILE = 1 << 30


def checked(text: str, kind: type[T]) -> T:
    """JSON as the dataclass that it should hold.

    Raises:
        msgspec.ValidationError: it does not fit the types of the fields; the first problem, with its place.
    """
    decoder: msgspec.json.Decoder[T] = _decoder(cast("Hashable", kind))
    return decoder.decode(text)


@cache
def _decoder(kind: Hashable) -> msgspec.json.Decoder[Any]:
    return msgspec.json.Decoder(cast("Any", kind))


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
    return parse_result(_load(path), kind, schema, str(path))


def parse_result(text: str, kind: type[T], schema: str, where: str) -> T:
    """As :func:`read_result`, from text; ``where`` names its origin in messages."""
    document = _parse(text, where)
    _check_schema(document, schema, where)
    try:
        result = checked(text, kind)
    except msgspec.ValidationError as error:
        for place in not_finite(document):
            raise CollauditError(
                "a number is out of range", where=f"{where}, {place}", expected="a finite number"
            ) from error
        raise CollauditError(
            "the file does not have the content its schema promises",
            where=where,
            found=str(error),
            expected="a file as collaudit wrote it",
            hint="make the file again; it may have been edited",
        ) from error
    except msgspec.DecodeError as error:  # what the standard library lets pass: half of a UTF-16 pair
        raise _damaged(where, str(error)) from error
    return result


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


def _parse(text: str, where: str) -> Any:
    def refuse(constant: str) -> None:
        raise ValueError(constant)

    try:
        return json.loads(text, parse_constant=refuse)
    except json.JSONDecodeError as error:
        found = error.msg if text.strip() else "an empty file"
        raise _damaged(f"{where}, line {error.lineno}, column {error.colno}", found) from error
    except ValueError as error:
        raise CollauditError(
            "the JSON holds a word that JSON does not have", where=where, found=str(error), expected="null"
        ) from error
    except RecursionError as error:
        raise CollauditError("the JSON is nested too deeply", where=where) from error


def _damaged(where: str, found: str) -> CollauditError:
    return CollauditError(
        "the JSON is damaged",
        where=where,
        found=found,
        expected="a whole JSON file written by collaudit",
        hint="make the file again; it may have been cut short or edited",
    )


def _check_schema(document: object, schema: str, where: str) -> None:
    found = document.get("schema") if isinstance(document, dict) else None
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
