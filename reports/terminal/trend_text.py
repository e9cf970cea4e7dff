"""Trends over nights, for a terminal."""

from __future__ import annotations

from collections.abc import Sequence

from collaudit.core.history.robot_trend import RobotTrend
from collaudit.reports.terminal.text_table import table, wrapped
from collaudit.reports.values.numbers import significant
from collaudit.reports.values.trend_values import CAUSE_WORDS, change_text, rate_text
from collaudit.reports.values.visible_text import visible


def trend_text(trends: Sequence[RobotTrend], width: int | None = None) -> str:
    """What changed, robot by robot; then a table of all robots.

    Args:
        trends: of the robots.
        width: columns of the terminal; None: any.
    """
    if not trends:
        return "The store holds no log of these robots and nights.\n"
    changed = [trend for trend in trends if trend.events]
    lines = []
    for trend in changed:
        lines.append(visible(trend.robot))
        for event in trend.events:
            lines.append(wrapped(f"  {CAUSE_WORDS[event.cause]}: {visible(event.text)}", width, "    "))
            lines += [wrapped(f"    {visible(change_text(change))}", width, "      ") for change in event.changes]
    if changed:
        lines.append("")
    quiet = len(trends) - len(changed)
    lines.append(f"{len(trends)} robots, {quiet} without a significant change.\n")
    head = ("robot", "nights", "logs", "fail", "not judged", "judged", "contacts", "near misses an hour")
    rows = [_row(trend) for trend in trends]
    text = "\n".join(lines) + "\n" + table(head, rows, (1, 2, 3, 4, 5, 6), width, fold=True)
    untold = [(trend.robot, words) for trend in trends for words in trend.untold]
    said = {words: [robot for robot, other in untold if other == words] for _, words in untold}
    for words, robots in said.items():
        who = "all robots" if len(robots) == len(trends) else ", ".join(map(visible, robots))
        text += wrapped(f"not told ({who}): {visible(words)}", width, "  ") + "\n"
    return text


def _row(trend: RobotTrend) -> tuple[str, ...]:
    return (
        trend.robot,
        str(len(trend.nights)),
        str(trend.logs),
        str(trend.verdicts["fail"]),
        str(trend.not_judged),
        f"{significant(trend.contacts.hours)} h",
        str(trend.contacts.count) if trend.contacts.hours > 0 else "–",
        rate_text(trend.near_misses),
    )
