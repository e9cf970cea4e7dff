"""A night in a sentence, and what the nights before it were for each log."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from collaudit.core.data.audit_result import Verdict
from collaudit.core.history.log_record import LogRecord
from collaudit.core.history.robot_trend import RobotTrend
from collaudit.reports.values.entries import IndexEntry, verdict_counts
from collaudit.reports.values.trend_values import CAUSE_WORDS
from collaudit.reports.values.words import plural

#: Nights that a line shows.
_MOST_NIGHTS = 14
_VERDICTS: dict[str, Verdict] = {"fail": "fail", "not_judged": "not_judged", "pass": "pass"}


@dataclass(frozen=True, slots=True)
class NightBefore:
    """What became of a log of one name in one night: the worst, where there were several."""

    night: str
    verdict: Verdict


def night_sentence(entries: Sequence[IndexEntry], trends: Sequence[RobotTrend] = ()) -> str:
    """How many logs were judged, contacts by robot, and joints that changed over the nights.

    Args:
        entries: the logs, as decided.
        trends: of their robots, tonight included; none where no store is kept.
    """
    counts = verdict_counts(entries)
    judged = len(entries) - counts["not_judged"]
    said = [f"{judged} of {plural(len(entries), 'log')} judged"]
    if counts["fail"]:
        said.append(f"{counts['fail']} {'breaks' if counts['fail'] == 1 else 'break'} the policy")
    robots = {entry.robot: [e for e in entries if e.robot == entry.robot] for entry in entries}
    touched = [_contacts(robot, own) for robot, own in robots.items() if any(e.contacts for e in own)]
    said += touched if touched or not judged else ["no contact"]
    for trend in trends:
        for event in trend.events:
            lead = event.changes[0]
            said.append(f"{lead.joint} of {trend.robot}: {CAUSE_WORDS[event.cause]} since {lead.night}")
    return "; ".join(said) + "."


def _contacts(robot: str | None, entries: Sequence[IndexEntry]) -> str:
    where = "" if robot is None else f" on robot {robot}"
    total = sum(entry.contacts for entry in entries)
    compared = [entry.new_contacts for entry in entries if entry.new_contacts is not None]
    if not compared:
        return f"{plural(total, 'contact')}{where}"
    known = total - sum(compared)
    return f"{plural(sum(compared), 'new contact')}{where}" + (f" ({known} known)" if known else "")


def nights_before(tonight: Mapping[str, LogRecord], stored: Sequence[LogRecord]) -> dict[str, tuple[NightBefore, ...]]:
    """The last nights of each log, tonight being the last of them.

    Args:
        tonight: by name of log, its record.
        stored: records of nights before; of a log that was judged again tonight the new record counts.
    """
    again = {record.identity for record in tonight.values()}
    found: dict[tuple[str, str], dict[str, Verdict]] = {(r.robot, r.log): {} for r in tonight.values()}
    for record in [*(record for record in stored if record.identity not in again), *tonight.values()]:
        nights = found.get((record.robot, record.log))
        if nights is not None:
            verdict = _VERDICTS[record.decided_verdict or record.verdict]
            nights[record.night] = min(verdict, nights.get(record.night, verdict), key=list(_VERDICTS).index)
    return {
        name: tuple(NightBefore(*night) for night in sorted(found[r.robot, r.log].items())[-_MOST_NIGHTS:])
        for name, r in tonight.items()
    }
