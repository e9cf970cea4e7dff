"""Pages of one matter each: alarms over threshold and persistence, nights, a plan, forces beside limits, an overlay.

The overlay lays one signal of two recordings, or of two cycles of one, over each other at the place of each contact."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import date
from math import ceil, floor, log10, sqrt

import numpy as np
from markupsafe import Markup

from collaudit.core.data.audit_result import Audit, AuditResult
from collaudit.core.data.signals import Signals
from collaudit.core.history.night_row import JointNights
from collaudit.core.numeric.arrays import FloatArray, nearest_stretch
from collaudit.core.plan.planning import Plan
from collaudit.core.recommend.arm_recommendation import ArmRecommendation
from collaudit.core.recommend.joint_thresholds import AlarmPlane
from collaudit.reports.page.environment import environment
from collaudit.reports.plots.arm_pose import moving_arm, positions_over_time
from collaudit.reports.plots.joint_trace import thin
from collaudit.reports.plots.svg import Panel, drawing
from collaudit.reports.sections.body_region_sections import CANNOT_BE_CONCLUDED, BodyLimits, body_region_section
from collaudit.reports.sections.joint_sections import first_and_last, nights_section, plane_section
from collaudit.reports.sections.plan_sections import plan_sections
from collaudit.reports.values.first_words import strongest
from collaudit.reports.values.visible_text import visible
from collaudit.reports.values.words import verdict_word

#: Shades from no alarm to many, and the counts at which they change.
_SHADES = ("#f4f7fa", "#d3e0ec", "#a9c3da", "#7aa3c5", "#4b81ad", "#255f90", "#0b3f6e")
_FROM = (1, 2, 4, 10, 30, 100)
_PLANE_LEFT, _PLANE_TOP, _PLANE_WIDE, _PLANE_HIGH = 46.0, 20.0, 300.0, 216.0


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
    panel = Panel((_PLANE_LEFT, _PLANE_TOP, _PLANE_WIDE, _PLANE_HIGH), (x[0], x[-1]), (y[0], y[-1]))
    rows = np.linspace(y[0], y[-1], len(plane.gamma_nm) + 1)
    ranks = np.searchsorted(_FROM, np.array(plane.alarms), side="right")
    for rank, shade in enumerate(_SHADES):
        panel.cells(ranks == rank, x, rows, shade)
    for gamma, kind in ((plane.set_nm, "gamma"), (plane.recommended_nm, "rule")):
        if gamma is not None and y[0] <= log10(gamma) <= y[-1]:
            panel.level(log10(gamma), kind)
    panel.y_axis(f"γ, {unit}", decades=True)
    panel.x_axis("persistence, ms", decades=True)
    wide, high = round(_PLANE_LEFT + _PLANE_WIDE + 10), round(_PLANE_TOP + _PLANE_HIGH + 34)
    return drawing(wide, high, visible(label), [panel], "", "plot plane", False)


def _borders(values: FloatArray) -> FloatArray:
    """(k + 1,) logarithms of the borders of cells around k rising values in about equal ratios."""
    ratio = sqrt(float(values[1] / values[0]))
    return np.asarray(np.log10([values[0] / ratio, *np.sqrt(values[1:] * values[:-1]), values[-1] * ratio]))


_TREND_WIDE, _TREND_HIGH = 260, 84


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
    panel = Panel((44, 14, _TREND_WIDE - 52, _TREND_HIGH - 22), (days[0], days[-1]), (0.0, 1.1 * top))
    panel.y_axis("N·m", 3)
    panel.line(days, level, "curve")
    panel.line(days, friction, "model")
    panel.line(days, gamma, "gamma")
    panel.moments(days[[night.contacts > 0 for night in one.nights]].tolist(), "onset")
    words = f"level {first_and_last([night.level_nm for night in one.nights])} N·m"
    label = visible(f"{one.joint}: {words}, {one.nights[0].night} to {one.nights[-1].night}")
    return one.joint, words, drawing(_TREND_WIDE, _TREND_HIGH, label, [panel], key)


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


#: Signals that can be laid over each other: field of the signals and unit.
SIGNALS = {
    "residual": ("residual_nm", "N·m"),
    "measured": ("measured_nm", "N·m"),
    "model": ("model_nm", "N·m"),
    "position": ("position_rad", "rad"),
    "velocity": ("velocity_rad_s", "rad/s"),
}
#: Around a contact, s; step of the comparison, s; joints further apart on average are at another place, rad.
_AROUND_S, _STEP_S, _NEAR_RAD = 1.5, 0.02, 0.1
_MOST_CONTACTS, _POINTS = 8, 600
_OVERLAY_WIDE, _OVERLAY_HIGH = 640, 200


@dataclass(frozen=True, slots=True)
class Overlay:
    """One plot.

    Attributes:
        title: what is shown.
        text: where the other recording was at the same place, and how near.
        plot: the drawing.
    """

    title: str
    text: str
    plot: Markup


def overlay_page(first: Audit, other: Audit, signal: str) -> str:
    """The page as text: the contacts of the first recording, each over the same place in the other.

    Args:
        first: the recording with contacts; of one without any, the whole of every joint, from both starts.
        other: the one that is laid over it, which may be the same: then another cycle of it.
        signal: out of ``SIGNALS``.
    """
    contacts = strongest(first.result, _MOST_CONTACTS)
    drawn = [_of_contact(first, other, signal, number) for number in sorted(contacts)]
    if not drawn:
        end = float(first.signals.time_s[-1])
        drawn = [
            _drawn(first, other, signal, joint, (0.0, end), 0.0, joint, "from both starts")
            for joint in first.signals.joint_names
        ]
    logs = [audit.result.log for audit in (first, other)]
    names = [visible(f"{log.name}, {(log.start or 'date not known')[:16].replace('T', ' ')}") for log in logs]
    return environment().get_template("overlay.html.j2").render(overlays=drawn, names=names, signal=signal)


def _of_contact(first: Audit, other: Audit, signal: str, number: int) -> Overlay:
    contact = first.result.contacts[number - 1]
    joint = max(contact.peak_nm, key=contact.peak_nm.__getitem__, default=contact.joints[0])
    span = contact.onset_s - _AROUND_S, contact.end_s + _AROUND_S
    title = f"Contact {number} at {contact.onset_s:.2f} s, {joint}"
    found = _same_place(first, other, span)
    if found is None or found[1] > _NEAR_RAD:
        apart = "" if found is None else f"; the nearest is {found[1]:.2f} rad away"
        return _drawn(first, other, signal, joint, span, None, title, f"the other does not come to this place{apart}")
    later = found[0] - span[0]
    text = f"the other from {found[0]:.2f} s on, its joints {found[1]:.3f} rad away"
    return _drawn(first, other, signal, joint, span, later, title, text)


def _same_place(first: Audit, other: Audit, span: tuple[float, float]) -> tuple[float, float] | None:
    """When the other moves as the first does in a span, s, and how far apart they are, rad."""
    own = _steps(max(span[0], float(first.signals.time_s[0])), span[1])
    whole = _steps(float(other.signals.time_s[0]), float(other.signals.time_s[-1]))
    short, long = _positions(first.signals, own), _positions(other.signals, whole)
    allowed = None
    if first.result.log.sha256 == other.result.log.sha256:
        starts = whole[: max(whole.size - own.size + 1, 0)]
        allowed = np.abs(starts - own[0]) > span[1] - span[0]
    found = None if not np.isfinite(short).all() else nearest_stretch(short, long, allowed)
    return None if found is None else (float(whole[found[0]] - own[0] + span[0]), found[1])


def _steps(start: float, end: float) -> FloatArray:
    """Times at whole steps: of two recordings of one motion from one start, the same ones."""
    return _STEP_S * np.arange(ceil(start / _STEP_S), floor(end / _STEP_S), dtype=np.float64)


def _positions(signals: Signals, at: FloatArray) -> FloatArray:
    """(n, j) positions at these times."""
    columns = signals.position_rad.T
    return np.stack([np.interp(at, signals.time_s, column) for column in columns], axis=1)


def _drawn(
    first: Audit,
    other: Audit,
    signal: str,
    joint: str,
    span: tuple[float, float],
    later: float | None,
    title: str,
    text: str,
) -> Overlay:
    """The first recording's signal, and over it the other's ``later`` seconds later; None: without it."""
    field, unit = SIGNALS[signal]
    curves = [_curve(first.signals, field, joint, span, 0.0)]
    if later is not None and joint in other.signals.joint_names:
        curves.append(_curve(other.signals, field, joint, span, later))
    values = np.concatenate([y[np.isfinite(y)] for _, y in curves])
    low, high = (float(values.min()), float(values.max())) if values.size else (0.0, 1.0)
    room = 0.05 * (high - low)
    panel = Panel((52, 20, _OVERLAY_WIDE - 62, _OVERLAY_HIGH - 56), span, (low - room, high + room))
    panel.y_axis(unit)
    panel.x_axis("time, s")
    for (x, y), kind in zip(curves, ("curve", "model"), strict=False):
        panel.line(x, y, kind)
    label = visible(f"{signal} of {joint}: {title}; {text}")
    key = f"o{round(1e3 * span[0])}-{first.signals.joint_names.index(joint)}"
    plot = drawing(_OVERLAY_WIDE, _OVERLAY_HIGH, label, [panel], key)
    return Overlay(visible(title), text, plot)


def _curve(
    signals: Signals, field: str, joint: str, span: tuple[float, float], later: float
) -> tuple[FloatArray, FloatArray]:
    """Times on the first recording's clock, and values."""
    inside = (signals.time_s >= span[0] + later) & (signals.time_s <= span[1] + later)
    values = getattr(signals, field)[inside, signals.joint_names.index(joint)]
    return thin(signals.time_s[inside] - later, values.astype(np.float64), _POINTS)
