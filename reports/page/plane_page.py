"""Pages of one matter each: alarms over threshold and persistence, a fleet's nights, a plan, forces beside limits."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from datetime import date
from math import log10, sqrt

import numpy as np
from markupsafe import Markup

from collaudit.core.data.audit_result import AuditResult
from collaudit.core.history.night_row import JointNights
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.plan.planning import Plan
from collaudit.core.recommend.arm_recommendation import ArmRecommendation
from collaudit.core.recommend.joint_thresholds import AlarmPlane
from collaudit.reports.page.environment import environment
from collaudit.reports.plots.arm_pose import moving_arm, positions_over_time
from collaudit.reports.plots.svg import Panel, drawing
from collaudit.reports.sections.body_region_sections import CANNOT_BE_CONCLUDED, BodyLimits, body_region_section
from collaudit.reports.sections.joint_sections import first_and_last, nights_section, plane_section
from collaudit.reports.sections.plan_sections import plan_sections
from collaudit.reports.values.visible_text import visible
from collaudit.reports.values.words import verdict_word

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


_FRAMES = 240


def plan_page(plan: Plan) -> str:
    """The page as text, without scripts; the same plan gives the same bytes."""
    file, bodies = plan.file, plan.robot.bodies
    assert bodies is not None
    t, q, _, _ = plan.motion.sampled(plan.motion.duration_s / _FRAMES)
    frames = [*bodies.joint_names, bodies.frame_names[-1]]
    points = np.array([np.vstack([np.zeros(3), plan.robot.frame_positions(pose, frames)]) for pose in q])
    return (
        environment()
        .get_template("plan.html.j2")
        .render(
            plan=file,
            sections=plan_sections(file),
            arm=moving_arm(points, plan.motion.duration_s),
            joints=[(name, positions_over_time(t, q[:, j], file.limits[name], f"joint-{j}"))
                    for j, name in enumerate(plan.robot.joint_names)],
        )
    )  # fmt: skip


def body_regions_html(results: Sequence[AuditResult], limits: BodyLimits) -> str:
    """The page of estimated forces beside limits by body region, with what cannot be concluded."""
    return (
        environment()
        .get_template("body_regions.html.j2")
        .render(
            logs=[(r.verdict, verdict_word(r.verdict, r.exclusions), r.log.name) for r in results],
            notes=(f"Limits by body region, as stated by: {limits.source}", CANNOT_BE_CONCLUDED),
            sections=[body_region_section(result, limits) for result in results],
        )
    )
