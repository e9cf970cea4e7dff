"""What is drawn of joints, in one pass over their signals, and cards of the contacts furthest above thresholds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from markupsafe import Markup

from collaudit.core.data.audit_result import AuditResult
from collaudit.core.data.detection_result import Contact
from collaudit.core.numeric.arrays import FloatArray, IntArray
from collaudit.core.numeric.parallel import Progress
from collaudit.reports.files.signals_file import StoredSignals
from collaudit.reports.plots.arm_pose import draw_pose, drawn_arm
from collaudit.reports.plots.joint_trace import JointTrace
from collaudit.reports.plots.plot_contact import contact_window, draw_contact
from collaudit.reports.plots.plot_residual import (
    coverage_bar,
    draw_against,
    draw_autocorrelation,
    draw_cycles,
    draw_histogram,
    draw_overview,
    draw_trend,
)
from collaudit.reports.plots.signal_data import kept_samples, packed, pose_samples
from collaudit.reports.sections.event_sections import contact_section
from collaudit.reports.values.first_words import alarms_of, contact_limits, height
from collaudit.reports.values.numbers import significant, stated
from collaudit.reports.values.visible_text import visible
from collaudit.reports.values.words import speed_unit, torque_unit


@dataclass(frozen=True, slots=True)
class Detail:
    """How much of an audit is drawn.

    Attributes:
        cards: of contacts.
        points, around_events: samples a joint in the page's own plots, and around events.
    """

    cards: int
    points: int
    around_events: int


@dataclass(frozen=True, slots=True, eq=False)
class JointFigures:
    """The drawings of one joint.

    Attributes:
        anchor: its id in the page.
        bar: its states over the log.
        cycles: its residual over the path of the program; None where nothing repeats.
        overview, caption: its residual over the log, and words; None where no residual could be computed.
        small: histogram, autocorrelation and trend of its residual, in this order.
        data: its curves for the page's own plots, None where there are none.
        windows: what it shows around the contacts that are drawn, by their number.
        pose: samples at which the arm is drawn, and its position there (n,); None without kinematics.
    """

    joint: str
    anchor: str
    bar: Markup
    overview: Markup | None
    caption: str
    small: tuple[Markup | None, ...]
    against: Markup | None
    cycles: Markup | None
    data: Mapping[str, object] | None
    windows: Mapping[int, JointTrace]
    pose: tuple[IntArray, FloatArray] | None


def joint_figures(
    source: StoredSignals,
    result: AuditResult,
    contacts: Mapping[int, Contact],
    key: str,
    detail: Detail,
    progress: Progress,
) -> tuple[JointFigures, ...]:
    """Draw the joints one after the other, so that only one joint's signals are held.

    Args:
        source: of the signals.
        result: of the same audit.
        contacts: those that are drawn, by their number.
        key: prefix of ids.
        detail: how much is drawn.
        progress: called with joints done and in all.
    """
    stretches = _stretches(result, contacts, result.log.sample_period_s)
    made = []
    for k in range(len(source.joint_names)):
        made.append(_of_joint(source.trace(k), result, contacts, f"{key}-joint-{k + 1}", detail, stretches))
        progress(k + 1, len(source.joint_names))
    return tuple(made)


def _of_joint(
    trace: JointTrace,
    result: AuditResult,
    contacts: Mapping[int, Contact],
    name: str,
    detail: Detail,
    stretches: Sequence[tuple[float, float]],
) -> JointFigures:
    joint, unit = trace.joint, torque_unit(result, trace.joint)
    windows = {number: contact_window(trace, contact) for number, contact in contacts.items()}
    known = bool(np.isfinite(trace.residual_nm).any())
    data = None
    if known:
        kept = kept_samples(trace, detail.points, stretches, detail.around_events)
        data = {
            "joint": visible(joint),
            "unit": unit,
            "count": len(trace.time_s),
            **packed(trace, kept),
            "start": float(trace.time_s[0]),
            "period": trace.period_s,
        }
    said = visible(f"of {joint}")
    overview, caption = _overview(trace, result, name, unit) if known else (None, "")
    return JointFigures(
        joint=joint,
        anchor=name,
        bar=coverage_bar(trace, visible(f"{joint}: judged, friction known only as a range, not judged")),
        overview=overview,
        caption=caption,
        small=(
            draw_histogram(trace, f"{name}-h", f"Histogram of the judged residual {said}, with ±γ"),
            draw_autocorrelation(trace, f"{name}-a", f"Autocorrelation of the residual {said} up to 0.5 s"),
            draw_trend(trace, f"{name}-t", f"RMS of the residual {said} over the log"),
        ),
        against=draw_against(
            trace,
            unit,
            speed_unit(result.friction.get(joint)),
            f"{name}-v",
            visible(f"Residual of {joint} against its speed and its position, {unit}"),
        ),
        cycles=draw_cycles(
            trace,
            [alarm for alarm in result.collisions if alarm.joint == joint],
            unit,
            f"{name}-c",
            visible(f"Residual of {joint} over the path of the program, {unit}"),
        ),
        data=data,
        windows={number: window for number, window in windows.items() if window is not None},
        pose=None if result.arm is None else _pose(trace, result, detail),
    )


def _pose(trace: JointTrace, result: AuditResult, detail: Detail) -> tuple[IntArray, FloatArray]:
    around = [contact_limits(contact, trace.period_s) for contact in result.contacts]
    kept = pose_samples(len(trace.time_s), trace.period_s, detail.points // 3, around)
    return kept, trace.position_rad[kept].astype(np.float64)


def _overview(trace: JointTrace, result: AuditResult, name: str, unit: str) -> tuple[Markup, str]:
    """The drawing and what is said of it: the threshold, the axis, and what lies outside of it."""
    joint = trace.joint
    alarms = [event for event in result.collisions if event.joint == joint]
    near = [event for event in result.near_misses if event.joint == joint]
    gamma = result.rule.gamma_nm.get(joint)
    level = "no threshold" if gamma is None else f"γ = {stated(gamma)} {unit}"
    label = visible(f"Residual of {joint} over the whole log, {level}")
    svg, height, note = draw_overview(trace, alarms, near, f"{name}-o", label)
    return svg, f"{level}, axis ±{significant(height)} {unit}{f'; {note} {unit}' if note else ''}"


def _stretches(result: AuditResult, contacts: Mapping[int, Contact], period_s: float) -> list[tuple[float, float]]:
    """Which keep more samples: the contacts with cards, the others, then near misses, closest to an alarm first."""
    others = [contact for k, contact in enumerate(result.contacts, 1) if k not in contacts]
    around = [contact_limits(contact, period_s) for contact in (*contacts.values(), *others)]
    near = sorted(result.near_misses, key=lambda event: -event.ratio)
    return around + [(event.onset_s - 0.2, event.onset_s + event.duration_s + 0.2) for event in near]


_SHOWN = (
    "wall clock",
    "alarms",
    "link or further out",
    "force (95 %)",
    "by link",
    "after it",
    "tool speed",
    "controller",
    "to accept",
)


@dataclass(frozen=True, slots=True)
class ContactCard:
    """One contact.

    Attributes:
        title: when it was, and of which kind.
        facts: term and value.
        evidence: why it is of its kind, and where it may be.
        window: seconds that its plots show.
    """

    number: int
    title: str
    facts: tuple[tuple[str, str], ...]
    evidence: str
    pose: Markup | None
    plot: Markup | None
    window: tuple[float, float]


def contact_cards(
    result: AuditResult,
    drawn: Mapping[int, Contact],
    figures: Sequence[JointFigures],
    force: tuple[FloatArray, FloatArray] | None,
    key: str,
) -> tuple[ContactCard, ...]:
    """The cards of one audit.

    Args:
        result: the audit.
        drawn: the contacts, by their number from 1.
        figures: of the joints.
        force: time and size (n,) of the force at the wrist sensor; None without one.
        key: prefix of anchors.
    """
    found = contact_section(result, drawn)
    return tuple(
        ContactCard(
            number=number,
            title=f"at {record['onset']} · {record['kind']}",
            facts=tuple((term, record[term]) for term in _SHOWN if record[term]),
            evidence=record["evidence"],
            pose=_drawn_pose(contact, result, f"{key}-contact-{number}-pose"),
            plot=_drawn_contact(number, contact, result, figures, force, f"{key}-contact-{number}-plot"),
            window=window,
        )
        for (number, contact), record, window in zip(drawn.items(), found.records, found.windows, strict=True)
    )


def _drawn_contact(
    number: int,
    contact: Contact,
    result: AuditResult,
    figures: Sequence[JointFigures],
    force: tuple[FloatArray, FloatArray] | None,
    name: str,
) -> Markup | None:
    windows = [figure.windows[number] for figure in figures if number in figure.windows]
    if not windows:
        return None
    alarms = alarms_of(contact, result)
    highest = max(alarms, key=height, default=None)
    worst = "" if highest is None else highest.joint
    label = visible(f"Contact {number}: residual of all joints over γ, measured and modelled torque of {worst}")
    return draw_contact(windows, contact, worst, torque_unit(result, worst), force, name, label)


def _drawn_pose(contact: Contact, result: AuditResult, name: str) -> Markup | None:
    if contact.scene is None:
        return None
    arm = drawn_arm(contact.scene, result.arm)
    if arm.axes is not None and result.arm is not None:
        order = [link.joint for link in result.arm.links]
    else:  # where all joints of the model are judged, the points are theirs
        order = list(contact.scene.joint_speed_rad_s)
        order = order if len(arm.points) - 1 == len(order) else []
    possible = possible_joints(contact, order)
    reacted = [k for k, joint in enumerate(order) if joint in contact.joints]
    shaded = [k for k, joint in enumerate(order) if joint in possible]
    label = visible(f"Pose of the arm at the peak; shaded: where the contact can be, links of {', '.join(possible)}")
    return draw_pose(arm, reacted, shaded, name, label)


def possible_joints(contact: Contact, order: Sequence[str | None]) -> list[str]:
    """Joints whose links the contact can be on; where no force tells, those from the outermost that reacted on."""
    if contact.force is not None and contact.force.links:
        return [link.joint for link in contact.force.links]
    joints = [joint for joint in order if joint is not None]
    reacted = [k for k, joint in enumerate(joints) if joint in contact.joints]
    return joints[max(reacted) :] if reacted else []
