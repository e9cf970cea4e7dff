"""A night beside its logs, and in words: files left out, acceptances, limits, what explains its failures."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from urllib.parse import quote

from collaudit.core.contacts.contact_states import AcceptanceUse
from collaudit.core.data.audit_result import Verdict
from collaudit.core.data.joint_log import LeftOut
from collaudit.core.data.signals import LEAST_CHANGE, ProgramComparison
from collaudit.core.errors import NotJudgedError
from collaudit.core.history.night_groups import Moment, NightGroup
from collaudit.reports.sections.section import Section, section_of
from collaudit.reports.values.entries import IndexEntry, entry_of_error, verdict_counts, worst_verdict
from collaudit.reports.values.words import NONE, clock_text, plural


@dataclass(frozen=True, slots=True)
class NightFacts:
    """A night as a whole.

    Attributes:
        breaches: limits that all logs of a robot break together, a sentence each.
        left_out: files of its folders that were not judged; those that count as such are lines of their own, too.
        accepted: what became of each entry of accepted.toml.
        robots: whose each log is, by its name, where that is known.
        groups: what fails, by cause and place.
        reports: links to reports, relative to the audit's folder, by name of log.
        link: what these links begin with: where the folder will be found.
        changes: what changed in the programs of logs since an earlier audit.
        overlays: links to pages that lay a log over the same log of the baseline, by its name.
    """

    breaches: tuple[str, ...] = ()
    left_out: tuple[LeftOut, ...] = ()
    accepted: tuple[AcceptanceUse, ...] = ()
    robots: Mapping[str, str] = field(default_factory=dict)
    groups: tuple[NightGroup, ...] = ()
    reports: Mapping[str, str] = field(default_factory=dict)
    link: str = ""
    overlays: Mapping[str, str] = field(default_factory=dict)
    changes: tuple[ProgramComparison, ...] = ()

    @property
    def named(self) -> list[LeftOut]:
        """Files that are named and do not count."""
        return [file for file in self.left_out if not file.not_judged and file.kind != "companion"]

    @property
    def stale(self) -> list[AcceptanceUse]:
        """Entries of accepted.toml that a person should look at."""
        return [use for use in self.accepted if use.state not in ("counted", "not asked")]

    def link_of(self, name: str) -> str:
        """Where the report of a log is; the index page for a log without one; empty where nobody knows."""
        report = self.reports.get(name, "index.html")
        return self.link + quote(report.encode("utf-8", "surrogateescape"), safe="/") if self.reports else ""

    def sentence(self, entries: Sequence[IndexEntry]) -> str:
        """What is said of all logs."""
        return night_sentence(entries, self.groups)

    def verdict(self, entries: Sequence[IndexEntry]) -> Verdict:
        """The verdict on the night: the worst of its lines, and a failure where a limit is broken over all of them."""
        return "fail" if self.breaches else worst_verdict(entries)


#: A night of which nothing is said beside its logs.
QUIET = NightFacts()


def left_out_entries(files: Sequence[LeftOut]) -> list[IndexEntry]:
    """The lines of files that count as logs that were not judged."""
    return [
        entry_of_error(file.name, NotJudgedError(f"not judged: {file.text}", where=file.name))
        for file in files
        if file.not_judged
    ]


#: Robots that the sentence tells of, clauses of each, times of a group, logs and joints that a row names.
_MOST_ROBOTS, _MOST_CLAUSES, _MOST_TIMES, _MOST_LOGS, _MOST_JOINTS = 3, 3, 3, 3, 3
#: Contacts of one state at more places are said together.
_MOST_PLACES = 2


def night_sentence(entries: Sequence[IndexEntry], groups: Sequence[NightGroup] = ()) -> str:
    """How many logs were judged and failed; then what explains the failures of each robot, or its contacts.

    Args:
        entries: the logs, as decided.
        groups: of the night, what matters most first.
    """
    counts = verdict_counts(entries)
    judged = len(entries) - counts["not_judged"]
    said = [f"{judged} of {plural(len(entries), 'log')} judged"]
    if counts["fail"]:
        said.append(f"{counts['fail']} {'breaks' if counts['fail'] == 1 else 'break'} the policy")
    if not groups:
        owners = dict.fromkeys(entry.robot for entry in entries)
        touched = [text for robot in owners if (text := _contacts(robot, entries))]
        said += touched if touched or not judged else ["no contact"]
        return f"{'; '.join(said)}."
    robots = dict.fromkeys(group.robot for group in groups)
    lines = [f"{'; '.join(said)}."]
    for robot in [*robots][:_MOST_ROBOTS]:
        own = [group for group in groups if group.robot == robot]
        told = _clauses(own)
        if own[0].cause and not any(group.moments and not group.cause for group in own):
            told.insert(1, "no contact on another joint" if own[0].joints else "no contact besides")
        more = [f"{len(told) - _MOST_CLAUSES} more below"] if len(told) > _MOST_CLAUSES else []
        text = "; ".join([*told[:_MOST_CLAUSES], *more])
        lines.append(f"{text[0].upper()}{text[1:]}." if robot is None else f"Robot {robot}: {text}.")
    left = len(robots) - _MOST_ROBOTS
    return " ".join([*lines, *([f"{plural(left, 'more robot')} below."] if left > 0 else [])])


def _contacts(robot: str | None, entries: Sequence[IndexEntry]) -> str:
    """How many contacts of a robot, and of which states where not all are new; empty without any."""
    own = [entry for entry in entries if entry.robot == robot and entry.contacts]
    states = sum((Counter(entry.contact_states) for entry in own), Counter[str]())
    parts = [f"{states[state]} {state}" for state in ("new", "known", "back", "accepted") if states[state]]
    told = f" ({', '.join(parts)})" if set(states) - {"new"} else ""
    where = "" if robot is None else f" on robot {robot}"
    return plural(sum(entry.contacts for entry in own), "contact") + where + told if own else ""


def _clauses(groups: Sequence[NightGroup]) -> list[str]:
    """What to say of one robot's groups: contacts of one state at more than a few places together."""
    told, summed = [], set[str]()
    for group in groups:
        places = [one for one in groups if one.moments and not one.cause and one.state == group.state]
        if group not in places or len(places) <= _MOST_PLACES:
            told.append(group_words(group))
        elif group.state not in summed:
            summed.add(group.state)
            told.append(_summed(places))
    return told


