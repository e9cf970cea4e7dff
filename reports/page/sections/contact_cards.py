"""Cards of the contacts furthest above their thresholds: their row of the table, with plots."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from markupsafe import Markup

from collaudit.core.data.audit_result import AuditResult
from collaudit.core.data.detection_result import Contact
from collaudit.core.numeric.arrays import FloatArray
from collaudit.reports.page.sections.joint_figures import JointFigures
from collaudit.reports.plots.arm_pose import draw_pose, drawn_arm
from collaudit.reports.plots.plot_contact import draw_contact
from collaudit.reports.sections.event_sections import contact_section
from collaudit.reports.values.contact_alarms import alarms_of, height
from collaudit.reports.values.visible_text import visible
from collaudit.reports.values.words import torque_unit

_SHOWN = ("wall clock", "alarms", "lasted", "link or further out", "force (95 %)", "tool speed", "controller")


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
            pose=_pose(contact, result, f"{key}-contact-{number}-pose"),
            plot=_plot(number, contact, result, figures, force, f"{key}-contact-{number}-plot"),
            window=window,
        )
        for (number, contact), record, window in zip(drawn.items(), found.records, found.windows, strict=True)
    )


def _plot(
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
    rule = result.rule
    lower = [
        rule.lasting_nm[a.joint] / rule.gamma_nm[a.joint] for a in alarms if a.lasting and a.joint in rule.lasting_nm
    ]
    least = min(lower, default=1.0)
    return draw_contact(windows, contact, worst, torque_unit(result, worst), force, name, label, least)


def _pose(contact: Contact, result: AuditResult, name: str) -> Markup | None:
    if contact.scene is None:
        return None
    arm = drawn_arm(contact.scene, result.arm)
    if arm.axes is not None and result.arm is not None:
        order = [link.joint for link in result.arm.links]
    else:  # where all joints of the model are judged, the points are theirs
        order = list(contact.scene.joint_speed_rad_s)
        order = order if len(arm.points) - 1 == len(order) else []
    reacted = [k for k, joint in enumerate(order) if joint in contact.joints]
    return draw_pose(arm, reacted, name, "Pose of the arm at the peak")
