"""The lines of an earlier draft that nobody has stated yet."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path

from collaudit.core.config.toml_lines import KeyPath, key_lines
from collaudit.core.small_files import read_small

_MARK = "# GUESS:"


def guesses_of(path: Path | None, flags: Collection[str]) -> frozenset[KeyPath]:
    """Paths of the keys whose lines in a configuration file are marked as guesses.

    Args:
        path: the file, which has been read as a configuration; None for none.
        flags: dotted keys that flags state, which are no guesses.
    """
    if path is None:
        return frozenset()
    text = read_small(path).decode("utf-8-sig")
    lines = text.splitlines()
    stated = {tuple(flag.split(".")) for flag in flags}
    return frozenset(key for key, line in key_lines(text).items() if _MARK in lines[line - 1] and key not in stated)
