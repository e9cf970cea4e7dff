"""Trends over nights, for a terminal."""

from __future__ import annotations

from collections.abc import Sequence

from collaudit.core.history.robot_trend import RobotTrend
from collaudit.reports.sections.trend_sections import robot_section
from collaudit.reports.terminal.section_text import section_text
from collaudit.reports.terminal.text_table import wrapped
from collaudit.reports.values.trend_values import CAUSE_WORDS, change_text
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
    lines += [""] if changed else []
    lines.append(f"{len(trends)} robots, {len(trends) - len(changed)} without a significant change.")
    return "\n".join(lines) + f"\n\n{section_text(robot_section(trends), width)}"
