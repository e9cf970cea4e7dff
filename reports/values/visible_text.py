"""Text from logs, files and settings, in which nothing can hide or command; and text in lines of a width."""

from __future__ import annotations

import re
import struct
import textwrap
import unicodedata

#: What runners of CI systems read as a command, at the beginning of a line.
_COMMAND = re.compile(r"\s*(?::(?=:)|#(?=#\[))")
_UNUSUAL = re.compile(r"[^\n -~]")
_HIDDEN = frozenset("\u200b\u200c\u200d\u2060\ufeff\u2028\u2029\ufffe\uffff")


def visible(text: str) -> str:
    """Text in which nothing can hide: control, direction-changing and invisible characters are spelt out.

    Letters of every script stay as they are, so do line feeds nowhere: a value is one line. A beginning that a CI
    system would take for a command (``::error::``, ``##[error]``) is spelt out too.
    """
    plain = (
        "".join(char if _plain(char) else _spelt(char) for char in text)
        if _UNUSUAL.search(text) or "\n" in text
        else text
    )
    command = _COMMAND.match(plain)
    if command is None:
        return plain
    at = command.end() - 1
    return plain[:at] + _spelt(plain[at]) + plain[at + 1 :]


def visible_lines(text: str) -> str:
    """Lines of text, each as :func:`visible` shows it; line feeds stay."""
    return "\n".join(map(visible, text.split("\n")))


def visible_json(text: str) -> str:
    """JSON text with the same characters as JSON escapes; its meaning stays."""
    return _UNUSUAL.sub(lambda match: match[0] if _plain(match[0]) else _json_escape(match[0]), text)


def _json_escape(char: str) -> str:
    return "".join(f"\\u{unit:04x}" for (unit,) in struct.iter_unpack(">H", char.encode("utf-16-be", "surrogatepass")))


def _plain(char: str) -> bool:
    return char == " " or (char not in _HIDDEN and unicodedata.category(char) not in ("Cc", "Cf", "Cs", "Zl", "Zp"))


def _spelt(char: str) -> str:
    code = ord(char)
    if code < 0x100:
        return f"\\x{code:02x}"
    return f"\\u{code:04x}" if code < 0x10000 else f"\\U{code:08x}"


def wrapped(text: str, width: int | None, indent: str = "") -> str:
    """Text in lines of the terminal's width at most, the later ones indented; None: one line.

    Names, paths and options are never broken, so that they can be copied.

    Args:
        text: one line.
        width: columns of the terminal.
        indent: before every line but the first.
    """
    if width is None:
        return text
    lines = textwrap.wrap(
        text, max(width, 40), subsequent_indent=indent, break_on_hyphens=False, break_long_words=False
    )
    return "\n".join(lines or [""])


#: What a spreadsheet computes when a cell begins with it.
_FORMULA = ("=", "+", "-", "@", "\t", "\r")


def text_cell(text: str) -> str:
    """Text of a log, a file or a setting for a cell; with an apostrophe before what would be a formula.

    Source: OWASP, CSV injection. Cells of numbers are no text and stay as they are.
    """
    return f"'{text}" if text.startswith(_FORMULA) else text
