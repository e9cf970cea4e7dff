"""Plain values as TOML, by tomlkit; text keeps nothing hidden."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from tomlkit.items import Item, Key


def to_toml(value: object) -> str:
    """A plain value as TOML on one line.

    Raises:
        ValueError: TOML has no such value.
    """
    return toml_item(value).as_string()


def toml_key(name: str) -> str:
    """A key, quoted where TOML needs it."""
    return key_item(name).as_string()


def toml_item(value: object) -> Item:
    """A plain value as an item of a tomlkit document; mappings become inline tables.

    Raises:
        ValueError: TOML has no such value.
    """
    import tomlkit
    from tomlkit.items import String, StringType, Trivia

    if isinstance(value, str | Path):
        text = str(value)
        return String(StringType.SLB, text, _escaped(text), Trivia())
    if isinstance(value, Mapping):
        return _inline(value)
    if isinstance(value, list | tuple):
        array = tomlkit.array()
        array.extend([toml_item(inner) for inner in value])
        return array
    made: Item = tomlkit.item(value)
    return made


def key_item(name: str, *, quoted: bool = False) -> Key:
    """A key of a tomlkit document, quoted where TOML needs it or where asked."""
    from tomlkit.items import KeyType, SingleKey

    bare = name.isascii() and name.replace("_", "").replace("-", "").isalnum()
    if bare and not quoted:
        return SingleKey(name, KeyType.Bare)
    return SingleKey(name, KeyType.Basic, original=f'"{_escaped(name)}"')


def _inline(table: Mapping[Any, object]) -> Item:
    """An inline table with a space inside each brace."""
    import tomlkit

    made = tomlkit.inline_table()
    items = [toml_item(value) for value in table.values()]
    for name, item in zip(table, items, strict=True):
        made.append(key_item(str(name)), item)
    if items:
        items[0].trivia.indent = " "
        items[-1].trivia.trail = " "
    return made


def _escaped(text: str) -> str:
    """The inside of a basic string; what a reader could not see is spelt out as well."""
    plain = text.replace("\\", "\\\\").replace('"', '\\"')
    return "".join(char if char.isprintable() else _spelt(ord(char)) for char in plain)


def _spelt(code: int) -> str:
    return f"\\u{code:04x}" if code < 0x10000 else f"\\U{code:08x}"
