"""The report formats: one line each, and what writes a report in any of them."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, cast

from collaudit.core.errors import ConfigError, did_you_mean
from collaudit.core.numeric.parallel import Progress

if TYPE_CHECKING:
    from collaudit.core.data.audit_result import Audit, AuditResult
    from collaudit.reports.files.run_files import StoredRun
    from collaudit.reports.values.entries import IndexEntry
    from collaudit.reports.values.night import NightFacts


@dataclass(frozen=True, slots=True)
class ReportFormat:
    """One format.

    Attributes:
        suffix: of its files, with the dot.
        writer: ``module:function``, imported when a report is written, so that help needs none of it. The function
            returns the text. It takes ``(audits)``; or, of a format for many logs, ``(results, unread, night)``: audit
            results without their signals, lines of logs that could not be audited, and what is said of all of them.
        of_many: whether ``collaudit audit --format`` offers it, for all logs together.
        files: whether the function writes files instead: it takes ``(path, audits)`` and returns the files written.
        steps: whether the function takes ``progress``, called with steps done and in all.
    """

    suffix: str
    writer: str
    of_many: bool = False
    files: bool = False
    steps: bool = False


#: Name, as on the command line, to format; the order is that of help and messages.
FORMATS: dict[str, ReportFormat] = {
    "html": ReportFormat(".html", "collaudit.reports.page.html:html_text", steps=True),
    "json": ReportFormat(".json", "collaudit.reports.files.run_files:audits_json"),
    "junit": ReportFormat(".xml", "collaudit.reports.formats.ci_results:junit_text", of_many=True),
    "sarif": ReportFormat(".sarif", "collaudit.reports.formats.ci_results:sarif_text", of_many=True),
    "markdown": ReportFormat(".md", "collaudit.reports.formats.night_texts:markdown_text", of_many=True),
    "github": ReportFormat(".txt", "collaudit.reports.formats.night_texts:github_text", of_many=True),
    "text": ReportFormat(".message.txt", "collaudit.reports.formats.night_texts:message_text", of_many=True),
    "slack-json": ReportFormat(".slack.json", "collaudit.reports.formats.night_texts:slack_text", of_many=True),
    "csv": ReportFormat(".csv", "collaudit.reports.formats.event_table:write_csv", files=True),
    "mcap": ReportFormat(".mcap", "collaudit.reports.formats.audit_mcap:write_mcap_report", files=True, steps=True),
}


def formats_of_many() -> tuple[str, ...]:
    """Names of the formats that list many logs, those that could not be read included."""
    return tuple(name for name, fmt in FORMATS.items() if fmt.of_many)


def write_report(
    path: str | Path,
    audits: Sequence[Audit | StoredRun],
    fmt: str = "html",
    unread: Sequence[IndexEntry] = (),
    progress: Progress | None = None,
) -> tuple[Path, ...]:
    """Write a report of one or several audits.

    Args:
        path: the file to make.
        audits: the audits.
        fmt: one of :data:`FORMATS`.
        unread: logs that could not be audited; formats of many logs list them.
        progress: called with steps done and in all, by formats that take long: html, mcap.

    Returns:
        The files written: ``path``, and those beside it that belong to the format.

    Raises:
        ConfigError: an unknown format, or nothing to report on.
        CollauditError: the file cannot be written.
    """
    path = Path(path)
    from collaudit.reports.files.written_files import atomic_write

    known = format_named(fmt)
    if known.files and audits:
        return cast("tuple[Path, ...]", _called(known, path, audits, progress=progress))
    atomic_write(path, report_text(audits, fmt, unread, progress))
    return (path,)


def report_text(
    audits: Sequence[Audit | StoredRun],
    fmt: str,
    unread: Sequence[IndexEntry] = (),
    progress: Progress | None = None,
) -> str:
    """The report as text; arguments and errors as for :func:`write_report`."""
    known = format_named(fmt)
    if not audits and not (unread and known.of_many):
        raise ConfigError("there is nothing to report on", expected="at least one run")
    if known.files:
        raise ConfigError("this format is written to files", found=fmt, hint="name a file with -o")
    if known.of_many:
        return summary_text([audit.result for audit in audits], fmt, unread)
    return cast("str", _called(known, audits, progress=progress))


def summary_text(
    results: Sequence[AuditResult], fmt: str, unread: Sequence[IndexEntry] = (), night: NightFacts | None = None
) -> str:
    """The report of many logs as text; for it, results do without their signals.

    Args:
        results: of the logs that could be audited.
        fmt: one of :func:`formats_of_many`.
        unread: the logs that could not.
        night: what is said of all logs together; None for nothing beside what they say.

    Raises:
        ConfigError: an unknown format, or one that needs signals.
    """
    from dataclasses import replace

    from collaudit.core.data import distinct
    from collaudit.reports.values.night import QUIET

    known = format_named(fmt)
    if not known.of_many:
        raise ConfigError("this format is not for many logs", found=fmt, expected=", ".join(formats_of_many()))
    names = distinct([result.log.name for result in results])
    named = [replace(one, log=replace(one.log, name=name)) for one, name in zip(results, names, strict=True)]
    return cast("str", _called(known, named, unread, night or QUIET))


def format_named(name: str) -> ReportFormat:
    """The format of that name.

    Raises:
        ConfigError: there is none.
    """
    if name not in FORMATS:
        raise ConfigError("unknown report format", found=name, expected=", ".join(FORMATS))
    return FORMATS[name]


def _called(known: ReportFormat, *arguments: object, progress: Progress | None = None) -> object:
    """What the format's function makes of the arguments."""
    module, _, function = known.writer.partition(":")
    options = {"progress": progress} if known.steps else {}
    return getattr(import_module(module), function)(*arguments, **options)


def parse_formats(text: str, allowed: Collection[str] = FORMATS) -> list[str]:
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
