"""The numbers that go with a verdict."""

from __future__ import annotations

from dataclasses import dataclass

from collaudit.core.data.audit_result import AuditResult
from collaudit.core.verdict.noticed_words import force_text, headline_forces
from collaudit.reports.values.noticed import lost_share
from collaudit.reports.values.numbers import duration, percent, significant, stated
from collaudit.reports.values.words import NONE, counted


@dataclass(frozen=True, slots=True)
class Fact:
    """A value, what it is held against (empty: nothing), and whether it is within that: ``ok``, ``off``, or empty."""

    term: str
    value: str
    reference: str = ""
    flag: str = ""


def verdict_facts(result: AuditResult) -> tuple[Fact, ...]:
    """Values in the order of the box."""
    lost = lost_share(result)
    return (
        _contacts(result),
        Fact("Near misses", counted(len(result.near_misses), result), _near_misses_allowed(result)),
        *_noticed(result),
        Fact("Not judged", NONE if lost is None else percent(lost)),
        Fact("Joints watched", _watched(result)),
        Fact("Recorded", duration(result.coverage.recorded_s)),
    )


def _contacts(result: AuditResult) -> Fact:
    count, limits = len(result.contacts), result.limits
    text = counted(count, result)
    if limits is None:
        return Fact("Contacts", text)
    flag = "off" if count > limits.max_collisions else "ok" if text != NONE else ""
    return Fact("Contacts", text, f"at most {limits.max_collisions}", flag)


def _near_misses_allowed(result: AuditResult) -> str:
    """Without a flag: the rate is judged over all logs of a robot."""
    allowed = None if result.limits is None else result.limits.max_near_misses_per_hour
    return "" if allowed is None else f"at most {significant(allowed)} /h"


def _noticed(result: AuditResult) -> list[Fact]:
    """For each place of the headline the force that would have been noticed, and what is asked."""
    sensitivity = result.sensitivity
    if sensitivity is None or sensitivity.time is None:
        return []
    made = []
    for force in headline_forces(sensitivity):
        found, asked = force.at(sensitivity.time.share), force.asked
        text = force_text(found)
        flag = "" if asked is None else "ok" if found is not None and found <= asked.force_n else "off"
        reference = "" if asked is None else f"{stated(asked.force_n)} N or less"
        made.append(
            Fact(f"Noticed at the {force.place}", f"from {text}" if found is not None else text, reference, flag)
        )
    return made


def _watched(result: AuditResult) -> str:
    """How many, and how many of them were left out in some phase."""
    joints = result.coverage.joints.values()
    parts = sum(joint.watched and "not-watched" in joint.not_judged_s for joint in joints)
    text = f"{sum(joint.watched for joint in joints)} of {len(joints)}"
    return f"{text}, {parts} in part" if parts else text
