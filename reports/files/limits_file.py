"""Limits of contact force by body region, from a file that the user supplies: this project ships none."""

from __future__ import annotations

import tomllib
from pathlib import Path

import msgspec

from collaudit.core.config.toml_text import parse_toml
from collaudit.core.errors import ConfigError, similar_file
from collaudit.core.small_files import read_small
from collaudit.reports.sections.body_region_sections import BodyLimits

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
    try:
        return BodyLimits.of(data)
    except msgspec.ValidationError as error:
        text = "the file does not state limits as it should"
        raise ConfigError(text, where=str(path), found=str(error), expected=_EXAMPLE) from error
