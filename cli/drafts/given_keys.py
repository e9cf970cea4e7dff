"""What a configuration file and flags state, as another file would write it; and what of it nobody has stated yet."""

from __future__ import annotations

import os
from collections.abc import Collection, Iterator, Mapping
from pathlib import Path

from collaudit.core.config import LoadedConfig
from collaudit.core.config.config_table import ConfigTable
from collaudit.core.config.toml_text import KeyPath, key_lines
from collaudit.core.small_files import read_small

_MARK = "# GUESS:"


def given_keys(loaded: LoadedConfig, folder: Path, paths: Mapping[str, str]) -> Iterator[tuple[str, object]]:
    """Dotted keys that a file or a flag set, with their values; files as they were given where that finds them."""
    for key, value in _given(loaded.config):
        if key in paths:
            yield key, _placed(Path(paths[key]), folder)
        else:
            yield key, _plain(loaded.urdf_path if key == "robot.urdf" else value, folder)


def _given(table: ConfigTable, front: str = "") -> Iterator[tuple[str, object]]:
    """Keys of a table and of the tables in it, those that were given."""
    for name in table.__struct_fields__:
        value = getattr(table, name)
        if isinstance(value, ConfigTable):
            yield from _given(value, f"{front}{name}.")
        elif name in table.given:
            yield f"{front}{name}", value


def _placed(path: Path, folder: Path) -> str:
    """A path as a file in ``folder`` writes it: unchanged wherever that finds the same file."""
    if path.is_absolute() or path.resolve() == (folder / path).resolve():
        return str(path)
    return os.path.relpath(path, folder)


def _plain(value: object, folder: Path) -> object:
    if isinstance(value, ConfigTable):
        return {name: _plain(inner, folder) for name, inner in _given(value)}
    if isinstance(value, Path):
        return _placed(value, folder)
    if isinstance(value, list | tuple):
        return [_plain(inner, folder) for inner in value]
    if isinstance(value, dict):
        return {key: _plain(inner, folder) for key, inner in value.items()}
    return value


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
