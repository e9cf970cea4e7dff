"""The formats a report can be written in."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from collaudit.core.errors import ConfigError

if TYPE_CHECKING:
    from collaudit.core.evidence import Audit

SUFFIXES = {"html": ".html", "json": ".json"}
REPORT_SCHEMA = "collaudit/report/1"


def report_paths(output: Path, formats: Sequence[str]) -> dict[str, Path]:
    """Which file each format goes to: the first keeps the name asked for, the others stand beside it.

    Args:
        output: file of the first format.
        formats: names out of :data:`SUFFIXES`.

    Raises:
        ConfigError: a format is not known, or two would go to one file.
    """
    unknown = [name for name in formats if name not in SUFFIXES]
    if unknown or not formats:
        raise ConfigError(
            "no such report format",
            where="--format",
            found=", ".join(unknown) or "nothing",
            expected=" and ".join(SUFFIXES),
        )
    first, *others = dict.fromkeys(formats)
    paths = {first: output, **{name: output.with_suffix(SUFFIXES[name]) for name in others}}
    if len(set(paths.values())) < len(paths):
        raise ConfigError("two formats would go to one file", where=str(output), hint="give -o the first one's suffix")
    return paths


def write_report(path: Path, name: str, audits: Sequence[Audit]) -> None:
    """Write audits in one format.

    Raises:
        CollauditError: the file cannot be written.
    """
    if name == "html":
        from collaudit.reports.html import write_html

        write_html(path, audits)
        return
    from collaudit.reports.files import atomic_write, audit_json

    texts = [audit_json(audit.result) for audit in audits]
    together = f'{{"schema": "{REPORT_SCHEMA}", "audits": [\n' + ",\n".join(text.rstrip() for text in texts) + "\n]}\n"
    atomic_write(path, texts[0] if len(texts) == 1 else together)
