"""Files that settings and arguments name beside the log: read whole, so only regular ones, and only so much.

JSON and TOML in them as values; plain values as TOML, which keeps nothing hidden. Messages need the line of a key,
which tomllib does not tell: every header and every ``key = value`` is a TOML text by itself, so lines are taken
together until tomllib accepts them.
"""

from __future__ import annotations

import errno
import hashlib
import json
import re
import stat
import tomllib
from collections.abc import Iterator, Mapping
from datetime import date, time
from pathlib import Path, PurePath
from typing import Any

from collaudit.core.errors import ConfigError

#: No description of a robot, configuration, list of labels or note of a run is larger.
MOST_BYTES = 64 << 20


def check_regular(path: Path) -> None:
    """Refuse what has no end or waits for another program: a device, a pipe, a socket.

    Raises:
        OSError: it is one, or nothing is there.
    """
    mode = path.stat().st_mode
    if not stat.S_ISREG(mode) and not stat.S_ISDIR(mode):  # a folder is refused in its own words where it is opened
        raise OSError(errno.EINVAL, "a pipe, a device or a socket, not a file", str(path))


def read_small(path: Path, most: int = MOST_BYTES) -> bytes:
    """The bytes of a regular file of at most so many.

    Raises:
        OSError: it cannot be read, is no regular file, or is longer.
    """
    check_regular(path)
    with path.open("rb") as file:
        data = file.read(most + 1)  # what the system says of its size may be wrong
    if len(data) > most:
        raise OSError(errno.EFBIG, f"longer than {most >> 20} MiB", str(path))
    return data


def read_object(path: Path, most: int = MOST_BYTES) -> dict[str, Any]:
    """The JSON object in a file of at most so many bytes; empty where it cannot be read or is none."""
    try:
        content = json.loads(read_small(path, most))
    except (OSError, ValueError, RecursionError):
        return {}
    return content if isinstance(content, dict) else {}


def file_sha256(path: Path) -> str:
    """Hash of a file's bytes.

    Raises:
        ConfigError: it cannot be read.
    """
    try:
        check_regular(path)
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as error:
        raise ConfigError(f"cannot be read: {error.strerror}", where=str(path)) from error


#: Tables and arrays in each other. No setting has more than four levels; Python's own bound is in the hundreds.
_DEEPEST = 32
#: Characters of a text that is parsed: a fleet of a thousand robots takes less.
_LONGEST = 4 << 20
#: A key of more parts than levels; such a key takes memory by the square of its parts.
_LONG_KEY = re.compile(rf"""(?<![\w-])(?:(?:[\w-]+|"[^"\n]*"|'[^'\n]*')[ \t]*\.[ \t]*){{{_DEEPEST}}}""")


def to_toml(value: object) -> str:
    """A plain value as TOML on one line; mappings become inline tables.

    Raises:
        ValueError: TOML has no such value.
    """
    if isinstance(value, str | PurePath):
        return f'"{_escaped(str(value))}"'
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, int | float):
        return f"{value!s}"
    if isinstance(value, date | time):
        return value.isoformat()
    if isinstance(value, Mapping):
        inner = ", ".join(f"{toml_key(str(name))} = {to_toml(item)}" for name, item in value.items())
        return f"{{ {inner} }}" if inner else "{}"
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(to_toml, value))}]"
    raise ValueError(f"TOML has no {type(value).__name__}")


def toml_key(name: str) -> str:
    """A key, quoted where TOML needs it."""
    bare = name.isascii() and name.replace("_", "").replace("-", "").isalnum()
    return name if bare else f'"{_escaped(name)}"'


def _escaped(text: str) -> str:
    """The inside of a basic string; what a reader could not see is spelt out as well."""
    plain = text.replace("\\", "\\\\").replace('"', '\\"')
    return "".join(char if char.isprintable() else _spelt(ord(char)) for char in plain)


def _spelt(code: int) -> str:
    return f"\\u{code:04x}" if code < 0x10000 else f"\\U{code:08x}"


def parse_toml(text: str) -> dict[str, object]:
    """The values of a TOML text.

    Raises:
        tomllib.TOMLDecodeError: it is none, is longer than any configuration, or is nested deeper than any setting.
    """
    if len(text) > _LONGEST:
        raise tomllib.TOMLDecodeError(f"Longer than {_LONGEST >> 20} MiB")
    if _LONG_KEY.search(text):
        raise tomllib.TOMLDecodeError("Nested too deeply")
    try:
        data = tomllib.loads(text)
        deep = _depth(data) > _DEEPEST
    except RecursionError:
        deep = True
    if deep:
        raise tomllib.TOMLDecodeError("Nested too deeply")
    return data


def _depth(value: object) -> int:
    if isinstance(value, dict):
        value = [*value.values()]
    return 1 + max(map(_depth, value), default=0) if isinstance(value, list) else 0


KeyPath = tuple[str | int, ...]

#: One of these is in the last line of any value that takes several.
_ENDS = ("]", '"""', "'''")


def key_lines(text: str) -> dict[KeyPath, int]:
    """Line, counted from 1, of every table and key of a valid TOML text; what is in an array stands at its key.

    Args:
        text: a TOML document that tomllib accepts.

    Returns:
        Key path to line; of arrays of tables with the number of the table: ``("robot", "dh", 0, "a")``.
    """
    lines: dict[KeyPath, int] = {}
    newest: dict[KeyPath, int] = {}

    def note(values: Mapping[str, Any], path: KeyPath, line: int, begins_table: bool) -> KeyPath:
        """Note the keys of one statement; the path of the innermost table."""
        for name, value in values.items():
            inner: KeyPath = (*path, name)
            lines.setdefault(inner, line)
            if begins_table and value == [{}]:
                newest[inner] = newest.get(inner, -1) + 1
                lines[*inner, newest[inner]] = line
            if inner in newest:
                inner = (*inner, newest[inner])
            last = note(value, inner, line, begins_table) if isinstance(value, dict) else inner
        return last if values else path

    table: KeyPath = ()
    for line, statement, values in _statements(text):
        if statement.lstrip().startswith("["):
            table = note(values, (), line, statement.lstrip().startswith("[["))
        else:
            note(values, table, line, False)
    return lines


def _statements(text: str) -> Iterator[tuple[int, str, dict[str, Any]]]:
    """First line, text and values of each header and each key with its value."""
    begin, statement = 1, ""
    for line, row in enumerate(text.replace("\r\n", "\n").split("\n"), 1):
        goes_on = bool(statement)
        begin = begin if goes_on else line
        statement += f"{row}\n"
        if goes_on and not any(end in row for end in _ENDS):
            continue
        try:
            values = tomllib.loads(statement)
        except tomllib.TOMLDecodeError:
            continue  # its value goes on in the next line
        yield begin, statement, values
        statement = ""
