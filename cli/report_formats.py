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


def write_formats(output: Path, formats: Sequence[str], audits: Sequence[Audit]) -> list[Path]:
    """Write the audits in every format; the first keeps the name asked for.

    Args:
        output: file of the first format; the others stand beside it with their own suffix.
        formats: names out of :data:`SUFFIXES`.
        audits: what to report.

    Returns:
        The files written.

    Raises:
        ConfigError: a format is not known; nothing is written then.
    """
    unknown = [name for name in formats if name not in SUFFIXES]
    if unknown or not formats:
        raise ConfigError(
            "no such report format",
            where="--format",
            found=", ".join(unknown) or "nothing",
            expected=" and ".join(SUFFIXES),
        )
    paths = []
    for index, name in enumerate(dict.fromkeys(formats)):
        path = output if index == 0 else output.with_suffix(SUFFIXES[name])
        if path in paths:
            raise ConfigError("two formats would go to one file", where=str(path), hint="give -o another suffix")
        paths.append(path)
    for name, path in zip(dict.fromkeys(formats), paths, strict=True):
        _write(path, name, audits)
    return paths


def _write(path: Path, name: str, audits: Sequence[Audit]) -> None:
    if name == "html":
        from collaudit.reports.html import write_html

        write_html(path, audits)
        return
    from collaudit.reports.files import atomic_write, audit_json

    texts = [audit_json(audit.result) for audit in audits]
    together = f'{{"schema": "{REPORT_SCHEMA}", "audits": [\n' + ",\n".join(text.rstrip() for text in texts) + "\n]}\n"
    atomic_write(path, texts[0] if len(texts) == 1 else together)
