"""One line per audited log, of which index pages, summaries and CI formats are made; a night of them in a sentence."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import cast

from collaudit.core.data.audit_result import AuditResult, Verdict
from collaudit.core.data.detection_result import ContactState
from collaudit.core.errors import CollauditError
from collaudit.core.history.night_row import NightRow
from collaudit.reports.values.words import nothing_judged, noticed_brief, noticed_n, verdict_word

_ORDER: dict[Verdict, int] = {"fail": 0, "not_judged": 1, "pass": 2}
#: Nights that a line shows.
_MOST_NIGHTS = 14


@dataclass(frozen=True, slots=True)
class IndexEntry:
    """One log among many.

    Attributes:
        name: of the log, unique among the entries.
        verdict: what became of it; a log that could not be read is ``not_judged``.
        reasons: why.
        report: link to its report, relative to the index page, or None.
        collisions, near_misses: counts of alarms of single joints, and of near misses.
        judged_h: hours in which at least one joint was judged, taken as those of the joint judged longest.
        error: why it could not be audited at all, or None.
        contacts: count of contacts: of alarms that belong together.
        noticed_n: force at the tool (or the place asked for) that would have been noticed for the share of the motion
            that the policy asks; None where none would, or none is known.
        noticed: the same in words; empty where nothing is told.
        exclusions: what the verdict does not cover.
        start: when the log was recorded, ISO 8601 UTC; None where it does not tell.
        level_nm: RMS of each watched joint's judged residual, N·m; None where nothing was judged.
        units: by joint, of what its drive exerts: N·m, or N of a prismatic joint.
        robot: whose log it is; None without a fleet.
        contact_states: how many contacts are new, known, back and accepted.
    """

    name: str
    verdict: Verdict
    reasons: tuple[str, ...]
    report: str | None
    collisions: int
    near_misses: int
    judged_h: float
    error: str | None = None
    contacts: int = 0
    noticed_n: float | None = None
    noticed: str = ""
    exclusions: tuple[str, ...] = ()
    start: str | None = None
    level_nm: dict[str, float | None] = field(default_factory=dict)
    units: dict[str, str] = field(default_factory=dict)
    robot: str | None = None
    contact_states: dict[ContactState, int] = field(default_factory=dict)

    @property
    def place(self) -> str:
        """The name without the robot."""
        return self.name.removeprefix(f"{self.robot}/")

    @property
    def word(self) -> str:
        """The verdict in words."""
        return verdict_word(self.verdict, self.exclusions)

    @property
    def counts_mean_something(self) -> bool:
        """False when nothing was judged, so that no events were found because none were looked for."""
        return self.judged_h > 0 or self.collisions > 0 or self.near_misses > 0

    def counted(self, count: int) -> str:
        """A count of events; a dash, never 0, where the log or all of its time was not judged."""
        none_means_nothing = self.verdict == "not_judged" or not self.counts_mean_something
        return "–" if not count and none_means_nothing else str(count)


def entry_of(result: AuditResult, report: str | None = None) -> IndexEntry:
    """The line of one audit.

    Args:
        result: the audit.
        report: link to its report, relative to the index page.
    """
    watched = [joint for joint in result.coverage.joints.values() if joint.watched]
    longest = 0.0 if nothing_judged(result) else max(joint.judged_s + joint.standing_s for joint in watched)
    return IndexEntry(
        name=result.log.name,
        verdict=result.verdict,
        reasons=result.reasons,
        report=report,
        collisions=len(result.collisions),
        near_misses=len(result.near_misses),
        judged_h=longest / 3600,
        contacts=len(result.contacts),
        noticed_n=noticed_n(result),
        noticed=noticed_brief(result),
        exclusions=result.exclusions,
        start=result.log.start,
        level_nm={name: stats.rms_nm for name, stats in result.residual.items() if name in result.rule.watch},
        units=dict(result.log.units),
        contact_states=dict(Counter(contact.state for contact in result.contacts)),
    )


def entry_of_error(name: str, error: CollauditError, robot: str | None = None) -> IndexEntry:
    """The line of a log, and robot of a fleet, that could not be audited."""
    return IndexEntry(name, "not_judged", (error.message,), None, 0, 0, 0.0, error.render(), robot=robot)


def brief_reason(entry: IndexEntry, most: int = 72) -> str:
    """The first of its reasons, or else exclusions, cut to so many characters."""
    first = next(iter((*entry.reasons, *entry.exclusions)), "")
    return first if len(first) <= most else first[:most].rpartition(" ")[0] + "…"


def worst_first(entries: Iterable[IndexEntry]) -> list[IndexEntry]:
    """Failed logs first, those with most contacts leading; then what was not judged; then what passed."""
    return sorted(
        entries,
        key=lambda e: (
            _ORDER[e.verdict],
            e.error is None,
            -e.contacts,
            -e.collisions,
            -e.near_misses,
            _counted_name(e.name),
            e.name,
        ),
    )


def _counted_name(name: str) -> tuple[str | int, ...]:
    """A name in its parts, numbers as such: run2 before run10."""
    return tuple(int(part) if k % 2 else part for k, part in enumerate(re.split(r"(\d+)", name)))


def verdict_counts(entries: Sequence[IndexEntry]) -> dict[Verdict, int]:
    """How many logs have each verdict."""
    return {verdict: sum(entry.verdict == verdict for entry in entries) for verdict in _ORDER}


def worst_verdict(entries: Sequence[IndexEntry]) -> Verdict:
    """The verdict on all of them: a breach outweighs what could not be judged, and that outweighs a pass."""
    return min((entry.verdict for entry in entries), key=_ORDER.__getitem__, default="not_judged")


def night_dates(entries: Sequence[IndexEntry]) -> str:
    """On which days the logs were recorded, UTC."""
    days = sorted({entry.start[:10] for entry in entries if entry.start})
    if not days:
        return "date not known"
    return days[0] if len(days) == 1 else f"{days[0]} to {days[-1]}"


def nights_before(tonight: Mapping[str, Sequence[NightRow]], stored: Sequence[NightRow]) -> dict[str, list[Verdict]]:
    """What became of each log in its last nights, tonight being the last; the worst, where a name was there twice.

    Args:
        tonight: by name of log, its rows.
        stored: rows of nights before; of a log that was judged again tonight the new ones count.
    """
    new = [row for rows in tonight.values() for row in rows]
    again = {row.identity for row in new}
    found: dict[tuple[str, str], dict[str, Verdict]] = {(row.robot, row.log): {} for row in new}
    for row in [*(row for row in stored if row.identity not in again), *new]:
        nights = found.get((row.robot, row.log))
        if nights is not None:
            verdict = cast("Verdict", row.verdict)
            nights[row.night] = min(verdict, nights.get(row.night, verdict), key=_ORDER.__getitem__)
    verdicts = {identity: [verdict for _, verdict in sorted(nights.items())] for identity, nights in found.items()}
    return {name: verdicts[rows[0].robot, rows[0].log][-_MOST_NIGHTS:] for name, rows in tonight.items()}
