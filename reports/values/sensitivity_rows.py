"""Sensitivity over time as text: what would have been noticed along the arm, and on each joint."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from collaudit.core.data.audit_result import AuditResult
from collaudit.core.data.sensitivity_result import FOREARM, TOOL, NoticedForce
from collaudit.core.verdict.noticed_words import (
    force_text,
    headline_forces,
    noticed_sentence,
    place_text,
    too_insensitive,
)
from collaudit.reports.values.numbers import apart, duration, percent, significant, stated
from collaudit.reports.values.rows import NONE
from collaudit.reports.values.words import reason_text, torque_unit

#: Shares of the time that tables show.
SHOWN = (0.5, 0.95)
_BY = {"stated": "stated", "default": "default", "arm-limits": "half of what the arm can exert there"}


@dataclass(frozen=True, slots=True)
class SensitivityRow:
    """What would have been noticed on one joint.

    ``judged``, ``as_range`` and ``not_judged`` are shares of the time in which it was watched: friction known as a
    number, only as a range, nothing to be told. ``half``, ``most`` and ``always`` are the torques that would have
    alarmed in half, in 95 % and in all of the time in which anything can be told; ``asked`` is the torque that must,
    with its share of the motion.
    """

    joint: str
    judged: str
    as_range: str
    not_judged: str
    half: str
    most: str
    always: str
    asked: str
    reasons: tuple[tuple[str, str], ...]


@dataclass(frozen=True, slots=True)
class ForceRow:
    """What force would have been noticed at a place, by share as in :func:`force_shares`; what is asked, and met in."""

    place: str
    joints: str
    forces: tuple[str, ...]
    asked: str
    met: str


def sensitivity_row(joint: str, result: AuditResult) -> SensitivityRow | None:
    """A joint's sensitivity as text; None for joints that were not watched."""
    s = None if result.sensitivity is None else result.sensitivity.joints.get(joint)
    if s is None:
        return None
    unit = torque_unit(result, joint)
    levels = {level.share: level.torque_nm for level in s.levels}
    limit = None if s.asked is None else s.asked.torque_nm
    half, most, always = (
        NONE if value is None else f"{_beside(value, limit)} {unit}"
        for value in (*(levels.get(share) for share in SHOWN), s.largest_nm)
    )
    cover = result.coverage.joints[joint]
    lost_s = sum(cover.not_judged_s.values()) - cover.not_judged_s.get("not-watched", 0.0)
    time_s = cover.judged_s + cover.standing_s + lost_s
    asked = NONE if s.asked is None else f"{stated(s.asked.torque_nm)} {unit}: {percent(s.asked.share)} of its motion"
    return SensitivityRow(
        joint=joint,
        judged=_share(cover.judged_s, time_s),
        as_range=_share(cover.standing_s, time_s),
        not_judged=_share(lost_s, time_s),
        half=half,
        most=most,
        always=always,
        asked=asked,
        reasons=_reasons(joint, result),
    )


def sensitivity_rows(result: AuditResult) -> list[SensitivityRow]:
    """The watched joints' sensitivity as text."""
    made = (sensitivity_row(joint, result) for joint in result.coverage.joints)
    return [row for row in made if row is not None]


def force_shares(result: AuditResult) -> tuple[float, ...]:
    """Shares of the time for which forces are listed: half, that which the policy asks for, 95 %."""
    time = None if result.sensitivity is None else result.sensitivity.time
    return () if time is None else tuple(sorted({*SHOWN, time.share}))


def force_rows(result: AuditResult) -> list[ForceRow]:
    """What force would have been noticed along the arm, base to tool."""
    shares, forces = force_shares(result), () if result.sensitivity is None else result.sensitivity.forces
    return [_force_row(force, shares) for force in forces]


def _force_row(force: NoticedForce, shares: Sequence[float]) -> ForceRow:
    place = {TOOL: TOOL, FOREARM: f"end of {force.link} (forearm)"}.get(force.place, f"end of {force.link}")
    felt = force.unfelt < 1.0
    asked, met = NONE, NONE
    if force.asked is not None:
        asked = f"{stated(force.asked.force_n)} N ({_BY[force.asked.by]})"
        met = f"{percent(force.asked.share)} of the time"
    told = tuple(force_text(force.at(share)) if felt else "not felt" for share in shares)
    return ForceRow(place, ", ".join(force.joints), told, asked, met)


def noticed_line(result: AuditResult) -> str | None:
    """What would have been noticed, in a sentence; None where nothing is told, or the verdict's reasons say it."""
    sensitivity = result.sensitivity
    told = None if sensitivity is None else noticed_sentence(sensitivity)
    if sensitivity is None or told is None or too_insensitive(sensitivity):
        return None
    return None if any(told in reason for reason in result.reasons) else told


def noticed_brief(result: AuditResult) -> str:
    """``52 N at the tool``: the first place of the headline; empty where nothing is told."""
    sensitivity = result.sensitivity
    forces = headline_forces(sensitivity)
    if not forces or sensitivity is None or sensitivity.time is None:
        return ""
    return f"{force_text(forces[0].at(sensitivity.time.share))} at {place_text(forces[0], brief=True)}"


def noticed_n(result: AuditResult) -> float | None:
    """The force of :func:`noticed_brief`, N; None where there is none."""
    sensitivity = result.sensitivity
    forces = headline_forces(sensitivity)
    return forces[0].at(sensitivity.time.share) if forces and sensitivity is not None and sensitivity.time else None


def lost_share(result: AuditResult) -> float | None:
    """Share of the watched joints' time, all together, that could not be judged; None where nothing was watched.

    Time in which one of them was not watched, as under force control, counts as not judged here.
    """
    watched = [cover for cover in result.coverage.joints.values() if cover.watched]
    lost = sum(sum(cover.not_judged_s.values()) for cover in watched)
    time_s = lost + sum(cover.judged_s + cover.standing_s for cover in watched)
    return lost / time_s if time_s > 0 else None


def _beside(value: float, limit: float | None) -> str:
    """A torque in three digits, or as many as it takes to differ from what was asked for."""
    text = significant(value)
    if limit is None or text != significant(limit) or value == limit:
        return text
    return apart([value, limit], 1)[0]


def _reasons(joint: str, result: AuditResult) -> tuple[tuple[str, str], ...]:
    found = sorted(result.coverage.joints[joint].not_judged_s.items(), key=lambda item: (-item[1], item[0]))
    return tuple((reason_text(code), duration(seconds)) for code, seconds in found if seconds > 0)


def _share(part_s: float, time_s: float) -> str:
    return percent(part_s / time_s) if time_s > 0 else NONE
