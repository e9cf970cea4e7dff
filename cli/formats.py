"""Report formats on the command line: names out of a list, and the file each goes to."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from pathlib import Path

from collaudit.core.errors import ConfigError, did_you_mean
from collaudit.reports.formats.registry import FORMATS


def parse_formats(text: str, allowed: Collection[str] = tuple(FORMATS)) -> list[str]:
    """Names of formats out of a list with commas, each once.

    Raises:
        ConfigError: one is not allowed, or none is given.
    """
    names = list(dict.fromkeys(part.strip() for part in text.split(",") if part.strip()))
    strangers = [name for name in names if name not in allowed]
    if strangers or not names:
        raise ConfigError(
            "no such report format",
            where="--format",
            found=", ".join(strangers) or "nothing",
            expected=", ".join(allowed),
            hint=did_you_mean(strangers[0], allowed) if strangers else None,
        )
    return names


def report_paths(output: Path, formats: Sequence[str]) -> dict[str, Path]:
    """A file for every format: the first keeps the name asked for, the others take its name with their own suffix.

    Raises:
        ConfigError: two formats would go to one file.
    """
    paths = {name: output if name == formats[0] else output.with_suffix(FORMATS[name].suffix) for name in formats}
    if len(set(paths.values())) < len(paths):
        raise ConfigError("two formats would go to one file", where=str(output), hint="give -o the first one's suffix")
    return paths
