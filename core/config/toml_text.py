"""Plain values as TOML; text keeps nothing hidden."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import date, time
from pathlib import PurePath


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
