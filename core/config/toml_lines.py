"""Where each key of a TOML text stands: tomllib gives values without lines, messages need lines.

Every header and every ``key = value`` is a TOML text by itself: lines are taken together until tomllib accepts them.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Mapping
from typing import Any

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
