"""A fleet over nights: every robot in a line, and what cannot be told."""

from __future__ import annotations

from collections.abc import Sequence

from collaudit.core.history.robot_trend import RobotTrend
from collaudit.reports.sections.section import Section
from collaudit.reports.values.numbers import significant
from collaudit.reports.values.trend_values import rate_text


def robot_section(trends: Sequence[RobotTrend]) -> Section:
    """A line a robot; the notes say what cannot be told, and of whom."""
    rows = tuple(
        (
            trend.robot,
            str(len(trend.nights)),
            str(trend.logs),
            str(trend.verdicts["fail"]),
            str(trend.not_judged),
            f"{significant(trend.contacts.hours)} h",
            rate_text(trend.contacts),
            rate_text(trend.near_misses),
        )
        for trend in trends
    )
    head = ("robot", "nights", "logs", "failed", "not judged", "judged", "contacts [95 %]", "near misses [95 %]")
    untold: dict[str, list[str]] = {}
    for trend in trends:
        for words in trend.untold:
            untold.setdefault(words, []).append(trend.robot)
    notes = tuple(
        f"Not told ({'all robots' if len(robots) == len(trends) else ', '.join(robots)}): {words}"
        for words, robots in untold.items()
    )
    return Section("Robots", head, rows, notes)
