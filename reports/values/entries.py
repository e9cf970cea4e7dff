"""One line per audited log: what index pages, summaries and CI formats are made of."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

from collaudit.core.data.audit_result import AuditResult, Verdict
from collaudit.core.errors import CollauditError
from collaudit.reports.values.noticed import noticed_brief, noticed_n
from collaudit.reports.values.words import nothing_judged, verdict_word

_ORDER: dict[Verdict, int] = {"fail": 0, "not_judged": 1, "pass": 2}


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
        new_contacts: contacts that the baseline does not have; None without one.
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
    new_contacts: int | None = None

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
        key=lambda e: (_ORDER[e.verdict], e.error is None, -e.contacts, -e.collisions, -e.near_misses, e.name),
    )


def verdict_counts(entries: Sequence[IndexEntry]) -> dict[Verdict, int]:
    """How many logs have each verdict."""
    return {verdict: sum(entry.verdict == verdict for entry in entries) for verdict in _ORDER}


def worst_verdict(entries: Sequence[IndexEntry]) -> Verdict:
    """The verdict on all of them: a breach outweighs what could not be judged, and that outweighs a pass."""
    return min((entry.verdict for entry in entries), key=_ORDER.__getitem__, default="not_judged")
