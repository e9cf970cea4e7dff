"""Contacts: cards of those furthest above their thresholds, and a row for each with what a card says but the plots."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from markupsafe import Markup

from collaudit.core.data.audit_result import AuditResult, Collision
from collaudit.core.data.detection_result import Contact
from collaudit.core.numeric.arrays import FloatArray
from collaudit.reports.page.sections.joint_figures import JointFigures
from collaudit.reports.page.selection import furthest
from collaudit.reports.plots.arm_pose import draw_pose
from collaudit.reports.plots.plot_contact import contact_limits, draw_contact
from collaudit.reports.values.contact_rows import ContactRow, alarms_of, contact_row, contacts_of
from collaudit.reports.values.controller_words import controller_text
from collaudit.reports.values.numbers import against, apart, duration, speed
from collaudit.reports.values.rows import NONE, in_time
from collaudit.reports.values.times import clock_text
from collaudit.reports.values.visible_text import visible
from collaudit.reports.values.words import speed_unit, torque_unit

_LINES = 500


@dataclass(frozen=True, slots=True)
class AlarmRow:
    """One joint's alarm in a contact: peak and its margin to γ, duration and what n needs, the joint's speed."""

    joint: str
    onset: str
    peak: str
    gamma: str
    margin: str
    lasted: str
    speed: str


@dataclass(frozen=True, slots=True)
class ContactCard:
    """One contact; ``window`` are the seconds that its plots show."""

    anchor: str
    number: int
    row: ContactRow
    clock: str
    alarms: tuple[AlarmRow, ...]
    tool_speed: str
    controller: str
    pose: Markup | None
    plot: Markup | None
    window: tuple[float, float]


@dataclass(frozen=True, slots=True)
class ContactLine:
    """One contact in the table of all: ``card`` says that it has a card, whose anchor this is then."""

    anchor: str
    number: int
    row: ContactRow
    clock: str
    alarms: tuple[AlarmRow, ...]
    tool_speed: str
    controller: str
    window: tuple[float, float]
    card: bool


@dataclass(frozen=True, slots=True)
class ContactCards:
    """The cards, and a line for each of the first contacts, both in order of time.

    Attributes:
        count: of all contacts.
        carded: numbers of those with cards, as text.
    """

    cards: tuple[ContactCard, ...]
    lines: tuple[ContactLine, ...]
    count: int
    carded: str

    @property
    def controller_varies(self) -> bool:
        """Whether the controller or the labels said different things of them."""
        return len({line.controller for line in self.lines}) > 1


def drawn_contacts(result: AuditResult, limit: int) -> dict[int, Contact]:
    """The contacts that get a card, by their number from 1: those furthest above their thresholds."""
    contacts, alarms = contacts_of(result), in_time(result.collisions)
    heights = [max((abs(a.peak_nm) / a.gamma_nm for a in alarms_of(c, result, alarms)), default=0.0) for c in contacts]
    return {k + 1: contacts[k] for k in furthest(heights, limit)}


def contact_cards(
    result: AuditResult,
    drawn: Mapping[int, Contact],
    figures: Sequence[JointFigures],
    force: tuple[FloatArray, FloatArray] | None,
    key: str,
) -> ContactCards:
    """The cards of one audit.

    Args:
        result: the audit.
        drawn: of :func:`drawn_contacts`.
        figures: of the joints.
        force: time and size (n,) of the force at the wrist sensor; None without one.
        key: prefix of anchors.
    """
    cards = tuple(_card(result, number, contact, figures, force, key) for number, contact in drawn.items())
    in_order, contacts = in_time(result.collisions), contacts_of(result)
    lines = tuple(
        _line(result, k, contact, in_order, key, k in drawn) for k, contact in enumerate(contacts[:_LINES], 1)
    )
    numbers = [str(card.number) for card in cards]
    return ContactCards(cards, lines, len(contacts), " and ".join(numbers))


def _line(
    result: AuditResult, number: int, contact: Contact, in_order: Sequence[Collision], key: str, card: bool
) -> ContactLine:
    return ContactLine(
        anchor=f"{key}-contact-{number}",
        number=number,
        row=contact_row(contact, result, in_order),
        clock=clock_text(result.log.start, contact.onset_s),
        alarms=tuple(_alarm(alarm, contact, result) for alarm in alarms_of(contact, result, in_order)),
        tool_speed=_tool_speed(contact),
        controller=controller_text(contact, result),
        window=contact_limits(contact, result.log.sample_period_s),
        card=card,
    )


def _tool_speed(contact: Contact) -> str:
    tool_speed = None if contact.scene is None else contact.scene.tool_speed_m_s
    return NONE if tool_speed is None else speed(tool_speed, "m/s")


def _card(
    result: AuditResult,
    number: int,
    contact: Contact,
    figures: Sequence[JointFigures],
    force: tuple[FloatArray, FloatArray] | None,
    key: str,
) -> ContactCard:
    anchor = f"{key}-contact-{number}"
    alarms = alarms_of(contact, result)
    worst = max(alarms, key=lambda a: abs(a.peak_nm) / a.gamma_nm).joint if alarms else ""
    windows = [figure.windows[number] for figure in figures if number in figure.windows]
    label = visible(f"Contact {number}: residual of all joints over γ, measured and modelled torque of {worst}")
    plot = None
    if windows:
        plot = draw_contact(windows, contact, worst, torque_unit(result, worst), force, f"{anchor}-plot", label)
    return ContactCard(
        anchor=anchor,
        number=number,
        row=contact_row(contact, result),
        clock=clock_text(result.log.start, contact.onset_s),
        alarms=tuple(_alarm(alarm, contact, result) for alarm in alarms),
        tool_speed=_tool_speed(contact),
        controller=controller_text(contact, result),
        pose=_pose(contact, result, f"{anchor}-pose"),
        plot=plot,
        window=contact_limits(contact, result.log.sample_period_s),
    )


def _alarm(alarm: Collision, contact: Contact, result: AuditResult) -> AlarmRow:
    unit = torque_unit(result, alarm.joint)
    peak, gamma = against(alarm.peak_nm, alarm.gamma_nm)
    joint_speed = None if contact.scene is None else contact.scene.joint_speed_rad_s.get(alarm.joint)
    fit = result.friction.get(alarm.joint)
    return AlarmRow(
        joint=alarm.joint,
        onset=f"{alarm.onset_s:.3f} s",
        peak=f"{peak} {unit}",
        gamma=f"{gamma} {unit}",
        margin=f"× {apart([abs(alarm.peak_nm) / alarm.gamma_nm, 1.0])[0]}",
        lasted=duration(alarm.duration_s),
        speed=NONE if joint_speed is None else speed(joint_speed, speed_unit(fit) if fit is not None else "rad/s"),
    )


def _pose(contact: Contact, result: AuditResult, name: str) -> Markup | None:
    if contact.scene is None or not np.isfinite(np.array(contact.scene.points_m)).all():
        return None
    order = list(contact.scene.joint_speed_rad_s)
    every = len(contact.scene.points_m) - 1 == len(order)  # all joints of the model are judged: points are theirs
    reacted = [k for k, joint in enumerate(order) if joint in contact.joints] if every else []
    label = visible(f"Pose of the arm at the peak, from the side and from above; alarmed: {', '.join(contact.joints)}")
    return draw_pose(contact.scene, reacted, name, label)
