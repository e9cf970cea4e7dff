"""The page of a fleet's nights: every joint's level, friction and threshold as drawings, and the table.

All drawings are inline SVG without a script: a page of 10,000 joints carries no plot library at all.
"""

from __future__ import annotations

from collections.abc import Sequence
from datetime import date

import numpy as np
from markupsafe import Markup

from collaudit.core.history.joint_nights import JointNights
from collaudit.core.numeric.arrays import FloatArray
from collaudit.reports.page.environment import environment
from collaudit.reports.plots.svg import Panel, drawing
from collaudit.reports.sections.trend_sections import first_and_last, nights_section
from collaudit.reports.values.visible_text import visible

_WIDTH, _HEIGHT = 260, 84


def trend_page(joints: Sequence[JointNights]) -> str:
    """The page as text, the same for the same nights."""
    nights = sorted({night.night for one in joints for night in one.nights})
    robots = dict.fromkeys(one.robot for one in joints)
    drawn = [
        (robot, [_figure(one, f"j{number}") for number, one in enumerate(joints) if one.robot == robot])
        for robot in robots
    ]
    table = nights_section(joints)
    return environment().get_template("trend.html.j2").render(robots=drawn, nights=nights, table=table)


def _figure(one: JointNights, key: str) -> tuple[str, str, Markup]:
    """Joint, what is drawn in words, and the drawing: level, friction dotted, γ, a line at nights with contact."""
    days = np.array([date.fromisoformat(night.night).toordinal() for night in one.nights], dtype=np.float64)
    level = _values([night.level_nm for night in one.nights])
    friction = _values([night.friction_nm for night in one.nights])
    gamma = _values([night.gamma_nm for night in one.nights])
    top = max((float(np.nanmax(x)) for x in (level, friction, gamma) if np.isfinite(x).any()), default=1.0)
    panel = Panel((44, 14, _WIDTH - 52, _HEIGHT - 22), (days[0], days[-1]), (0.0, 1.1 * top))
    panel.y_axis("N·m", 3)
    panel.line(days, level, "curve")
    panel.line(days, friction, "model")
    panel.line(days, gamma, "gamma")
    panel.moments(days[[night.contacts > 0 for night in one.nights]].tolist(), "onset")
    words = f"level {first_and_last([night.level_nm for night in one.nights])} N·m"
    label = visible(f"{one.joint}: {words}, {one.nights[0].night} to {one.nights[-1].night}")
    return one.joint, words, drawing(_WIDTH, _HEIGHT, label, [panel], key)


def _values(values: Sequence[float | None]) -> FloatArray:
    return np.array([np.nan if value is None else value for value in values], dtype=np.float64)
