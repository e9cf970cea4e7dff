"""``index.html`` and ``summary.json`` of an audit of many logs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import quote

from markupsafe import Markup

from collaudit.core.contacts.contact_states import AcceptanceUse
from collaudit.core.data.audit_result import Verdict
from collaudit.core.data.joint_log import LeftOut
from collaudit.core.data.signals import ProgramComparison
from collaudit.core.history.night_groups import NightGroup
from collaudit.reports.files.written_files import atomic_write, json_text
from collaudit.reports.page.environment import environment, own_script
from collaudit.reports.values.entries import (
    IndexEntry,
    brief_reason,
    night_dates,
    verdict_counts,
    worst_first,
)
from collaudit.reports.values.night import QUIET, NightFacts, change_section, group_section

SUMMARY_SCHEMA = "collaudit/summary/1"
#: Width of a night's bar, height of each verdict's, pixels; and so many nights make a history.
_BAR, _LEAST_NIGHTS = 5, 2
_HEIGHTS: dict[Verdict, int] = {"fail": 14, "not_judged": 8, "pass": 3}


@dataclass(frozen=True, slots=True)
class Summary:
    """``summary.json``: one line per log, worst first; ``verdict`` is the worst of them.

    Attributes:
        collisions: alarms of single joints in all logs.
        contacts: contacts in all logs.
        breaches: limits that all logs of a robot break together.
        left_out: files of the night's folders that were not judged; those that count have a line in ``logs``.
        accepted: what became of each entry of accepted.toml.
        groups: what fails, by cause and place.
        changes: what changed in the programs of logs since the audit that they were held against.
    """

    schema: str
    verdict: Verdict
    counts: dict[Verdict, int]
    collisions: int
    near_misses: int
    judged_h: float
    logs: tuple[IndexEntry, ...]
    contacts: int = 0
    breaches: tuple[str, ...] = ()
    left_out: tuple[LeftOut, ...] = ()
    accepted: tuple[AcceptanceUse, ...] = ()
    groups: tuple[NightGroup, ...] = ()
    changes: tuple[ProgramComparison, ...] = ()


def write_index(
    out_dir: Path,
    entries: Sequence[IndexEntry],
    night: NightFacts = QUIET,
    before: Mapping[str, Sequence[Verdict]] | None = None,
) -> None:
    """Write ``index.html`` and ``summary.json``; the same entries in any order give the same bytes.

    Args:
        out_dir: folder, made when missing.
        entries: one per log.
        night: what is said of all of them.
        before: by name of log, what became of it in the nights that a store holds.

    Raises:
        CollauditError: a file cannot be written.
    """
    summary = summarise(entries, night)
    atomic_write(out_dir / "summary.json", json_text(summary))
    atomic_write(out_dir / "index.html", _page(summary, night, before or {}))


def summarise(entries: Sequence[IndexEntry], night: NightFacts = QUIET) -> Summary:
    """Counts over all logs, the logs worst first, and what is said of the night."""
    ordered = worst_first(entries)
    return Summary(
        schema=SUMMARY_SCHEMA,
        verdict=night.verdict(ordered),
        counts=verdict_counts(ordered),
        collisions=sum(entry.collisions for entry in ordered),
        near_misses=sum(entry.near_misses for entry in ordered),
        judged_h=sum(entry.judged_h for entry in ordered),
        logs=tuple(ordered),
        contacts=sum(entry.contacts for entry in ordered),
        breaches=night.breaches,
        left_out=night.left_out,
        accepted=night.accepted,
        groups=night.groups,
        changes=night.changes,
    )


#: A log on the page: its entry, link to its report, first reason, what else is said of it, its last nights.
_Line = tuple[IndexEntry, str | None, str, tuple[str, ...], Markup | None]


def _page(summary: Summary, night: NightFacts, before: Mapping[str, Sequence[Verdict]]) -> str:
    lines = [_line(entry, before.get(entry.name, ())) for entry in summary.logs]
    return (
        environment()
        .get_template("index.html.j2")
        .render(
            summary=summary,
            night=night,
            sentence=night.sentence(summary.logs),
            groups=group_section(night.groups),
            changes=change_section(night.changes),
            dates=night_dates(summary.logs),
            overlays={name: _link(page) for name, page in night.overlays.items()},
            lines=lines,
            with_robots=any(entry.robot for entry in summary.logs),
            with_states=any(set(entry.contact_states) - {"new"} for entry in summary.logs),
            with_nights=any(nights for *_, nights in lines),
            scripts=(own_script("index_table.js"),),
        )
    )


def _line(entry: IndexEntry, nights: Sequence[Verdict]) -> _Line:
    """A pass without events says in a word that something is left out of it; all else begins with its reason."""
    every = (*(entry.error or "").splitlines()[1:], *entry.reasons, *entry.exclusions)
    brief = brief_reason(entry)
    if entry.verdict == "pass" and not entry.contacts and not entry.near_misses:
        brief = f"{len(entry.exclusions)} exclusions" if entry.exclusions else ""
    return entry, _link(entry.report), brief, () if every == (brief,) else every, _nights(nights)


def _nights(nights: Sequence[Verdict]) -> Markup | None:
    """A bar a night, tonight last: high where the log failed, of half the height where it was not judged."""
    if len(nights) < _LEAST_NIGHTS:
        return None
    drawn = "".join(_bars(nights, verdict) for verdict in _HEIGHTS)
    failed, not_judged = nights.count("fail"), nights.count("not_judged")
    label = f"{failed} of {len(nights)} nights failed, {not_judged} not judged"
    head = f'<svg class="nights" viewBox="0 0 {_BAR * len(nights)} 16" width="{_BAR * len(nights)}" height="16"'
    return Markup(f'{head} role="img" aria-label="{label}">{drawn}</svg>')


def _bars(nights: Sequence[Verdict], verdict: Verdict) -> str:
    d = "".join(f"M{_BAR * k + 2} 15v-{_HEIGHTS[verdict]}" for k, one in enumerate(nights) if one == verdict)
    return f'<path class="night is-{verdict}" d="{d}"/>' if d else ""


def _link(report: str | None) -> str | None:
    """A relative link that stays one, whatever characters the log's name brought into it."""
    if report is None:
        return None
    text = report.replace("\\", "/").encode("utf-8", "surrogateescape")
    return "./" + quote(text, safe="/")
