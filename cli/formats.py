"""Which file each format of a report goes to."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import get_args

from collaudit.core.errors import ConfigError
from collaudit.reports.formats.registry import FORMATS, Format

SUFFIXES: dict[Format, str] = {
    "html": ".html",
    "json": ".json",
    "junit": ".xml",
    "sarif": ".sarif",
    "markdown": ".md",
}


def parse_formats(text: str, allowed: Sequence[Format] = FORMATS) -> list[Format]:
    """Names of formats out of a list with commas, each once.

    Raises:
        ConfigError: one is not known, or none is given.
    """
    names = list(dict.fromkeys(part.strip() for part in text.split(",") if part.strip()))
    known = [name for name in get_args(Format) if name in names and name in allowed]
    if len(known) < len(names) or not names:
        strangers = [name for name in names if name not in known]
        raise ConfigError(
            "no such report format",
            where="--format",
            found=", ".join(strangers) or "nothing",
            expected=", ".join(allowed),
        )
    return sorted(known, key=names.index)


def report_paths(output: Path, formats: Sequence[Format]) -> dict[Format, Path]:
    """A file for every format: the first keeps the name asked for, the others stand beside it.

    Raises:
        ConfigError: two formats would go to one file.
    """
    paths = {name: output if name == formats[0] else output.with_suffix(SUFFIXES[name]) for name in formats}
    if len(set(paths.values())) < len(paths):
        raise ConfigError("two formats would go to one file", where=str(output), hint="give -o the first one's suffix")
    return paths