def _summed(places: Sequence[NightGroup]) -> str:
    """Contacts at many places: how many, the first of them, in how many logs."""
    moments = [moment for group in places for moment in group.moments]
    first = min(moments, key=lambda moment: clock_text(moment.start, moment.onset_s))
    joint = next(group.joints[0] for group in places if first in group.moments)
    what = plural(len(moments), f"{places[0].state} contact")
    logs = plural(len({moment.log for moment in moments}), "log")
    return f"{what} at {len(places)} places in {logs}, the first at {_time(first)} ({joint})"


def group_words(group: NightGroup) -> str:
    """One group in a clause: what it is, since when, how many logs."""
    joints = ", ".join(group.joints[:2])
    if group.cause:
        since = f" since {group.since}" if group.since else ""
        does = "does" if len(group.logs) == 1 else "do"
        return f"{group.text}{since}; {plural(len(group.logs), 'log')} {does} not pass by it"
    aged = f" since {group.since} ({plural(group.nights, 'night')})" if group.since else ""
    if not group.moments:
        return f"{group.state}: the contact of {joints}{f' known{aged}' if aged else ''}"
    times = [_time(moment) for moment in group.moments[:_MOST_TIMES]]
    more = len(group.moments) - len(times)
    at = " and ".join([", ".join(times[:-1]), times[-1]] if len(times) > 1 else times)
    place = ", same place" if len(group.moments) > 1 else ""
    what = plural(len(group.moments), f"{group.state} contact")
    return f"{what} at {at}{f' and {more} more' if more else ''}{place} ({joints}{aged})"


def group_section(groups: Sequence[NightGroup]) -> Section:
    """A row a group: its state, whose, what, where, since when, in which logs."""
    records = (
        {
            "state": group.state,
            "robot": group.robot or "",
            "what": group.text or f"contact of {_some(group.joints, _MOST_JOINTS)}{_place(group)}",
            "since": group.since or ("tonight" if group.moments or group.cause else NONE),
            "nights": str(group.nights),
            "logs": _some(group.logs, _MOST_LOGS),
        }
        for group in groups
    )
    note = (
        "One row for what is alike: same robot, cause and joints, or contacts whose strongest joints and place agree. "
        "Flaky: came and went at least twice. Not tested: an earlier night had it, and tonight nothing could have "
        "shown it."
    )
    found = section_of("What fails, by cause and place", records, note)
    return found.only(*found.columns)


def change_section(compared: Sequence[ProgramComparison]) -> Section:
    """A row a log: what changed in its program since an earlier log, and within what the rest is equal."""
    records = (
        {
            "log": one.log,
            "since": one.against or NONE,
            "changed": one.reason
            or "; ".join(change.text for change in one.changes if change.changed)
            or "nothing shown",
            "equal": "; ".join(change.text for change in one.changes if not change.changed) or NONE,
        }
        for one in compared
    )
    least = {name: 100.0 * x if name in ("speed", "friction", "residual") else x for name, x in LEAST_CHANGE.items()}
    note = (
        "The same place of the path in both logs; 95 % intervals over cycles. Worth a word from {path:g} mm (tool), "
        "{speed:g} % of speed, {load:g} kg at the tool's frame, {friction:g} % of friction, {residual:g} % of γ on."
    ).format(**least)
    return section_of("What changed in the programs", records, note)


def _place(group: NightGroup) -> str:
    return "" if group.place_m is None else ", tool at ({:.2f}, {:.2f}, {:.2f}) m".format(*group.place_m)


def _some(names: Sequence[str], most: int) -> str:
    more = len(names) - most
    return ", ".join(names[:most]) + (f" and {more} more" if more > 0 else "")


def _time(moment: Moment) -> str:
    """On the clock, UTC, or of the log where it tells none."""
    clock = clock_text(moment.start, moment.onset_s).partition(" ")[2]
    return clock[:8] if clock else f"{moment.onset_s:.1f} s"
