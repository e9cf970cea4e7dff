"""Where each key of a TOML text stands: tomllib gives values without lines, messages need lines.

The text must already have been accepted by tomllib, so this scanner only has to find keys and skip values;
it never judges whether the text is TOML.
"""

from __future__ import annotations

import re

KeyPath = tuple[str | int, ...]

_BARE_KEY = re.compile(r"[A-Za-z0-9_-]+")
_SCALAR = re.compile(r"[^\s,\]}#]+(?: [0-9][^\s,\]}#]*)?")  # the blank may stand inside a date and time
_ESCAPES = {"b": "\b", "t": "\t", "n": "\n", "f": "\f", "r": "\r", '"': '"', "\\": "\\"}


def key_lines(text: str) -> dict[KeyPath, int]:
    """Line, counted from 1, of every table, key and array element of a valid TOML text.

    Args:
        text: a TOML document that tomllib accepts.

    Returns:
        Key path to line; elements of arrays are ints: ``("robot", "dh", 0, "a")``.
    """
    return _Scanner(text).scan()


class _Scanner:
    """One pass over the text; ``lines`` grows as keys go by."""

    def __init__(self, text: str) -> None:
        self.text = text.replace("\r\n", "\n")
        self.at = 0
        self.lines: dict[KeyPath, int] = {}
        self.tables_in: dict[KeyPath, int] = {}

    def scan(self) -> dict[KeyPath, int]:
        table: KeyPath = ()
        while self._skip_blank():
            if self.text.startswith("[[", self.at):
                table = self._array_table()
            elif self.text[self.at] == "[":
                table = self._table()
            else:
                self._key_value(table)
        return self.lines

    def _line(self) -> int:
        return self.text.count("\n", 0, self.at) + 1

    def _note(self, path: KeyPath, line: int) -> None:
        self.lines.setdefault(path, line)

    def _note_all(self, base: KeyPath, keys: list[str], line: int) -> KeyPath:
        """Note every prefix of a dotted key, stepping into the newest element of arrays of tables."""
        path = base
        for key in keys:
            path = (*path, key)
            self._note(path, line)
            if path in self.tables_in:
                path = (*path, self.tables_in[path] - 1)
        return path

    def _table(self) -> KeyPath:
        line = self._line()
        self.at += 1
        path = self._note_all((), self._dotted_key(), line)
        self.at += 1
        return path

    def _array_table(self) -> KeyPath:
        line = self._line()
        self.at += 2
        *front, last = self._dotted_key()
        self.at += 2
        path = (*self._note_all((), front, line), last)
        self._note(path, line)
        index = self.tables_in.get(path, 0)
        self.tables_in[path] = index + 1
        self._note((*path, index), line)
        return (*path, index)

    def _key_value(self, table: KeyPath) -> None:
        line = self._line()
        path = self._note_all(table, self._dotted_key(), line)
        self.at = self.text.index("=", self.at) + 1
        self._skip_blank()
        self._value(path)

    def _dotted_key(self) -> list[str]:
        keys = []
        while True:
            self._skip_spaces()
            keys.append(self._string() if self.text[self.at] in "\"'" else self._bare_key())
            self._skip_spaces()
            if self.text[self.at] != ".":
                return keys
            self.at += 1

    def _bare_key(self) -> str:
        match = _BARE_KEY.match(self.text, self.at)
        if match is None:
            raise ValueError(f"not a TOML key at offset {self.at}")
        self.at = match.end()
        return match.group()

    def _value(self, path: KeyPath) -> None:
        char = self.text[self.at]
        if char in "\"'":
            self._string()
        elif char == "[":
            self._array(path)
        elif char == "{":
            self._inline_table(path)
        else:
            match = _SCALAR.match(self.text, self.at)
            self.at = match.end() if match else self.at + 1

    def _array(self, path: KeyPath) -> None:
        self.at += 1
        index = 0
        while self._skip_blank() and self.text[self.at] != "]":
            if self.text[self.at] == ",":
                self.at += 1
                continue
            element: KeyPath = (*path, index)
            self._note(element, self._line())
            self._value(element)
            index += 1
        self.at += 1

    def _inline_table(self, path: KeyPath) -> None:
        self.at += 1
        while self._skip_blank() and self.text[self.at] != "}":
            if self.text[self.at] == ",":
                self.at += 1
                continue
            self._key_value(path)
        self.at += 1

    def _string(self) -> str:
        quote = self.text[self.at]
        if self.text.startswith(quote * 3, self.at):
            return self._long_string(quote)
        start = self.at = self.at + 1
        while self.text[self.at] != quote:
            self.at += 2 if quote == '"' and self.text[self.at] == "\\" else 1
        raw = self.text[start : self.at]
        self.at += 1
        return _unescape(raw) if quote == '"' else raw

    def _long_string(self, quote: str) -> str:
        self.at += 3
        while not self.text.startswith(quote * 3, self.at):
            self.at += 2 if quote == '"' and self.text[self.at] == "\\" else 1
        while self.text.startswith(quote, self.at):  # up to two quotes may stand before the closing three
            self.at += 1
        return ""  # a multi-line string is never a key, so its text is not needed

    def _skip_spaces(self) -> None:
        while self.text[self.at] in " \t":
            self.at += 1

    def _skip_blank(self) -> bool:
        """Go to the next character that is no blank and no comment; False at the end of the text."""
        while self.at < len(self.text):
            char = self.text[self.at]
            if char == "#":
                end = self.text.find("\n", self.at)
                self.at = len(self.text) if end < 0 else end
            elif char in " \t\r\n":
                self.at += 1
            else:
                return True
        return False


def _unescape(raw: str) -> str:
    def replace(match: re.Match[str]) -> str:
        code = match.group(1)
        return chr(int(code[1:], 16)) if code[0] in "uU" else _ESCAPES.get(code, code)

    return re.sub(r"\\(u[0-9A-Fa-f]{4}|U[0-9A-Fa-f]{8}|.)", replace, raw)
