"""TOML texts of users as values, and plain values as TOML; text keeps nothing hidden."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from datetime import date, time
from pathlib import PurePath

#: Tables and arrays in each other. No setting has more than four levels; Python's own bound is in the hundreds.
_DEEPEST = 32


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
        tomllib.TOMLDecodeError: it is none, or is nested deeper than any setting.
    """
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
