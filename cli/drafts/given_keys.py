"""What a configuration file and flags state, as another file would write it; and what of it nobody has stated yet."""

from __future__ import annotations

import os
from collections.abc import Collection, Iterator, Mapping
from pathlib import Path

from collaudit.core.config import LoadedConfig
from collaudit.core.config.config_table import ConfigTable
from collaudit.core.config.describe import all_keys
from collaudit.core.config.toml_lines import KeyPath, key_lines
from collaudit.core.small_files import read_small

_MARK = "# GUESS:"


def given_keys(loaded: LoadedConfig, folder: Path, paths: Mapping[str, str]) -> Iterator[tuple[str, object]]:
    """Dotted keys that a file or a flag set, with their values; files as they were given where that finds them."""
    for key in all_keys():
        if key.shape == "table":
            continue
        holder: object = loaded.config
        for name in key.path[:-1]:
            holder = getattr(holder, name, None)
        if isinstance(holder, ConfigTable) and key.path[-1] in holder.given:
            value = getattr(holder, key.path[-1])
            if key.dotted in paths and isinstance(value, Path):
                yield key.dotted, _placed(Path(paths[key.dotted]), Path(), folder)
            else:
                yield key.dotted, _plain(value, loaded.base_dir, folder)


def _placed(path: Path, base_dir: Path, folder: Path) -> str:
    """A path from ``base_dir`` as a file in ``folder`` writes it: unchanged wherever that finds the same file."""
    found = base_dir / path
    if path.is_absolute() or found.resolve() == (folder / path).resolve():
        return str(path)
    return os.path.relpath(found, folder)


def _plain(value: object, base_dir: Path, folder: Path) -> object:
    if isinstance(value, ConfigTable):
        return value.plain_given()
    if isinstance(value, Path):
        return _placed(value, base_dir, folder)
    if isinstance(value, list | tuple):
        return [_plain(inner, base_dir, folder) for inner in value]
    if isinstance(value, dict):
        return {key: _plain(inner, base_dir, folder) for key, inner in value.items()}
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
