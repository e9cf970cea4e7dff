"""A night in words: how many logs were judged, then robot by robot what explains its failures, and what is gone."""

from __future__ import annotations

from collections.abc import Sequence

from collaudit.core.data.cycles_result import LEAST_CHANGE, ProgramComparison
from collaudit.core.history.night_groups import Moment, NightGroup
from collaudit.reports.sections.section import Section
from collaudit.reports.values.entries import IndexEntry, night_sentence
from collaudit.reports.values.words import NONE, clock_text, plural

#: Robots that the sentence tells of, clauses of each, times of a group, logs and joints that a row names.
_MOST_ROBOTS, _MOST_CLAUSES, _MOST_TIMES, _MOST_LOGS, _MOST_JOINTS = 3, 3, 3, 3, 3
#: Contacts of one state at more places are said together.
_MOST_PLACES = 2


def explained_night(entries: Sequence[IndexEntry], groups: Sequence[NightGroup]) -> str:
    """Counts, then what explains the failures of each robot.

    Args:
        entries: the logs, as decided.
        groups: of the night, what matters most first.
    """
    if not groups:
        return night_sentence(entries)
    robots = dict.fromkeys(group.robot for group in groups)
    said = [night_sentence(entries).partition("; ")[0].rstrip(".")]
    failed = sum(entry.verdict == "fail" for entry in entries)
    said += [f"{failed} {'breaks' if failed == 1 else 'break'} the policy"] if failed else []
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
    rows = tuple(
        (
            group.state,
            group.robot or "",
            group.text or f"contact of {_some(group.joints, _MOST_JOINTS)}{_place(group)}",
            group.since or ("tonight" if group.moments or group.cause else NONE),
            str(group.nights),
            _some(group.logs, _MOST_LOGS),
        )
        for group in groups
    )
    head = ("state", "robot", "what", "since", "nights", "logs")
    note = (
        "One row for what is alike: same robot, cause and joints, or contacts whose strongest joints and place agree. "
        "Flaky: came and went at least twice. Not tested: an earlier night had it, and tonight nothing could have "
        "shown it."
    )
    return Section("What fails, by cause and place", head, rows, (note,) if rows else ()).only(*head)


def change_section(compared: Sequence[ProgramComparison]) -> Section:
    """A row a log: what changed in its program since an earlier log, and within what the rest is equal."""
    rows = tuple(
        (
            one.log,
            one.against or NONE,
            one.reason or "; ".join(change.text for change in one.changes if change.changed) or "nothing shown",
            "; ".join(change.text for change in one.changes if not change.changed) or NONE,
        )
        for one in compared
    )
    least = {name: 100.0 * x if name in ("speed", "friction", "residual") else x for name, x in LEAST_CHANGE.items()}
    note = (
        "The same place of the path in both logs; 95 % intervals over cycles. Worth a word from {path:g} mm (tool), "
        "{speed:g} % of speed, {load:g} kg at the tool's frame, {friction:g} % of friction, {residual:g} % of γ on."
    ).format(**least)
    return Section("What changed in the programs", ("log", "since", "changed", "equal"), rows, (note,) if rows else ())


def _place(group: NightGroup) -> str:
    return "" if group.place_m is None else ", tool at ({:.2f}, {:.2f}, {:.2f}) m".format(*group.place_m)


def _some(names: Sequence[str], most: int) -> str:
    more = len(names) - most
    return ", ".join(names[:most]) + (f" and {more} more" if more > 0 else "")


def _time(moment: Moment) -> str:
    """On the clock, UTC, or of the log where it tells none."""
    clock = clock_text(moment.start, moment.onset_s).partition(" ")[2]
    return clock[:8] if clock else f"{moment.onset_s:.1f} s"
