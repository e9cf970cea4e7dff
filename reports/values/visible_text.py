"""Text for readers: nothing from logs or settings can hide or command in it, and what joints share is said once."""

from __future__ import annotations

import re
import struct
import textwrap
import unicodedata
from collections.abc import Iterable, Sequence

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


_NUMBER = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?(?:e[-+]?\d+)?(?![\w])")
_JOINT = "\x00"
_MOST_RANGES = 2
#: So many texts that differ in their numbers only are two lines: the first, and whose the others are.
_MANY_ALIKE = 3
#: Of more numbers that differ a line could not be read any more.
_MOST_NUMBERS = 3


def joint_lines(said: Iterable[tuple[str, str]], joints: int = 0, brief: bool = False) -> list[str]:
    """Lines ``joint: text``; texts that differ in the joint's name, or in a number or two, are one line.

    A number that differs becomes its range. What cannot be joined without doubt stays as it is, without the joint where
    the text names it.

    Args:
        said: joint and text, in the order of the joints; the joint may be empty.
        joints: how many there are in all: "all 6 joints" instead of their names. 0: not known.
        brief: of three and more texts whose numbers cannot be joined, the first stands, and a line names the other
            joints with their numbers, if they are few; for commands that also have --json.
    """
    groups: dict[str, list[tuple[str, str]]] = {}
    for joint, text in said:
        groups.setdefault(_NUMBER.sub("#", _nameless(joint, text)), []).append((joint, text))
    return [line for group in groups.values() for line in _joined(group, joints, brief)]


def _joined(group: Sequence[tuple[str, str]], joints: int, brief: bool) -> list[str]:
    names = list(dict.fromkeys(joint for joint, _ in group if joint))
    plain = [_nameless(joint, text) for joint, text in group]
    slots = list(zip(*(_NUMBER.findall(text) for text in plain), strict=True))
    varying = sum(len(set(slot)) > 1 for slot in slots)
    if len(group) == 1 or varying > _MOST_RANGES or (varying and " to " in plain[0]):
        said = zip(group, plain, strict=True)
        lines = [f"{joint}: {text}" if joint and _JOINT not in bare else text for (joint, text), bare in said]
        lines = list(dict.fromkeys(lines))
        if not brief or len(lines) < _MANY_ALIKE or len(names) < len(lines):
            return lines
        return [lines[0], _others(names, slots)]
    ends = [(min(slot, key=float), max(slot, key=float)) for slot in slots]
    ranges = iter([low if low == high else f"{low} to {high}" for low, high in ends])
    text = _NUMBER.sub(lambda _: next(ranges), plain[0])
    text = (
        text.replace(f"joint '{_JOINT}'", "the joint").replace(f"'{_JOINT}'", "the joint").replace(_JOINT, "the joint")
    )
    text = text[:1].upper() + text[1:] if group[0][1][:1].isupper() else text
    whole = f"all {joints} joints" if len(names) == joints > 1 else ", ".join(names)
    return [f"{whole}: {text}" if whole else text]


def _others(names: Sequence[str], slots: Sequence[Sequence[str]]) -> str:
    """Whose the same is said of besides, with their numbers where these are few."""
    differ = [slot for slot in slots if len(set(slot)) > 1]
    if len(differ) > _MOST_NUMBERS:
        return f"{', '.join(names[1:])}: the same, with other numbers (--json has them)"
    each = [f"{name} {', '.join(slot[k] for slot in differ)}" for k, name in enumerate(names[1:], 1)]
    return f"the same, instead of {', '.join(slot[0] for slot in differ)}: {'; '.join(each)}"


def _nameless(joint: str, text: str) -> str:
    if not joint:
        return text
    return re.sub(rf"(?i:joint )?(['\"]?)(?<!\w){re.escape(joint)}(?!\w)\1", _JOINT, text)
