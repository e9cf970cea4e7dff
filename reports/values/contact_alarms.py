"""Contacts, which headlines, tables and formats list, and the alarms of single joints, which are their detail."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TypeVar

from collaudit.core.data.audit_result import AuditResult, Collision, NearMiss
from collaudit.core.data.detection_result import Contact, ContactForce, LeastForce

_LEAST_MARGIN_S = 0.25
_LEAST_MARGIN_SAMPLES = 25

E = TypeVar("E", Collision, NearMiss)


def in_time(events: Sequence[E]) -> list[E]:
    """Events in order of their onset."""
    return sorted(events, key=lambda event: (event.onset_s, event.joint))


def alarms_of(contact: Contact, result: AuditResult, alarms: Sequence[Collision] | None = None) -> list[Collision]:
    """The alarms of single joints that make up a contact, in order of time.

    Args:
        contact: the contact.
        result: the audit.
        alarms: its alarms in order of time, for those who ask of many contacts.
    """
    found = in_time(result.collisions) if alarms is None else alarms
    return [one for one in found if one.joint in contact.joints and contact.onset_s <= one.onset_s <= contact.end_s]


def height(alarm: Collision) -> float:
    """Peak over threshold."""
    return abs(alarm.peak_nm) / alarm.gamma_nm


def strongest(result: AuditResult, limit: int) -> dict[int, Contact]:
    """The contacts with the highest residual for its threshold, by their number from 1, in order of time.

    Args:
        result: the audit.
        limit: how many at most; of equals the earlier.
    """
    contacts, alarms = result.contacts, in_time(result.collisions)
    heights = [max(map(height, alarms_of(contact, result, alarms)), default=0.0) for contact in contacts]
    kept = sorted(range(len(contacts)), key=lambda k: (-heights[k], k))[:limit]
    return {k + 1: contacts[k] for k in sorted(kept)}


def contact_limits(contact: Contact, period_s: float) -> tuple[float, float]:
    """Times between which a contact is drawn: 0.25 s, 25 samples or its own length on either side."""
    margin = max(_LEAST_MARGIN_S, _LEAST_MARGIN_SAMPLES * period_s, contact.end_s - contact.onset_s)
    return contact.onset_s - margin, contact.end_s + margin


def force_text(force: ContactForce | None, least: LeastForce | None = None) -> str:
    """The interval of a contact's force; what it is at least where a direction is blind or there is no interval."""
    low, high = (0.0, None) if force is None else force.size_ci95_n
    if high is not None:
        return f"{low:.0f} to {high:.0f} N"
    at_least = max(low, 0.0 if least is None else least.force_n)
    return "unknown" if force is None and at_least < 1.0 else _at_least(at_least)


def link_forces_text(force: ContactForce | None) -> str:
    """The force on each link on which the contact can be: ``if on link3: 45 to 80 N``; empty where that is not told."""
    links = () if force is None else force.links
    said = (
        f"if on {link.frame}: "
        + (f"{link.low_n:.0f} to {link.high_n:.0f} N" if link.high_n is not None else _at_least(link.low_n))
        for link in links
    )
    return "; ".join(said)


def _at_least(low_n: float) -> str:
    return f"at least {math.floor(low_n)} N" if low_n >= 1.0 else "not determinable"
