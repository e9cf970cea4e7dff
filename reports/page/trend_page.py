"""The page of a fleet's trends: what changed first, then every robot with its joints' series as drawings.

All drawings are inline SVG without a script: a page of 10,000 joints carries no plot library at all.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from markupsafe import Markup

from collaudit.core.history.joint_series import NightSeries, Quantity
from collaudit.core.history.robot_trend import RobotTrend
from collaudit.core.history.series_changes import Change
from collaudit.core.numeric.stats import STANDARD_ERRORS_95
from collaudit.reports.page.environment import environment
from collaudit.reports.plots.svg import Panel, drawing
from collaudit.reports.sections.trend_sections import CAUSE_WORDS, QUANTITY_WORDS, change_text, robot_section
from collaudit.reports.values.numbers import significant
from collaudit.reports.values.visible_text import visible

_WIDTH, _HEIGHT = 260, 84
#: Drawn of every joint; the others only where they changed.
_ALWAYS: tuple[Quantity, ...] = ("friction", "residual", "margin")
#: Robots without a change whose joints are drawn; further ones stand in the table.
_MOST_QUIET = 20


#: One series: its joint, its name, first and last value, and the drawing.
_Figure = tuple[str, str, str, Markup]


def trend_page(trends: Sequence[RobotTrend]) -> str:
    """The page as text, the same for the same trends; robots with changes first, those with most of them leading."""
    ordered = sorted(trends, key=lambda trend: (-len(trend.events), trend.robot))
    changed = sum(bool(trend.events) for trend in trends)
    drawn = ordered[: changed + _MOST_QUIET]
    return (
        environment()
        .get_template("trend.html.j2")
        .render(
            trends=ordered,
            figures=[(trend.robot, _figures(trend, number)) for number, trend in enumerate(drawn, 1)],
            nights=sorted({night for trend in trends for night in trend.nights}),
            changed=changed,
            robots=robot_section(ordered),
            cause_words=CAUSE_WORDS,
            change_text=change_text,
        )
    )


def _figures(trend: RobotTrend, number: int) -> list[_Figure]:
    """What is always drawn of each joint, and what changed."""
    changes = [change for event in trend.events for change in event.changes]
    figures: list[_Figure] = []
    for joint, own in trend.series.items():
        for quantity, series in own.items():
            found = [change for change in changes if change.joint == joint and change.quantity == quantity]
            if series.nights and (found or quantity in _ALWAYS):
                figures.append(_figure(joint, series, found, f"r{number}-{len(figures)}"))
    return figures


def _figure(joint: str, series: NightSeries, changes: Sequence[Change], key: str) -> _Figure:
    name, unit = QUANTITY_WORDS[series.quantity]
    scale = 100.0 if series.quantity == "load" else 1.0
    t, y = series.days, scale * series.value
    half = STANDARD_ERRORS_95 * scale * series.se
    low, high = float(np.min(y - half)), float(np.max(y + half))
    room = 0.1 * (high - low) or 0.05 * abs(high) or 1.0
    panel = Panel((44, 14, _WIDTH - 52, _HEIGHT - 22), (0.0, float(t[-1])), (low - room, high + room))
    panel.y_axis(unit, 3)
    panel.area(t, y - half, y + half, "band")
    panel.line(t, y, "curve")
    for change in changes:
        panel.moments([float(t[series.nights.index(change.night)])], "onset")
    words = f"{name} of {joint}, {series.nights[0]} to {series.nights[-1]}: {significant(float(y[0]))} to "
    label = visible(f"{words}{significant(float(y[-1]))} {unit}".strip())
    text = f"{significant(float(y[0]))} → {significant(float(y[-1]))} {unit}".strip()
    return joint, name, text, drawing(_WIDTH, _HEIGHT, label, [panel], key)
