"""A night in words: how many logs were judged, then robot by robot what explains its failures, and what is gone."""

from __future__ import annotations

from collections.abc import Sequence

from collaudit.core.history.night_groups import Moment, NightGroup
from collaudit.reports.sections.section import Section
from collaudit.reports.values.entries import IndexEntry, night_sentence
from collaudit.reports.values.words import NONE, clock_text, plural

#: Robots that the sentence tells of, groups of each, times of a group, logs that a row names.
_MOST_ROBOTS, _MOST_GROUPS, _MOST_TIMES, _MOST_LOGS = 3, 3, 3, 3


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
        told = [group_words(group) for group in own[:_MOST_GROUPS]]
        if own[0].cause and not any(group.moments and not group.cause for group in own):
            told.insert(1, "no contact on another joint" if own[0].joints else "no contact besides")
        told += [f"{len(own) - _MOST_GROUPS} more below"] if len(own) > _MOST_GROUPS else []
        text = "; ".join(told)
        lines.append(f"{text[0].upper()}{text[1:]}." if robot is None else f"Robot {robot}: {text}.")
    left = len(robots) - _MOST_ROBOTS
    return " ".join([*lines, *([f"{plural(left, 'more robot')} below."] if left > 0 else [])])


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
            group.robot or NONE,
            group.text or f"contact of {', '.join(group.joints)}{_place(group)}",
            group.since or ("tonight" if group.moments or group.cause else NONE),
            str(group.nights),
            _logs(group.logs),
        )
        for group in groups
    )
    head = ("state", "robot", "what", "since", "nights", "logs")
    note = (
        "One row for what is alike: same robot, cause and joints, or contacts whose strongest joints and place agree. "
        "Flaky: came and went at least twice. Not tested: an earlier night had it, and tonight nothing could have "
        "shown it."
    )
    return Section("What fails, by cause and place", head, rows, (note,) if rows else ())


def _place(group: NightGroup) -> str:
    return "" if group.place_m is None else ", tool at ({:.2f}, {:.2f}, {:.2f}) m".format(*group.place_m)


def _logs(names: Sequence[str]) -> str:
    more = len(names) - _MOST_LOGS
    return ", ".join(names[:_MOST_LOGS]) + (f" and {more} more" if more > 0 else "")


def _time(moment: Moment) -> str:
    """On the clock, UTC, or of the log where it tells none."""
    clock = clock_text(moment.start, moment.onset_s).partition(" ")[2]
    return clock[:8] if clock else f"{moment.onset_s:.1f} s"
