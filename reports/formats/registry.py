"""One report in one of the formats."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Literal, get_args

from collaudit.core.data.audit_result import Audit
from collaudit.core.errors import ConfigError
from collaudit.reports.files.atomic import atomic_write
from collaudit.reports.files.json_writer import json_text, plain
from collaudit.reports.files.run_files import audit_json
from collaudit.reports.values.entries import IndexEntry

Format = Literal["html", "json", "junit", "sarif", "markdown"]
FORMATS: tuple[Format, ...] = get_args(Format)

AUDITS_SCHEMA = "collaudit/audits/1"


def write_report(path: Path, audits: Sequence[Audit], fmt: Format, unread: Sequence[IndexEntry] = ()) -> None:
    """Write a report of one or several audits.

    Args:
        path: the file to make.
        audits: the audits.
        fmt: one of :data:`FORMATS`.
        unread: logs that could not be audited; junit, sarif and markdown list them.

    Raises:
        ConfigError: an unknown format, or nothing to report on.
        CollauditError: the file cannot be written.
    """
    atomic_write(path, report_text(audits, fmt, unread))


def report_text(audits: Sequence[Audit], fmt: Format, unread: Sequence[IndexEntry] = ()) -> str:
    """The report as text; arguments and errors as for :func:`write_report`."""
    if not audits and not (unread and fmt in ("junit", "sarif", "markdown")):
        raise ConfigError("there is nothing to report on", expected="at least one run")
    results = [audit.result for audit in audits]
    if fmt == "html":
        from collaudit.reports.page.html import html_text

        return html_text(audits)
    if fmt == "json":
        if len(results) == 1:
            return audit_json(results[0])
        return json_text({"schema": AUDITS_SCHEMA, "audits": [plain(result) for result in results]})
    if fmt == "junit":
        from collaudit.reports.formats.junit import junit_text

        return junit_text(results, unread)
    if fmt == "sarif":
        from collaudit.reports.formats.sarif import sarif_text

        return sarif_text(results, unread)
    if fmt == "markdown":
        from collaudit.reports.formats.markdown import markdown_text

        return markdown_text(results, unread)
    raise ConfigError("unknown report format", found=str(fmt), expected=", ".join(FORMATS))
