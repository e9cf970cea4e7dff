"""Contacts as text: what headlines, tables and formats list, the alarms of single joints being their detail."""

from __future__ import annotations

import math
from bisect import bisect_left, bisect_right
from collections.abc import Sequence
from dataclasses import dataclass

from collaudit.core.data.audit_result import AuditResult, Collision
from collaudit.core.data.detection_result import Contact, ContactForce, LeastForce
from collaudit.reports.values import rows
from collaudit.reports.values.numbers import against, duration, fixed, time_decimals
from collaudit.reports.values.words import torque_unit


@dataclass(frozen=True, slots=True)
class ContactRow:
    """One contact; ``worst`` is the alarm that is highest for its threshold."""

    onset: str
    lasted: str
    joints: str
    worst: str
    link: str
    note: str
    force: str
    kind: str
    evidence: str


def contacts_of(result: AuditResult) -> tuple[Contact, ...]:
    """The contacts of an audit; in files of versions that did not join alarms each alarm is one."""
    if result.contacts:
        return result.contacts
    if result.detection is not None and result.detection.incidents:
        return result.detection.incidents
    return tuple(
        Contact(c.onset_s, c.detected_s, c.onset_s + c.duration_s, (c.joint,), "", "", None, "undecided", ())
        for c in rows.in_time(result.collisions)
    )


def contact_rows(result: AuditResult) -> list[ContactRow]:
    """Every contact as text, in order of time."""
    alarms = rows.in_time(result.collisions)
    return [contact_row(contact, result, alarms) for contact in contacts_of(result)]


#: Kinds as readers are told them.
KIND_WORDS = {"meant": "intended", "accidental": "accidental", "undecided": "undecided"}


def contact_row(contact: Contact, result: AuditResult, in_time: Sequence[Collision] | None = None) -> ContactRow:
    """A contact as text; ``in_time`` as for :func:`alarms_of`."""
    onset = fixed(contact.onset_s, time_decimals(result.log.sample_period_s))
    return ContactRow(
        onset=f"{onset} s",
        lasted=duration(contact.end_s - contact.onset_s),
        joints=", ".join(contact.joints),
        worst=_worst(contact, result, in_time),
        link=contact.link or rows.NONE,
        note=contact.link_note,
        force=force_text(contact.force, contact.least_force),
        kind=KIND_WORDS[contact.kind],
        evidence="; ".join(contact.evidence),
    )


def force_text(force: ContactForce | None, least: LeastForce | None = None) -> str:
    """The interval of a contact's force and its blind directions; what it is at least where there is no interval."""
    at_least = "" if least is None or least.force_n < 1.0 else f"at least {math.floor(least.force_n)} N"
    if force is None:
        return at_least or "unknown"
    low, high = force.size_ci95_n
    if force.blind and low < 0.5:
        visible = f"up to {high:.0f} N in visible directions"
        return f"{at_least} ({visible})" if at_least else f"not determinable ({visible})"
    blind = f", {len(force.blind)} blind direction{'s' if len(force.blind) > 1 else ''}" if force.blind else ""
    return f"{low:.0f} to {high:.0f} N{blind}"


def _worst(contact: Contact, result: AuditResult, in_time: Sequence[Collision] | None) -> str:
    alarms = alarms_of(contact, result, in_time)
    if not alarms:
        return rows.NONE
    alarm = max(alarms, key=lambda a: abs(a.peak_nm) / a.gamma_nm)
    peak, gamma = against(alarm.peak_nm, alarm.gamma_nm)
    return f"{peak} {torque_unit(result, alarm.joint)} (γ {gamma}), {alarm.joint}"


def alarms_of(contact: Contact, result: AuditResult, in_time: Sequence[Collision] | None = None) -> list[Collision]:
    """The alarms of single joints that make up a contact, in order of time.

    Args:
        contact: the contact.
        result: the audit.
        in_time: its alarms in order of time, for those who ask of many contacts.
    """
    alarms = rows.in_time(result.collisions) if in_time is None else in_time
    first = bisect_left(alarms, contact.onset_s, key=lambda alarm: alarm.onset_s)
    after = bisect_right(alarms, contact.end_s, key=lambda alarm: alarm.onset_s)
    return [alarm for alarm in alarms[first:after] if alarm.joint in contact.joints]
