"""Limits of contact force by body region, from a file that the user supplies: this project ships none."""

from __future__ import annotations

import tomllib
from math import isfinite
from pathlib import Path

from collaudit.core.config.toml_parsing import parse_toml
from collaudit.core.errors import ConfigError, similar_file
from collaudit.core.small_files import read_small
from collaudit.reports.sections.body_region_sections import BodyLimits, BodyRegion

_EXAMPLE = 'source = "where the numbers are from", then [[region]] with name, quasi_static_n and transient_n'


def read_limits(path: Path) -> BodyLimits:
    """Read a file of limits.

    Args:
        path: TOML with ``source`` and tables ``[[region]]``.

    Raises:
        ConfigError: it cannot be read, or does not say what is needed.
    """
    try:
        data = parse_toml(read_small(path).decode())
    except FileNotFoundError as error:
        raise ConfigError("there is no such file of limits", where=str(path), hint=similar_file(path)) from error
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise ConfigError("the file of limits cannot be read", where=str(path), found=str(error)) from error
    source, tables = data.get("source"), data.get("region")
    if not isinstance(source, str) or not source.strip() or not isinstance(tables, list) or not tables:
        raise ConfigError("the file states no limits, or not whose they are", where=str(path), expected=_EXAMPLE)
    strangers = sorted({*data} - {"source", "region"})
    if strangers:
        raise ConfigError(
            "the file has a key that is not known", where=str(path), found=strangers[0], expected=_EXAMPLE
        )
    return BodyLimits(source.strip(), tuple(_region(table, k, path) for k, table in enumerate(tables, start=1)))


def _region(table: object, number: int, path: Path) -> BodyRegion:
    where = f"{path}: [[region]] {number}"
    if not isinstance(table, dict) or not isinstance(table.get("name"), str):
        raise ConfigError("a region needs a name", where=where, expected=_EXAMPLE)
    strangers = sorted({*table} - {"name", "quasi_static_n", "transient_n"})
    if strangers:
        raise ConfigError("a region has a key that is not known", where=where, found=strangers[0], expected=_EXAMPLE)
    forces = [table.get(key) for key in ("quasi_static_n", "transient_n")]
    if all(force is None for force in forces):
        raise ConfigError("a region states no limit", where=where, expected="quasi_static_n, transient_n or both, N")
    for force in forces:
        number_given = isinstance(force, int | float) and not isinstance(force, bool)
        if force is not None and not (number_given and isfinite(force) and force > 0):
            raise ConfigError("a limit is no positive number of newtons", where=where, found=repr(force))
    low, high = (None if force is None else float(force) for force in forces)
    return BodyRegion(str(table["name"]), low, high)
