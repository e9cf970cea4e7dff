"""TOML texts of users as values: damage and depth are errors that say so."""

from __future__ import annotations

import tomllib

#: Tables and arrays in each other. No setting has more than four levels; Python's own bound is in the hundreds.
_DEEPEST = 32


def parse_toml(text: str) -> dict[str, object]:
    """The values of a TOML text.

    Raises:
        tomllib.TOMLDecodeError: it is none, or is nested deeper than any setting.
    """
    try:
        data = tomllib.loads(text)
    except RecursionError:
        raise tomllib.TOMLDecodeError("Nested too deeply") from None
    level: list[object] = [data]
    for _ in range(_DEEPEST):
        level = [inner for value in level for inner in _inside(value)]
        if not level:
            return data
    raise tomllib.TOMLDecodeError("Nested too deeply")


def _inside(value: object) -> list[object]:
    if isinstance(value, dict):
        return list(value.values())
    return value if isinstance(value, list) else []
