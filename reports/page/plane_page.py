"""The page of alarms over threshold and persistence: one drawing a joint, cells shaded by their number of alarms."""

from __future__ import annotations

from collections.abc import Mapping
from math import log10, sqrt

import numpy as np
from markupsafe import Markup

from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.recommend.alarm_plane import AlarmPlane
from collaudit.core.recommend.arm_recommendation import ArmRecommendation
from collaudit.reports.page.environment import environment
from collaudit.reports.plots.svg import Panel, drawing
from collaudit.reports.sections.rule_sections import plane_section
from collaudit.reports.values.visible_text import visible

#: Shades from no alarm to many, and the counts at which they change.
_SHADES = ("#f4f7fa", "#d3e0ec", "#a9c3da", "#7aa3c5", "#4b81ad", "#255f90", "#0b3f6e")
_FROM = (1, 2, 4, 10, 30, 100)
_LEFT, _TOP, _WIDE, _HIGH = 46.0, 20.0, 300.0, 216.0


def plane_page(arms: Mapping[str, ArmRecommendation]) -> str:
    """The page as text, the same for the same recommendations.

    Args:
        arms: recommendations by robot.
    """
    shown = [
        (
            robot,
            plane_section(found.planes, found.units),
            [
                (joint, plane_plot(plane, f"Alarms of {joint} over γ and persistence", found.units.get(joint, "N·m")))
                for joint, plane in found.planes.items()
            ],
        )
        for robot, found in arms.items()
    ]
    return environment().get_template("plane.html.j2").render(arms=shown)


def plane_plot(plane: AlarmPlane, label: str, unit: str = "N·m") -> Markup:
    """Alarms over persistence (ms) and threshold, both logarithmic, with lines at the set and recommended thresholds.

    Args:
        plane: of one joint.
        label: for those who cannot see the drawing; any text.
        unit: of what the joint's drive exerts.
    """
    x, y = _borders(1e3 * np.array(plane.persistence_s)), _borders(np.array(plane.gamma_nm))
    panel = Panel((_LEFT, _TOP, _WIDE, _HIGH), (x[0], x[-1]), (y[0], y[-1]))
    rows = np.linspace(y[0], y[-1], len(plane.gamma_nm) + 1)
    ranks = np.searchsorted(_FROM, np.array(plane.alarms), side="right")
    for rank, shade in enumerate(_SHADES):
        panel.cells(ranks == rank, x, rows, shade)
    for gamma, kind in ((plane.set_nm, "gamma"), (plane.recommended_nm, "rule")):
        if gamma is not None and y[0] <= log10(gamma) <= y[-1]:
            panel.level(log10(gamma), kind)
    panel.y_axis(f"γ, {unit}", decades=True)
    panel.x_axis("persistence, ms", decades=True)
    return drawing(
        round(_LEFT + _WIDE + 10), round(_TOP + _HIGH + 34), visible(label), [panel], "", "plot plane", False
    )


def _borders(values: FloatArray) -> FloatArray:
    """(k + 1,) logarithms of the borders of cells around k rising values in about equal ratios."""
    ratio = sqrt(float(values[1] / values[0]))
    return np.asarray(np.log10([values[0] / ratio, *np.sqrt(values[1:] * values[:-1]), values[-1] * ratio]))
