"""``index.html`` and ``summary.json`` of an audit of many logs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import quote

from collaudit.core.data.audit_result import Verdict
from collaudit.reports.files.atomic import atomic_write
from collaudit.reports.files.json_writer import json_text
from collaudit.reports.page.environment import environment
from collaudit.reports.page.joint_trends import joint_trends
from collaudit.reports.page.scripts import own_script
from collaudit.reports.values.entries import (
    IndexEntry,
    entry_of,
    entry_of_error,
    verdict_counts,
    worst_first,
    worst_verdict,
)

__all__ = ["IndexEntry", "entry_of", "entry_of_error", "summary_json", "write_index"]

SUMMARY_SCHEMA = "collaudit/summary/1"


@dataclass(frozen=True, slots=True)
class Summary:
    """``summary.json``: one line per log, worst first; ``verdict`` is the worst of them.

    Attributes:
        collisions: alarms of single joints in all logs.
        contacts: contacts in all logs.
    """

    schema: str
    verdict: Verdict
    counts: dict[Verdict, int]
    collisions: int
    near_misses: int
    judged_h: float
    logs: tuple[IndexEntry, ...]
    contacts: int = 0


def write_index(out_dir: Path, entries: Sequence[IndexEntry]) -> None:
    """Write ``index.html`` and ``summary.json``; the same entries in any order give the same bytes.

    Args:
        out_dir: folder, made when missing.
        entries: one per log.

    Raises:
        CollauditError: a file cannot be written.
    """
    summary = summarise(entries)
    atomic_write(out_dir / "summary.json", json_text(summary))
    atomic_write(out_dir / "index.html", _page(summary))


def summary_json(entries: Sequence[IndexEntry]) -> str:
    """``summary.json`` as text."""
    return json_text(summarise(entries))


def summarise(entries: Sequence[IndexEntry]) -> Summary:
    """Counts over all logs, and the logs worst first."""
    ordered = worst_first(entries)
    return Summary(
        schema=SUMMARY_SCHEMA,
        verdict=worst_verdict(ordered),
        counts=verdict_counts(ordered),
        collisions=sum(entry.collisions for entry in ordered),
        near_misses=sum(entry.near_misses for entry in ordered),
        judged_h=sum(entry.judged_h for entry in ordered),
        logs=tuple(ordered),
        contacts=sum(entry.contacts for entry in ordered),
    )


def _page(summary: Summary) -> str:
    links = [_link(entry.report) for entry in summary.logs]
    scripts = (own_script("index_table.js"),)
    return (
        environment()
        .get_template("index.html.j2")
        .render(
            summary=summary,
            lines=list(zip(summary.logs, links, strict=True)),
            trends=joint_trends(summary.logs),
            scripts=scripts,
        )
    )


def _link(report: str | None) -> str | None:
    """A relative link that stays one, whatever characters the log's name brought into it."""
    if report is None:
        return None
    text = report.replace("\\", "/").encode("utf-8", "surrogateescape")
    return "./" + quote(text, safe="/")
